// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "noise_arguments.h"

#include <fmt/format.h>

#include <limits>
#include <map>
#include <string_view>
#include <vector>

#include "platform/real_text.h"
#include "verb.h"

namespace sheaf {
namespace {

const std::map<std::string, NoiseProtocol> kProtocols = {{"sheaf", NoiseProtocol::sheaf},
                                                         {"ceres", NoiseProtocol::ceres},
                                                         {"rootba", NoiseProtocol::rootba}};

// "F[,K1[,K2]]", each a number from 0 up or one with % after it. False when it is not that.
bool parse_intrinsics(std::string_view text, NoiseOptions& out) {
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t comma = text.find(',');
    std::string_view item = text.substr(0, comma);
    const bool percent = !item.empty() && item.back() == '%';
    if (percent) item.remove_suffix(1);
    double sigma = 0;
    const auto [stop, error] = read_real(item.data(), item.data() + item.size(), sigma);
    if (error != std::errc() || stop != item.data() + item.size()) return false;
    if (!(sigma >= 0 && sigma <= std::numeric_limits<double>::max())) return false;
    (percent ? out.intrinsics_relative : out.intrinsics)[k] = percent ? sigma / 100 : sigma;
    if (comma == std::string_view::npos) return true;
    text.remove_prefix(comma + 1);
  }
  return false;
}

void add_sigma(CLI::App& verb, const char* name, std::optional<double>& value, const char* what) {
  verb.add_option(name, value, what)
      ->type_name("SIGMA")
      ->check(number_in(0, std::numeric_limits<double>::max(), true, "a number from 0 up"));
}

void add_filter_options(CLI::App& verb, NoiseArguments& a) {
  const double most = std::numeric_limits<double>::max();
  verb.add_option("--protocol", a.protocol,
                  "what the sigmas move, and what is not stated: sheaf (a turn leaves the centre "
                  "in place), ceres (the BAL example of Ceres Solver: angle-axis plus noise, "
                  "--translation; normalised, seed 38401), rootba (--center, then a turn with t "
                  "held; normalised, centres and points 0.01, --min-depth 0.1, seed 38401)")
      ->type_name("NAME")
      ->check(one_of({"sheaf", "ceres", "rootba"}))
      ->capture_default_str();
  verb.add_option("--normalize", a.normalize,
                  "first move and scale the scene: median of the points at 0, median of "
                  "|X|+|Y|+|Z| at this size; sigmas are then in those units. 0: not")
      ->type_name("SIZE")
      ->check(number_in(0, most, true, "a number from 0 up"));
  verb.add_option("--min-depth", a.least_depth,
                  "at last leave out observations nearer to their camera than this or behind it, "
                  "and points that are left with fewer than two. 0: keep all")
      ->type_name("DEPTH")
      ->check(number_in(0, most, true, "a number from 0 up"));
}

}  // namespace

void add_noise_options(CLI::App& verb, NoiseArguments& a) {
  add_sigma(verb, "--rotation", a.rotation, "of each component of a rotation vector, radians");
  add_sigma(verb, "--translation", a.translation, "of each component of t, scene units");
  add_sigma(verb, "--center", a.center, "of each component of a camera centre, scene units");
  add_sigma(verb, "--point", a.point, "of each coordinate of a point, scene units");
  verb.add_option("--intrinsics", a.intrinsics,
                  "of f in pixels, and of k1 and k2: F[,K1[,K2]]; what is not stated is 0. With % "
                  "after it, of the parameter's size: 1%")
      ->type_name("SIGMAS")
      ->check(CLI::Validator(
          [](std::string& text) {
            NoiseOptions ignored;
            return parse_intrinsics(text, ignored)
                       ? std::string()
                       : fmt::format(
                             "expected F[,K1[,K2]], numbers from 0 up, absolute or with "
                             "%, not '{}'",
                             text);
          },
          ""));
  add_sigma(verb, "--pixel", a.pixel, "of each component of a measurement, pixels");
  verb.add_option("--outliers", a.outliers,
                  "fraction of the measurements to move far; those of a smaller fraction are among "
                  "those of a larger one")
      ->type_name("FRACTION")
      ->check(number_in(0, 1, true, "a number from 0 to 1"));
  verb.add_option("--outlier-size", a.outlier_size, "how far, in a random direction, pixels [50]")
      ->type_name("PX")
      ->check(number_in(0, std::numeric_limits<double>::max(), true, "a number from 0 up"));
  verb.add_option("--seed", a.seed,
                  "the same seed gives the same bytes on every machine; each kind of noise has "
                  "numbers of its own [1]")
      ->type_name("S")
      ->check(whole_number_from(0, "a whole number from 0 up"));
  add_filter_options(verb, a);
}

NoiseOptions noise_options(const NoiseArguments& a) {
  NoiseOptions o = published_noise(kProtocols.at(a.protocol));
  o.rotation_rad = a.rotation.value_or(o.rotation_rad);
  o.translation = a.translation.value_or(o.translation);
  o.center = a.center.value_or(o.center);
  o.point = a.point.value_or(o.point);
  o.pixel_px = a.pixel.value_or(o.pixel_px);
  o.outliers = a.outliers.value_or(o.outliers);
  o.outlier_px = a.outlier_size.value_or(o.outlier_px);
  o.normalize_to = a.normalize.value_or(o.normalize_to);
  o.least_depth = a.least_depth.value_or(o.least_depth);
  o.seed = a.seed.value_or(o.seed);
  if (!a.intrinsics.empty()) parse_intrinsics(a.intrinsics, o);
  return o;
}

Json noise_json(const NoiseOptions& o) {
  std::string protocol;
  for (const auto& [name, value] : kProtocols)
    if (value == o.protocol) protocol = name;
  return {{"protocol", protocol},
          {"rotation_rad", o.rotation_rad},
          {"translation", o.translation},
          {"center", o.center},
          {"point", o.point},
          {"intrinsics", o.intrinsics},
          {"intrinsics_relative", o.intrinsics_relative},
          {"pixel_px", o.pixel_px},
          {"outliers", o.outliers},
          {"outlier_px", o.outlier_px},
          {"normalize_to", o.normalize_to},
          {"min_depth", o.least_depth},
          {"seed", o.seed}};
}

std::string noise_text(const NoiseOptions& o) {
  std::vector<std::string> kinds;
  const auto add = [&](const char* name, double sigma, const char* unit) {
    if (sigma > 0) kinds.push_back(fmt::format("{} {:.6g}{}", name, sigma, unit));
  };
  add("rotations", o.rotation_rad, " rad");
  add("translations", o.translation, "");
  add("centres", o.center, "");
  add("points", o.point, "");
  const char* const names[] = {"f", "k1", "k2"};
  for (std::size_t k = 0; k < 3; ++k) {
    add(names[k], o.intrinsics[k], k == 0 ? " px" : "");
    add(names[k], 100 * o.intrinsics_relative[k], "%");
  }
  add("pixels", o.pixel_px, " px");
  return fmt::format("{}; seed {}",
                     kinds.empty() ? "none" : fmt::format("{}", fmt::join(kinds, ", ")), o.seed);
}

}  // namespace sheaf
