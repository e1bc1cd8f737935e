// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "photometric/photometric_arguments.h"

#include <limits>
#include <map>

#include "solve_arguments.h"
#include "verb.h"

namespace sheaf {
namespace {

const std::map<std::string, Interpolation> kInterpolations = {
    {"bicubic", Interpolation::bicubic},
    {"bilinear", Interpolation::bilinear},
    {"bilinear-exact", Interpolation::bilinear_exact}};

const std::map<std::string, Warp> kWarps = {{"auto", Warp::automatic},
                                            {"translation", Warp::translation},
                                            {"inverse-depth", Warp::inverse_depth}};
const std::map<std::string, Parametrisation> kParametrisations = {
    {"auto", Parametrisation::automatic},
    {"xyz", Parametrisation::xyz},
    {"inverse-depth", Parametrisation::inverse_depth}};

/// A loss of measured positions: its scale is in their standard deviations.
std::string parse_anchor_loss(const std::string& text, Loss& out) {
  if (std::string wrong = parse_loss(text, out); !wrong.empty()) return wrong;
  if (out.graduated || (out.kind != LossKind::none && out.scale_px == kAutomaticScale))
    return "expected a loss with a :SCALE in standard deviations, not '" + text + "'";
  return "";
}

void add_model_options(CLI::App& verb, PhotometricArguments& a) {
  verb.add_option("--interpolation", a.interpolation,
                  "bicubic (Catmull-Rom, exact slopes), bilinear (slopes are central differences) "
                  "or bilinear-exact")
      ->type_name("NAME")
      ->check(one_of({"bicubic", "bilinear", "bilinear-exact"}))
      ->capture_default_str();
  verb.add_option("--brightness", a.brightness,
                  "affine (every image shows a L + b of the grey level L) or none")
      ->type_name("NAME")
      ->check(one_of({"affine", "none"}))
      ->capture_default_str();
  verb.add_option("--loss", a.loss,
                  "none, huber, soft-l1, cauchy, tukey or geman-mcclure, as NAME:SCALE in grey "
                  "levels or NAME:auto (from the median residual)")
      ->type_name("NAME[:SCALE|:auto]")
      ->check(CLI::Validator(
          [](std::string& text) {
            Loss loss;
            if (std::string wrong = parse_loss(text, loss); !wrong.empty()) return wrong;
            return std::string(loss.graduated ? "expected a loss without :gnc" : "");
          },
          ""))
      ->capture_default_str();
  verb.add_option("--loss-on", a.loss_on,
                  "pixel (each residual by itself) or patch (a patch's residuals as one vector)")
      ->type_name("NAME")
      ->check(one_of({"pixel", "patch"}))
      ->capture_default_str();
  verb.add_option("--leaving", a.leaving,
                  "a patch that leaves its image costs as much as before (truncated), or nothing, "
                  "and any patch may come in (free: what many implementations do)")
      ->type_name("RULE")
      ->check(one_of({"truncated", "free"}))
      ->capture_default_str();
  verb.add_option("--fix", a.fix, "hold poses or points")
      ->type_name("NAME")
      ->check(one_of({"poses", "points"}));
}

/// How points stand for patches, and which of these count.
void add_patch_options(CLI::App& verb, PhotometricArguments& a) {
  verb.add_option("--points", a.points,
                  "xyz (three numbers a point) or inverse-depth (one, along the ray of its host "
                  "image); auto: inverse-depth where hosts.txt names hosts")
      ->type_name("NAME")
      ->check(one_of({"auto", "xyz", "inverse-depth"}))
      ->capture_default_str();
  verb.add_option("--warp", a.warp,
                  "translation (a patch moves as a whole) or inverse-depth (each of its pixels is "
                  "projected by itself); auto: as --points")
      ->type_name("NAME")
      ->check(one_of({"auto", "translation", "inverse-depth"}))
      ->capture_default_str();
  verb.add_option("--pattern", a.pattern, "pixels of a patch that is taken from a host image")
      ->type_name("NAME")
      ->check(one_of(pattern_names()))
      ->capture_default_str();
  verb.add_option("--levels", a.levels,
                  "of the pyramid, from coarse to fine; more than 1 need hosts.txt")
      ->type_name("N")
      ->check(whole_number_from(1, "a whole number from 1 to 6"))
      ->capture_default_str();
  verb.add_option("--rounds", a.rounds,
                  "at most, on each level: which patches are seen is decided again at each start")
      ->type_name("N")
      ->check(whole_number_from(1, "a whole number from 1 up"))
      ->capture_default_str();
  verb.add_option("--min-zncc", a.min_zncc,
                  "leave patches out that correlate less than this with their image at a round's "
                  "start; -1: none")
      ->type_name("C")
      ->check(number_in(-1, 1, true, "a number from -1 to 1"))
      ->capture_default_str();
}

void add_anchor_options(CLI::App& verb, PhotometricArguments& a) {
  CLI::Option* anchor =
      verb.add_option("--anchor", a.anchor_px,
                      "standard deviation of the positions in measurements.txt: they become rows "
                      "beside the patches; not given: they do not count")
          ->type_name("SIGMA_PX")
          ->check(number_in(0, std::numeric_limits<double>::infinity(), false,
                            "a number of pixels above 0"));
  verb.add_option("--anchor-loss", a.anchor_loss,
                  "of measured positions: none, or as --loss with a scale in standard deviations")
      ->type_name("NAME[:SCALE]")
      ->check(parsed_by<Loss>(parse_anchor_loss))
      ->capture_default_str()
      ->needs(anchor);
  verb.add_option("--rows", a.rows,
                  "shared (the pixels of a warped patch share the derivatives of its middle) or "
                  "exact (each has its own; several times slower)")
      ->type_name("NAME")
      ->check(one_of({"shared", "exact"}))
      ->capture_default_str();
}

}  // namespace

void add_photometric_options(CLI::App& verb, PhotometricArguments& a) {
  const double inf = std::numeric_limits<double>::infinity();
  const double most = std::numeric_limits<double>::max();
  add_photometric_input_options(verb, a.input);
  add_model_options(verb, a);
  add_patch_options(verb, a);
  add_anchor_options(verb, a);
  verb.add_option("--max-iterations", a.max_iterations, "steps to try, rejected ones included")
      ->type_name("N")
      ->check(whole_number_from(0, "a whole number from 0 up"))
      ->capture_default_str();
  verb.add_option("--tolerance", a.tolerance,
                  "stop when the relative decrease of the cost stays below this twice")
      ->type_name("T")
      ->check(number_in(0, most, true, "a number from 0 up"))
      ->capture_default_str();
  verb.add_option("--motion", a.motion_px, "and the median patch moves by less than this, pixels")
      ->type_name("PX")
      ->check(number_in(0, inf, true, "a number of pixels from 0 up"))
      ->capture_default_str();
  verb.add_option("--time-limit", a.time_limit_s,
                  "stop after this many seconds of set-up and solving, write the best state and "
                  "exit with 130")
      ->type_name("SECONDS")
      ->check(number_in(0, inf, false, "a number of seconds above 0"));
  verb.add_option("--memory-limit", a.memory_limit_bytes,
                  "refuse (exit 5) rather than exceed this many bytes; units K, M, G are powers of "
                  "1024")
      ->type_name("BYTES")
      ->transform(CLI::AsSizeValue(false));
  verb.add_option("--initial-damping", a.initial_damping, "0: chosen by rule")
      ->type_name("LAMBDA")
      ->check(number_in(0, most, true, "a number from 0 up"))
      ->capture_default_str();
}

PhotometricOptions photometric_options(const PhotometricArguments& a) {
  PhotometricOptions options;
  options.max_iterations = a.max_iterations;
  options.tolerance = a.tolerance;
  options.motion_px = a.motion_px;
  if (a.time_limit_s > 0) options.time_limit_s = a.time_limit_s;
  options.memory_limit_bytes = a.memory_limit_bytes;
  options.interpolation = kInterpolations.at(a.interpolation);
  options.affine_brightness = a.brightness == "affine";
  parse_loss(a.loss, options.loss);
  options.loss_per_patch = a.loss_on == "patch";
  options.leaving = a.leaving == "free" ? Leaving::free : Leaving::truncated;
  options.warp = kWarps.at(a.warp);
  options.parametrisation = kParametrisations.at(a.points);
  options.pattern = a.pattern;
  options.min_zncc = a.min_zncc;
  options.levels = a.levels;
  options.rounds = a.rounds;
  options.fix_poses = a.fix == "poses";
  options.fix_points = a.fix == "points";
  options.rows = a.rows == "exact" ? PatchRows::exact : PatchRows::shared;
  if (a.anchor_px > 0) options.anchor_px = a.anchor_px;
  parse_anchor_loss(a.anchor_loss, options.anchor_loss);
  options.initial_damping = a.initial_damping;
  return options;
}

}  // namespace sheaf
