// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
//
// Covariances of a BAL problem by Ceres' dense SVD, derivatives by its automatic differentiation:
//   peer-ceres-covariance PROBLEM.txt OUT.json
// sigma 1; the first pose is held, and the coordinate of the second one's translation along the
// largest part of their baseline in its frame. OUT: 3 x 3 of each camera's translation and of its
// f, k1, k2, and of each point.
#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <utility>
#include <vector>

#include "bal_file.h"

namespace {

struct Reprojection {
  double u, v;
  template <class T>
  bool operator()(const T* camera, const T* point, T* residual) const {
    T P[3];
    ceres::AngleAxisRotatePoint(camera, point, P);
    for (int k = 0; k < 3; ++k) P[k] += camera[3 + k];
    const T x = -P[0] / P[2], y = -P[1] / P[2], n = x * x + y * y;
    const T scale = camera[6] * (T(1) + n * (camera[7] + n * camera[8]));
    residual[0] = scale * x - T(u);
    residual[1] = scale * y - T(v);
    return true;
  }
};

int held_coordinate(const peer::BalFile& file) {
  const double *first = file.cameras.data(), *second = first + peer::camera_size;
  double back[3] = {-first[0], -first[1], -first[2]}, centre[3], seen[3];
  ceres::AngleAxisRotatePoint(back, first + 3, centre);
  for (double& x : centre) x = -x;
  ceres::AngleAxisRotatePoint(second, centre, seen);
  int largest = 0;
  for (int k = 0; k < 3; ++k) {
    seen[k] += second[3 + k];
    if (std::abs(seen[k]) > std::abs(seen[largest])) largest = k;
  }
  return largest;
}

/// 3 x 3 of a block's covariance, from a row and column on.
void put(std::ofstream& out, const std::vector<double>& C, int size, int first) {
  out << "[";
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k)
      out << (i + k > 0 ? ", " : "") << C[static_cast<std::size_t>(size * (first + i) + first + k)];
  out << "]";
}

}  // namespace

int main(int count, char** words) {
  peer::BalFile file;
  if (count != 3 || !peer::read_bal(words[1], file)) {
    std::fprintf(stderr, "usage: peer-ceres-covariance PROBLEM.txt OUT.json\n");
    return 2;
  }
  ceres::Problem problem;
  for (const auto& o : file.observations)
    problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<Reprojection, 2, 9, 3>(new Reprojection{o.u, o.v}), nullptr,
        &file.cameras[static_cast<std::size_t>(9 * o.camera)],
        &file.points[static_cast<std::size_t>(3 * o.point)]);
  problem.SetManifold(file.cameras.data(), new ceres::SubsetManifold(9, {0, 1, 2, 3, 4, 5}));
  problem.SetManifold(&file.cameras[9], new ceres::SubsetManifold(9, {3 + held_coordinate(file)}));
  std::vector<std::pair<const double*, const double*>> blocks;
  for (int c = 0; c < file.camera_count(); ++c)
    blocks.push_back({&file.cameras[static_cast<std::size_t>(9 * c)],
                      &file.cameras[static_cast<std::size_t>(9 * c)]});
  for (int p = 0; p < file.point_count(); ++p)
    blocks.push_back({&file.points[static_cast<std::size_t>(3 * p)],
                      &file.points[static_cast<std::size_t>(3 * p)]});
  ceres::Covariance::Options options;
  options.algorithm_type = ceres::DENSE_SVD;
  options.min_reciprocal_condition_number = 1e-30;
  ceres::Covariance covariance(options);
  if (!covariance.Compute(blocks, &problem)) {
    std::fprintf(stderr, "Ceres found no covariance\n");
    return 4;
  }
  std::ofstream out(words[2]);
  out.precision(17);
  const auto put_all = [&](const char* name, int size, int first, int count, double* from) {
    out << "\"" << name << "\": [";
    for (int b = 0; b < count; ++b) {
      std::vector<double> C(static_cast<std::size_t>(size * size));
      const double* block = from + size * b;
      covariance.GetCovarianceBlock(block, block, C.data());
      if (b > 0) out << ", ";
      put(out, C, size, first);
    }
    out << "]";
  };
  out << "{";
  put_all("translations", 9, 3, file.camera_count(), file.cameras.data());
  out << ", ";
  put_all("lenses", 9, 6, file.camera_count(), file.cameras.data());
  out << ", ";
  put_all("points", 3, 0, file.point_count(), file.points.data());
  out << "}\n";
  return out.good() ? 0 : 6;
}
