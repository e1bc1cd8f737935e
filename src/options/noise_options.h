// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "options/option_field.h"
#include "sheaf/scene.h"

namespace sheaf {

/// "sheaf", "ceres", "rootba".
const char* name_of(NoiseProtocol protocol);

/// The options of a disturbance. Setting the protocol, which is the first, sets all others to what
/// it was published with.
const OptionTable<NoiseOptions>& noise_fields();

}  // namespace sheaf
