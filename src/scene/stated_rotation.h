// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "geometry/rotation.h"
#include "sheaf/problem.h"

namespace sheaf {

inline bool same_bits(const Quaternion<double>& a, const Quaternion<double>& b) {
  for (std::size_t k = 0; k < 4; ++k)
    if (std::bit_cast<std::uint64_t>(a[k]) != std::bit_cast<std::uint64_t>(b[k])) return false;
  return true;
}

inline bool same_bits(const Pose& a, const Pose& b) {
  for (std::size_t k = 0; k < 3; ++k)
    if (std::bit_cast<std::uint64_t>(a.translation[k]) !=
        std::bit_cast<std::uint64_t>(b.translation[k]))
      return false;
  return same_bits(a.rotation, b.rotation);
}

/// A quaternion as a file stated it: itself where its length is 1 to rounding, else normalised.
/// Not of unit length for one that has no direction, or a length that is absurd.
inline Quaternion<double> rotation_from_stated(const std::array<double, 4>& q) {
  const double norm2 = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
  return std::abs(norm2 - 1) < 4e-15 ? q : normalized(q);
}

/// A pose of which a file states qw qx qy qz tx ty tz, likewise.
inline Pose pose_from_stated(const std::array<double, 7>& n) {
  return {rotation_from_stated(Quaternion<double>{n[0], n[1], n[2], n[3]}), {n[4], n[5], n[6]}};
}

/// Whether the numbers of a pose have a unit quaternion, to rounding: all programs take it alike.
inline bool states_a_rotation(const std::array<double, 7>& n) {
  const Quaternion<double> q{n[0], n[1], n[2], n[3]};
  return same_bits(rotation_from_stated(q), q);
}

/// The rotation of a row-major matrix that is one as nearly as its digits allow; the quaternion
/// is taken from the largest of its four squares.
inline Quaternion<double> rotation_from_stated(const std::array<double, 9>& m) {
  const double x2 = 1 + m[0] - m[4] - m[8], y2 = 1 - m[0] + m[4] - m[8];
  const double z2 = 1 - m[0] - m[4] + m[8], w2 = 1 + m[0] + m[4] + m[8];
  const double a = m[7] - m[5], b = m[2] - m[6], c = m[3] - m[1];
  const double d = m[1] + m[3], e = m[2] + m[6], f = m[5] + m[7];
  if (w2 >= x2 && w2 >= y2 && w2 >= z2) return normalized(Quaternion<double>{w2, a, b, c});
  if (x2 >= y2 && x2 >= z2) return normalized(Quaternion<double>{a, x2, d, e});
  if (y2 >= z2) return normalized(Quaternion<double>{b, d, y2, f});
  return normalized(Quaternion<double>{c, e, f, z2});
}

/// What stands where a row-major matrix should be a rotation, as far as a file of few digits can
/// state one; null where it is one.
inline const char* no_rotation(const std::array<double, 9>& R) {
  for (std::size_t a = 0; a < 9; a += 3)
    for (std::size_t b = 0; b < 9; b += 3) {
      const double product = R[a] * R[b] + R[a + 1] * R[b + 1] + R[a + 2] * R[b + 2];
      if (!(std::abs(product - (a == b)) < 1e-3)) return "rows that are not orthonormal";
    }
  const Vector3<double> third = cross<double>({R[0], R[1], R[2]}, {R[3], R[4], R[5]});
  return third[0] * R[6] + third[1] * R[7] + third[2] * R[8] > 0 ? nullptr : "a reflection";
}

/// t = -R C of a camera at C.
inline std::array<double, 3> translation_of(const Quaternion<double>& q,
                                            const std::array<double, 3>& C) {
  const Vector3<double> moved = multiply(matrix_from_quaternion(q), Vector3<double>(C));
  return {-moved[0], -moved[1], -moved[2]};
}

/// C = -R^T t; where `stated` (3 for each image) has one that gives the pose bit for bit, that.
inline std::array<double, 3> centre_of(const Problem& problem, std::size_t image,
                                       const std::vector<double>* stated) {
  const Pose& pose = problem.poses[image];
  if (stated != nullptr && stated->size() == 3 * problem.num_images()) {
    std::array<double, 3> centre;
    std::copy_n(&(*stated)[3 * image], 3, centre.begin());
    if (translation_of(pose.rotation, centre) == pose.translation) return centre;
  }
  const auto& [w, x, y, z] = pose.rotation;
  return translation_of({w, -x, -y, -z}, pose.translation);
}

/// What the metadata have an image's rotation as (4 or 9 numbers), where the pose's quaternion is
/// still the one that this converts to, bit for bit; else null. For files that come back as they
/// were read, since to others it may say another rotation.
inline const double* stated_numbers(const Problem& problem, std::size_t image, std::size_t count) {
  if (problem.metadata == nullptr) return nullptr;
  const std::vector<double>& all = problem.metadata->stated_rotations;
  if (all.size() != count * problem.num_images() || all.empty()) return nullptr;
  const double* stated = &all[count * image];
  Quaternion<double> converted;
  if (count == 9) {
    std::array<double, 9> m;
    std::copy_n(stated, 9, m.begin());
    converted = rotation_from_stated(m);
  } else {
    converted =
        rotation_from_stated(Quaternion<double>{stated[0], stated[1], stated[2], stated[3]});
  }
  return same_bits(converted, problem.poses[image].rotation) ? stated : nullptr;
}

/// The rotation of an image as its file stated it (angle-axis, radians), where the pose's
/// quaternion is still the one that this converts to, bit for bit.
inline std::optional<Vector3<double>> stated_rotation(const Problem& problem, std::size_t image) {
  if (problem.bal_angle_axis.empty()) return {};
  const double* a = &problem.bal_angle_axis[3 * image];
  const Vector3<double> stated{a[0], a[1], a[2]};
  if (!same_bits(quaternion_from_angle_axis(stated), problem.poses[image].rotation)) return {};
  return stated;
}

}  // namespace sheaf
