// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "sheaf/scene.h"

namespace sheaf {

/// Errors: ErrorCode::usage for counts that cannot be met and noises that are not finite or below
/// 0.
Result<void> check_scene(const SceneOptions& options);

}  // namespace sheaf
