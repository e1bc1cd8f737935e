// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>

#include "eliminate/lens_kernels.h"
#include "reduced/camera_solver.h"

namespace sheaf {

/// Conjugate gradients over the blocks of images and lenses with nothing formed, in double. `held`
/// gives the held state when a system is solved; its x is not read.
std::unique_ptr<CameraSolver> make_lens_implicit_solver(const Columns& columns,
                                                        const Chunks& chunks,
                                                        std::function<LensProductInput()> held,
                                                        const LensKernels& kernels,
                                                        Threads& threads);

}  // namespace sheaf
