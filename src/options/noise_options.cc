// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "options/noise_options.h"

#include <limits>
#include <string>
#include <string_view>

#include "platform/real_text.h"

namespace sheaf {
namespace {

using F = FieldsOf<NoiseOptions>;
using Table = OptionTable<NoiseOptions>;

constexpr NoiseProtocol kProtocols[] = {NoiseProtocol::sheaf, NoiseProtocol::ceres,
                                        NoiseProtocol::rootba};

OptionField<NoiseOptions> protocol_field() {
  OptionSpec spec{.name = "protocol",
                  .placeholder = "NAME",
                  .help = "what the sigmas move, and what is not stated"};
  spec.choices = {{"sheaf", "a turn leaves the centre in place"},
                  {"ceres",
                   "the BAL example of Ceres Solver: angle-axis plus noise, --translation; "
                   "normalised, seed 38401"},
                  {"rootba",
                   "--center, then a turn with t held; normalised, centres and points "
                   "0.01, --min-depth 0.1, seed 38401"}};
  return F::made(
      OptionKind::choice, spec,
      [](const NoiseOptions& o) -> OptionValue { return std::string(name_of(o.protocol)); },
      [](NoiseOptions& o, const OptionValue& value) {
        for (const NoiseProtocol protocol : kProtocols)
          if (std::get<std::string>(value) == name_of(protocol)) o = published_noise(protocol);
      });
}

/// "F[,K1[,K2]]", each a number from 0 up or one with % after it. False when it is not that.
bool read_intrinsics(std::string_view text, NoiseOptions& out) {
  out.intrinsics = out.intrinsics_relative = {};
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

std::string intrinsics_text(const NoiseOptions& o) {
  std::string out;
  for (std::size_t k = 0; k < 3; ++k) {
    const double relative = o.intrinsics_relative[k];
    out += (k == 0 ? "" : ",") +
           (relative > 0 ? text_of(100 * relative) + "%" : text_of(o.intrinsics[k]));
  }
  return out;
}

OptionField<NoiseOptions> intrinsics_field() {
  return F::made(
      OptionKind::text,
      {.name = "intrinsics",
       .placeholder = "SIGMAS",
       .help = "of f in pixels, and of k1 and k2: F[,K1[,K2]]; what is not stated is 0. With % "
               "after it, of the parameter's size: 1%",
       .wrong =
           [](const std::string& text) {
             NoiseOptions ignored;
             return read_intrinsics(text, ignored)
                        ? std::string()
                        : "expected F[,K1[,K2]], numbers from 0 up, absolute or with %, not '" +
                              text + "'";
           }},
      [](const NoiseOptions& o) -> OptionValue { return intrinsics_text(o); },
      [](NoiseOptions& o, const OptionValue& value) {
        read_intrinsics(std::get<std::string>(value), o);
      });
}

OptionField<NoiseOptions> sigma(double NoiseOptions::*at, const char* name, const char* unit,
                                const char* help) {
  return F::real(
      at, {.name = name, .placeholder = "SIGMA", .unit = unit, .range = from(0), .help = help});
}

Table outlier_fields() {
  return {F::real(&NoiseOptions::outliers,
                  {.name = "outliers",
                   .placeholder = "FRACTION",
                   .range = between(0, 1),
                   .help = "fraction of the measurements to move far; those of a smaller fraction "
                           "are among those of a larger one"}),
          F::real(&NoiseOptions::outlier_px, {.name = "outlier-size",
                                              .placeholder = "PX",
                                              .unit = "px",
                                              .range = from(0),
                                              .help = "how far, in a random direction",
                                              .key = "outlier_px"}),
          F::whole(&NoiseOptions::seed,
                   {.name = "seed",
                    .placeholder = "S",
                    .range = from(0),
                    .help = "the same seed gives the same bytes on every machine; each kind of "
                            "noise has numbers of its own"})};
}

Table filter_fields() {
  return {
      F::real(&NoiseOptions::normalize_to,
              {.name = "normalize",
               .placeholder = "SIZE",
               .range = from(0),
               .help = "first move and scale the scene: median of the points at 0, median of "
                       "|X|+|Y|+|Z| at this size; sigmas are then in those units. 0: not",
               .key = "normalize_to"}),
      F::real(&NoiseOptions::least_depth,
              {.name = "min-depth",
               .placeholder = "DEPTH",
               .range = from(0),
               .help = "at last leave out observations nearer to their camera than this or "
                       "behind it, and points that are left with fewer than two. 0: keep all"})};
}

Table make_table() {
  using O = NoiseOptions;
  Table table = {
      protocol_field(),
      sigma(&O::rotation_rad, "rotation", "rad", "of each component of a rotation vector"),
      sigma(&O::translation, "translation", "", "of each component of t, scene units"),
      sigma(&O::center, "center", "", "of each component of a camera centre, scene units"),
      sigma(&O::point, "point", "", "of each coordinate of a point, scene units"),
      sigma(&O::sensor_rotation_rad, "sensor-rotation", "rad",
            "of each component of a rotation vector of sensor_from_rig; images of rigs move with "
            "their frames"),
      sigma(&O::sensor_translation, "sensor-translation", "",
            "of each component of sensor_from_rig's translation, scene units"),
      intrinsics_field(),
      sigma(&O::pixel_px, "pixel", "px", "of each component of a measurement")};
  for (const Table& part : {outlier_fields(), filter_fields()})
    table.insert(table.end(), part.begin(), part.end());
  return table;
}

}  // namespace

const char* name_of(NoiseProtocol protocol) {
  switch (protocol) {
    case NoiseProtocol::sheaf:
      break;
    case NoiseProtocol::ceres:
      return "ceres";
    case NoiseProtocol::rootba:
      return "rootba";
  }
  return "sheaf";
}

const OptionTable<NoiseOptions>& noise_fields() {
  static const Table kTable = make_table();
  return kTable;
}

}  // namespace sheaf
