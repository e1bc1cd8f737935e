// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "summary_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace sheaf {

std::string counts_text(const Problem& problem) {
  std::string images = fmt::format("{} images", problem.num_images());
  if (problem.cameras.size() != problem.num_images())
    images += fmt::format(" ({} cameras)", problem.cameras.size());
  return fmt::format("{}, {} points, {} observations", images, problem.num_points(),
                     problem.num_observations());
}

namespace {

/// A number, or words where it is none.
std::string number_text(double value, int digits) {
  return std::isfinite(value) ? fmt::format("{:.{}e}", value, digits) : "not finite";
}

/// "cauchy, scale 0.932 px (sigma 3.51, 0.52, 0.366 px in 3 rounds)"
std::string loss_text(const Summary& s) {
  std::string rounds;
  for (const LossRound& round : s.rounds)
    rounds += fmt::format("{}{:.4g}", rounds.empty() ? "" : ", ",
                          round.sigma_px > 0 ? round.sigma_px : round.scale_px);
  std::string out = fmt::format("{}, scale {:.4g} px", to_string(s.loss), s.rounds.back().scale_px);
  if (s.final_sigma_px > 0 || s.rounds.size() > 1)
    out += fmt::format(" ({} {} px in {} round{})", s.final_sigma_px > 0 ? "sigma" : "scale",
                       rounds, s.rounds.size(), s.rounds.size() == 1 ? "" : "s");
  return out;
}

}  // namespace

std::string checkpoints_text(const Summary& s) {
  std::string out;
  if (s.resumed_after >= 0)
    out += fmt::format("resumed     after step {} of a checkpoint\n", s.resumed_after);
  if (!s.checkpoint_failure.empty())
    out += fmt::format("note        no checkpoint could be written: {}\n", s.checkpoint_failure);
  return out;
}

std::string summary_text(const Summary& s, double read_s) {
  const auto steps = s.iterations.empty() ? 0 : s.iterations.size() - 1;
  const auto rejected = std::count_if(s.iterations.begin(), s.iterations.end(),
                                      [](const Iteration& it) { return !it.accepted; });
  std::string out;
  out += fmt::format("cost        {} -> {}\n", number_text(s.initial_cost, 9),
                     number_text(s.final_cost, 9));
  if (s.loss != LossKind::none) {
    out += fmt::format("loss        {}\n", loss_text(s));
    out += fmt::format("plain cost  {} -> {}\n", number_text(s.initial_plain_cost, 9),
                       number_text(s.final_plain_cost, 9));
  }
  if (std::isfinite(s.initial_rms_px) && std::isfinite(s.final_rms_px))
    out += fmt::format("rms         {:.6g} -> {:.6g} px\n", s.initial_rms_px, s.final_rms_px);
  out += fmt::format("iterations  {}{}\n", steps,
                     rejected > 0 ? fmt::format(" ({} rejected)", rejected) : "");
  out += checkpoints_text(s);
  for (const Recovery& r : s.recoveries)
    out += fmt::format(
        "recovery    after step {}: {} passes of resection and intersection, {}, cost {:.6g} -> "
        "{:.6g}{}\n",
        r.after_step, r.passes, r.from_start ? "from the start" : "from there", r.cost_before,
        r.cost_after, r.taken ? "" : "; not taken");
  out += fmt::format("stopped     {}\n", s.words);
  for (const BoundReached& at : s.at_bounds)
    out += fmt::format("at bound    {} of camera {} at its {} bound {:.9g}\n", at.name, at.camera,
                       at.upper ? "upper" : "lower", at.value);
  out += fmt::format("time        read {:.3f} s, set-up {:.3f} s, solve {:.3f} s\n", read_s,
                     s.setup_s, s.solve_s);
  out += fmt::format("solver      {} ({}); {}, {}, {} thread{}\n", s.solver, s.solver_reason,
                     s.precision, s.simd, s.threads, s.threads == 1 ? "" : "s");
  if (!s.behind_camera_before.empty() || !s.behind_camera_after.empty())
    out += fmt::format("behind      {} -> {} observations behind their camera\n",
                       s.behind_camera_before.size(), s.behind_camera_after.size());
  if (!s.rejected_observations.empty())
    out += fmt::format("left out    {} observations\n", s.rejected_observations.size());
  return out;
}

}  // namespace sheaf
