// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "eliminate/kernels.h"
#include "sheaf/error.h"

namespace sheaf {

/// Plain scalar code, one observation at a time: the twin that the others are tested against.
const Kernels& reference_kernels();

/// The compiled instruction sets that this machine can run, the best first.
std::vector<const Kernels*> available_kernels();

}  // namespace sheaf
