// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "solve_arguments.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <string_view>
#include <vector>

#include "platform/real_text.h"
#include "verb.h"

namespace sheaf {
namespace {

const std::map<std::string, Cheirality> kCheiralities = {{"formula", Cheirality::formula},
                                                         {"reject", Cheirality::reject},
                                                         {"hold-out", Cheirality::hold_out}};
const std::map<std::string, PointParametrisation> kParametrisations = {
    {"xyz", PointParametrisation::xyz},
    {"homogeneous", PointParametrisation::homogeneous},
    {"inverse-depth", PointParametrisation::inverse_depth}};
const std::map<std::string, CameraSolverKind> kSolvers = {
    {"auto", CameraSolverKind::automatic},
    {"dense", CameraSolverKind::dense},
    {"sparse", CameraSolverKind::sparse},
    {"iterative", CameraSolverKind::iterative},
    {"iterative-explicit", CameraSolverKind::iterative_explicit},
    {"iterative-implicit", CameraSolverKind::iterative_implicit}};
const std::map<std::string, Precision> kPrecisions = {
    {"auto", Precision::automatic}, {"double", Precision::full}, {"mixed", Precision::mixed}};
const std::map<std::string, Simd> kSimds = {{"best", Simd::best},     {"scalar", Simd::scalar},
                                            {"sse4", Simd::sse4},     {"avx2", Simd::avx2},
                                            {"avx512", Simd::avx512}, {"neon", Simd::neon}};

/// How the camera system is solved, in what, and within which memory.
void add_solver_options(CLI::App& verb, SolveArguments& a) {
  const double most = std::numeric_limits<double>::max();
  verb.add_option("--solver", a.solver,
                  "how the camera system is solved: auto (by counted work), dense (formed, "
                  "Cholesky), sparse (formed by blocks, Cholesky in an order that keeps fill low), "
                  "iterative (conjugate gradients; iterative-explicit on the formed blocks, "
                  "iterative-implicit with nothing formed)")
      ->type_name("NAME")
      ->check(one_of(
          {"auto", "dense", "sparse", "iterative", "iterative-explicit", "iterative-implicit"}))
      ->capture_default_str();
  verb.add_option("--precision", a.precision,
                  "inside the solver of the camera system: double, mixed (float where the solver "
                  "can; state, gradient and costs stay double) or auto (mixed where it is quicker "
                  "and ends where double does)")
      ->type_name("NAME")
      ->check(one_of({"auto", "double", "mixed"}))
      ->capture_default_str();
  verb.add_option("--memory-limit", a.memory_limit_bytes,
                  "take a leaner solver, or refuse (exit 5), rather than exceed this many bytes; "
                  "units K, M, G are powers of 1024")
      ->type_name("BYTES")
      ->transform(CLI::AsSizeValue(false));
  verb.add_option(
          "--trust-region", a.trust_region,
          "what follows a rejected step: lm (more damping, everything computed again) or "
          "dogleg (the same factorisation, a shorter step; with an iterative solver "
          "Steihaug's, which also ends conjugate gradients at the radius; with --points xyz "
          "only)")
      ->type_name("NAME")
      ->check(one_of({"lm", "dogleg"}))
      ->capture_default_str();
  verb.add_option("--initial-damping", a.initial_damping, "0: chosen by rule")
      ->type_name("LAMBDA")
      ->check(number_in(0, most, true, "a number from 0 up"))
      ->capture_default_str();
  verb.add_option("--inner-iterations", a.inner_iterations,
                  "at most so many Gauss-Newton steps of each point by itself in every step, once "
                  "the cameras have stepped; 0: none")
      ->type_name("N")
      ->check(whole_number_from(0, "a whole number from 0 up"))
      ->capture_default_str();
  verb.add_option(
          "--simd", a.simd,
          "instruction set: best, scalar, sse4, avx2, avx512, neon (for tests and measurements)")
      ->type_name("NAME")
      ->check(one_of({"best", "scalar", "sse4", "avx2", "avx512", "neon"}))
      ->capture_default_str();
}

constexpr LossKind kLosses[] = {LossKind::none,   LossKind::huber, LossKind::soft_l1,
                                LossKind::cauchy, LossKind::tukey, LossKind::geman_mcclure};

bool parse_loss_name(std::string_view name, LossKind& out) {
  for (LossKind kind : kLosses)
    if (name == to_string(kind)) {
      out = kind;
      return true;
    }
  return false;
}

bool parse_scale(std::string_view text, double& scale_px) {
  scale_px = kAutomaticScale;
  if (text.empty() || text == "auto") return true;
  const char* end = text.data() + text.size();
  const auto [stop, error] = read_real(text.data(), end, scale_px);
  return error == std::errc() && stop == end && scale_px > 0 && std::isfinite(scale_px);
}

/// Cuts the text up to the next colon off its front.
std::string_view cut(std::string_view& rest) {
  const std::size_t colon = std::min(rest.find(':'), rest.size());
  const std::string_view part = rest.substr(0, colon);
  rest.remove_prefix(std::min(colon + 1, rest.size()));
  return part;
}

}  // namespace

std::string parse_loss(const std::string& text, Loss& out) {
  std::string_view rest = text;
  const bool named = parse_loss_name(cut(rest), out.kind);
  if (named && out.kind == LossKind::none && text == "none") return "";
  constexpr std::string_view kGraduated = "gnc";
  out.graduated = rest == kGraduated || rest.ends_with(":gnc");
  if (out.graduated) rest.remove_suffix(std::min(rest.size(), kGraduated.size() + 1));
  if (!named || out.kind == LossKind::none || text.ends_with(':') ||
      !parse_scale(rest, out.scale_px))
    return fmt::format(
        "expected none, or huber, soft-l1, cauchy, tukey or geman-mcclure with :auto or a :SCALE "
        "above 0 in pixels, not '{}'",
        text);
  const bool convex = out.kind == LossKind::huber || out.kind == LossKind::soft_l1;
  if (out.graduated && convex)
    return fmt::format("{} is convex: :gnc is for cauchy, tukey and geman-mcclure",
                       to_string(out.kind));
  return "";
}

namespace {

/// What is minimised.
void add_model_options(CLI::App& verb, SolveArguments& a) {
  verb.add_option("--loss", a.loss,
                  "what large residuals count less by: none, huber, soft-l1, cauchy, tukey or "
                  "geman-mcclure, as NAME:SCALE in pixels or NAME:auto (the scale follows the "
                  "median residual, in rounds); :gnc at the end starts the last three wide and "
                  "tightens them")
      ->type_name("NAME[:SCALE|:auto][:gnc]")
      ->check(parsed_by<Loss>(parse_loss))
      ->capture_default_str();
  verb.add_option(
          "--cheirality", a.cheirality,
          "observations behind their camera: formula (count them as the model does), reject "
          "(refuse steps that add some), hold-out (leave those at the start out, then as "
          "reject)")
      ->type_name("RULE")
      ->check(one_of({"formula", "reject", "hold-out"}))
      ->capture_default_str();
  verb.add_option("--points", a.points,
                  "the coordinates in which a point steps: xyz, homogeneous (a unit 4-vector) or "
                  "inverse-depth (bearing and inverse depth from the first image that sees it); "
                  "the last two pass through infinity")
      ->type_name("NAME")
      ->check(one_of({"xyz", "homogeneous", "inverse-depth"}))
      ->capture_default_str();
  add_refinement_options(verb, a.refinement, "hold these to the last bit");
}

/// When it ends.
void add_stopping_options(CLI::App& verb, SolveArguments& a) {
  const double inf = std::numeric_limits<double>::infinity();
  const double most = std::numeric_limits<double>::max();
  verb.add_option("--max-iterations", a.max_iterations, "steps to try, rejected ones included")
      ->type_name("N")
      ->check(whole_number_from(0, "a whole number from 0 up"))
      ->capture_default_str();
  verb.add_option("--tolerance", a.tolerance,
                  "stop when the relative decrease of the cost stays below this twice")
      ->type_name("T")
      ->check(number_in(0, most, true, "a number from 0 up"))
      ->capture_default_str();
  verb.add_option("--time-limit", a.time_limit_s,
                  "stop after this many seconds of set-up and solving, write the best state and "
                  "exit with 130")
      ->type_name("SECONDS")
      ->check(number_in(0, inf, false, "a number of seconds above 0"));
}

}  // namespace

void add_solve_options(CLI::App& verb, SolveArguments& a) {
  add_stopping_options(verb, a);
  add_model_options(verb, a);
  add_solver_options(verb, a);
}

SolveOptions solve_options(const SolveArguments& a) {
  SolveOptions options;
  options.max_iterations = a.max_iterations;
  options.tolerance = a.tolerance;
  if (a.time_limit_s > 0) options.time_limit_s = a.time_limit_s;
  parse_loss(a.loss, options.loss);
  options.cheirality = kCheiralities.at(a.cheirality);
  options.points = kParametrisations.at(a.points);
  options.solver = kSolvers.at(a.solver);
  options.precision = kPrecisions.at(a.precision);
  options.memory_limit_bytes = a.memory_limit_bytes;
  options.trust_region = a.trust_region == "dogleg" ? TrustRegion::dogleg : TrustRegion::lm;
  options.initial_damping = a.initial_damping;
  options.inner_iterations = a.inner_iterations;
  options.simd = kSimds.at(a.simd);
  return options;
}

}  // namespace sheaf
