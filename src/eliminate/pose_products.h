// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace sheaf {

/// Matrices of poses, 6 x 6 with rows eight apart, as tiles of sums have them; what stands in the
/// two columns beyond is of no consequence. They begin at multiples of 64 bytes.
constexpr int kPoseMatrix = 48;

/// One instruction set's products of them.
struct PoseProducts {
  const char* name;
  /// sum += A^T B M; A, M: nullptr for the identity.
  void (*add)(const double* A, const double* B, const double* M, double* sum);
};
/// simd_name: as of Kernels; "scalar" gives the reference.
const PoseProducts& pose_products(const char* simd_name);

/// Plain scalar code: the twin that the others are tested against.
const PoseProducts& reference_pose_products();

}  // namespace sheaf
