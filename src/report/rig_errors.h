// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "report/errors.h"

namespace sheaf {

/// Both problems have the same images in the same order; `similarity` brings the estimate to the
/// reference.
RigErrorLists list_rig_errors(const Problem& estimate, const Problem& reference,
                              const Similarity& similarity);

}  // namespace sheaf
