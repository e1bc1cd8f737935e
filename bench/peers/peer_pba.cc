// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
//
// Multicore bundle adjustment (PBA; Wu, Agarwal, Curless, Seitz, CVPR 2011) on a BAL file, on the
// CPU. Its camera has a focal length and one radial term: files whose k2 are not zero are refused.
// The words of --config:
//   float | double                arithmetic inside; its input and output are float in both
//   schur                         conjugate gradients on the reduced camera system
//   cg=100  eta=0.1               most conjugate gradient steps, and their relative norm
//   damping=1e-3                  first damping
// Its stops by a small step or a small error are switched off, as for every peer. What it counts is
// a cost in float; the state it ends with is rounded to float as well.
#include <pba.h>

#include <algorithm>
#include <cstdio>
#include <numeric>
#include <string>
#include <vector>

#include "bal_camera.h"
#include "bal_file.h"
#include "line_watch.h"
#include "run_record.h"

namespace {

/// The arrays PBA works on; it looks along +z where BAL looks along -z: both y are turned.
struct Arrays {
  std::vector<pba::CameraT> cameras;
  std::vector<pba::Point3D> points;
  std::vector<pba::Point2D> measured;
  std::vector<int> point_of, camera_of;
};

constexpr double turned[3] = {1, -1, -1};

Arrays make_arrays(const peer::BalFile& file) {
  Arrays a;
  a.cameras.resize(file.camera_count());
  for (int i = 0; i < file.camera_count(); ++i) {
    const double* values = &file.cameras[9 * i];
    double R[9];
    peer::rotation(values, R, nullptr);
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c)
        a.cameras[i].m[r][c] = static_cast<float>(turned[r] * R[3 * r + c]);
      a.cameras[i].t[r] = static_cast<float>(turned[r] * values[3 + r]);
    }
    a.cameras[i].f = static_cast<float>(values[6]);
    a.cameras[i].SetProjectionDistortion(values[7]);
  }
  a.points.resize(file.point_count());
  for (int i = 0; i < file.point_count(); ++i) a.points[i].SetPoint(&file.points[3 * i]);
  // It wants the observations point by point.
  std::vector<std::size_t> order(file.observations.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t l, std::size_t r) {
    return file.observations[l].point < file.observations[r].point;
  });
  for (const std::size_t k : order) {
    const auto& o = file.observations[k];
    a.measured.emplace_back(o.u, -o.v);
    a.point_of.push_back(o.point);
    a.camera_of.push_back(o.camera);
  }
  return a;
}

void store(const Arrays& a, peer::BalFile& file) {
  for (int i = 0; i < file.camera_count(); ++i) {
    double* values = &file.cameras[9 * i];
    double R[9];
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) R[3 * r + c] = turned[r] * a.cameras[i].m[r][c];
      values[3 + r] = turned[r] * a.cameras[i].t[r];
    }
    peer::angle_axis(R, values);
    values[6] = a.cameras[i].f;
    values[7] = a.cameras[i].GetProjectionDistortion();
    values[8] = 0;
  }
  for (int i = 0; i < file.point_count(); ++i) a.points[i].GetPoint(&file.points[3 * i]);
}

void set_options(peer::Config& config, const peer::Arguments& arguments, pba::ParallelBA& solver) {
  pba::ConfigBA& options = *solver.GetInternalConfig();
  solver.EnableRadialDistortion(pba::ParallelBA::PBA_PROJECTION_DISTORTION);
  options.__lm_max_iteration = arguments.max_iterations;
  options.__lm_delta_threshold = 0;
  options.__lm_mse_threshold = 0;
  options.__cg_schur_complement = config.has("schur");
  options.__cg_max_iteration = static_cast<int>(config.value("cg", options.__cg_max_iteration));
  options.__cg_norm_threshold =
      static_cast<float>(config.value("eta", options.__cg_norm_threshold));
  options.__lm_initial_damp =
      static_cast<float>(config.value("damping", options.__lm_initial_damp));
  options.__verbose_level = 2;  // one line for each step, which the watch reads
  // Left alone, one of its products takes twice the threads it was given.
  if (arguments.threads == 1) {
    char name[] = "-tnum", count[] = "1";
    char* words[] = {name, count};
    solver.ParseParam(2, words);
  }
}

int solve(const peer::Arguments& arguments) {
  peer::Config config(arguments.config);
  const bool in_double = config.has("double");
  if (in_double == config.has("float")) {
    std::fprintf(stderr, "unknown configuration '%s'\n", arguments.config.c_str());
    return 2;
  }
  peer::BalFile file;
  if (!peer::read_bal(arguments.input, file)) return 3;
  for (int i = 0; i < file.camera_count(); ++i)
    if (file.cameras[9 * i + 8] != 0) {
      std::fprintf(stderr, "PBA's camera has no k2, and the file's are not zero\n");
      return 3;
    }

  peer::RunRecord record;
  record.counts_in_float();
  record.start();
  Arrays arrays = make_arrays(file);
  pba::ParallelBA* running = nullptr;
  const peer::LineWatch watch([&](const std::string& line) {
    const bool starts = line.rfind("Initial ", 0) == 0;
    if (starts) record.setup_done();
    if (!starts && line.rfind('#', 0) != 0) return;
    const bool accepted = line.find("r=-----") == std::string::npos;
    record.add(0.5 * running->GetMeanSquaredError() * static_cast<double>(arrays.measured.size()),
               accepted);
    if (record.over(arguments)) running->AbortBundleAdjustment();
  });
  using Solver = pba::ParallelBA;
  Solver solver(in_double ? Solver::PBA_CPU_DOUBLE : Solver::PBA_CPU_FLOAT, arguments.threads);
  running = &solver;
  set_options(config, arguments, solver);
  if (!config.unknown().empty()) {
    std::fprintf(stderr, "unknown configuration '%s'\n", arguments.config.c_str());
    return 2;
  }
  solver.SetCameraData(arrays.cameras.size(), arrays.cameras.data());
  solver.SetPointData(arrays.points.size(), arrays.points.data());
  solver.SetProjection(arrays.measured.size(), arrays.measured.data(), arrays.point_of.data(),
                       arrays.camera_of.data());
  solver.RunBundleAdjustment();
  record.finish();
  store(arrays, file);
  if (!arguments.output.empty() && !peer::write_bal(arguments.output, file)) return 6;
  std::fputs(record.json("pba", arguments).c_str(), stdout);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  peer::Arguments arguments;
  if (!peer::parse_arguments(argc, argv, arguments)) return 2;
  if (!peer::can_hold("PBA", arguments, {})) return 2;
  if (arguments.test) {
    std::fprintf(stderr, "PBA has derivatives of its own: nothing to test here\n");
    return 2;
  }
  return solve(arguments);
}
