// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "options/option_field.h"
#include "sheaf/covariance.h"

namespace sheaf {

/// The options of covariances; what is held, and of which points is told, needs the problem.
const OptionTable<CovarianceOptions>& covariance_fields();

}  // namespace sheaf
