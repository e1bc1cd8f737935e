// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "options/photometric_options.h"

#include <limits>
#include <string>
#include <utility>

#include "options/loss_option.h"
#include "options/shared_options.h"

namespace sheaf {
namespace {

using F = FieldsOf<PhotometricOptions>;
using Shared = SharedFields<PhotometricOptions>;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
using Table = OptionTable<PhotometricOptions>;

/// Two flags, of which the command sets one at most.
OptionField<PhotometricOptions> fixed_field() {
  OptionSpec spec{
      .name = "fix", .placeholder = "NAME", .nothing = true, .help = "what does not move"};
  spec.choices = {{"poses"}, {"points"}, {"poses,points"}};
  return F::made(
      OptionKind::choice, spec,
      [](const PhotometricOptions& o) -> OptionValue {
        if (!o.fix_poses && !o.fix_points) return {};
        return std::string(!o.fix_points ? "poses" : !o.fix_poses ? "points" : "poses,points");
      },
      [](PhotometricOptions& o, const OptionValue& value) {
        const std::string* name = std::get_if<std::string>(&value);
        o.fix_poses = name != nullptr && name->starts_with("poses");
        o.fix_points = name != nullptr && name->ends_with("points");
      });
}

/// What pixels are compared with, and how a difference counts.
Table model_fields() {
  return {
      F::choice(&PhotometricOptions::interpolation,
                {{Interpolation::bicubic, "bicubic", "Catmull-Rom, exact slopes"},
                 {Interpolation::bilinear, "bilinear", "slopes are central differences"},
                 {Interpolation::bilinear_exact, "bilinear-exact", "its own slopes"}},
                {.name = "interpolation",
                 .placeholder = "NAME",
                 .help = "how an image is read between its pixels"}),
      F::choice(
          &PhotometricOptions::affine_brightness,
          {{true, "affine", "every image shows a L + b of the grey level L"}, {false, "none"}},
          {.name = "brightness",
           .placeholder = "NAME",
           .help = "what an image may make of the common grey levels"}),
      loss_field<PhotometricOptions>(
          &PhotometricOptions::loss, {.unit = "grey levels"},
          {.name = "loss", .help = "what large residuals count less by"}),
      F::choice(&PhotometricOptions::loss_per_patch,
                {{false, "pixel", "each residual by itself"},
                 {true, "patch", "a patch's residuals as one vector"}},
                {.name = "loss-on", .placeholder = "NAME", .help = "what the loss is of"}),
      F::choice(&PhotometricOptions::leaving,
                {{Leaving::truncated, "truncated", "as much as before"},
                 {Leaving::free, "free",
                  "nothing, and any patch may come in: what many implementations do"}},
                {.name = "leaving",
                 .placeholder = "RULE",
                 .help = "what a patch costs that leaves its image"}),
  };
}

/// How points stand for patches, and which of these count.
Table patch_fields() {
  std::vector<OptionChoice> patterns;
  for (const std::string& name : pattern_names()) patterns.push_back({name});
  return {
      F::choice(&PhotometricOptions::parametrisation,
                {{Parametrisation::automatic, "auto", "inverse-depth where hosts.txt names hosts"},
                 {Parametrisation::xyz, "xyz", "three numbers"},
                 {Parametrisation::inverse_depth, "inverse-depth",
                  "one, along the ray of its host image"}},
                {.name = "points", .placeholder = "NAME", .help = "what a point is"}),
      F::choice(
          &PhotometricOptions::warp,
          {{Warp::automatic, "auto", "as --points"},
           {Warp::translation, "translation", "it moves as a whole"},
           {Warp::inverse_depth, "inverse-depth", "each of its pixels is projected by itself"}},
          {.name = "warp", .placeholder = "NAME", .help = "how a patch is seen elsewhere"}),
      F::name(&PhotometricOptions::pattern, patterns,
              {.name = "pattern",
               .placeholder = "NAME",
               .help = "pixels of a patch that is taken from a host image"}),
      F::whole(&PhotometricOptions::levels,
               {.name = "levels",
                .placeholder = "N",
                .range = between(1, 6),
                .help = "of the pyramid, from coarse to fine; more than 1 need hosts.txt"}),
      F::whole(&PhotometricOptions::rounds,
               {.name = "rounds",
                .placeholder = "N",
                .range = from(1),
                .help = "at most, on each level: which patches are seen is decided again at each "
                        "start"}),
      F::real(&PhotometricOptions::min_zncc,
              {.name = "min-zncc",
               .placeholder = "C",
               .range = between(-1, 1),
               .help = "leave patches out that correlate less than this with their image at a "
                       "round's start; -1: none"}),
      F::choice(&PhotometricOptions::rows,
                {{PatchRows::shared, "shared", "the derivatives of its middle serve all"},
                 {PatchRows::exact, "exact", "each has its own; several times slower"}},
                {.name = "rows",
                 .placeholder = "NAME",
                 .help = "how the pixels of a warped patch enter a step"}),
  };
}

Table anchor_fields() {
  return {
      F::limit(&PhotometricOptions::anchor_px,
               {.name = "anchor",
                .placeholder = "SIGMA_PX",
                .unit = "px",
                .range = above(0),
                .help = "standard deviation of the positions in measurements.txt: they become "
                        "rows beside the patches; not given: they do not count"}),
      loss_field<PhotometricOptions>(
          &PhotometricOptions::anchor_loss, {.unit = "standard deviations", .automatic = false},
          {.name = "anchor-loss", .help = "of measured positions", .needs = {"anchor"}}),
      fixed_field(),
  };
}

/// When it ends, and within what.
Table limit_fields() {
  OptionField<PhotometricOptions> motion = F::real(
      &PhotometricOptions::motion_px, {.name = "motion",
                                       .placeholder = "PX",
                                       .unit = "px",
                                       .range = between(0, kInfinity),
                                       .help = "and the median patch moves by less than this"});
  return {Shared::max_iterations(),
          Shared::tolerance(),
          motion,
          Shared::time_limit(),
          Shared::solver("dense or sparse, by size", "conjugate gradients, as iterative-explicit"),
          Shared::memory_limit("refuse (exit 5)"),
          Shared::initial_damping(),
          Shared::threads()};
}

Table library_fields() {
  const auto prior = [](auto at, const char* name, const char* help) {
    return F::real(at, {.name = name,
                        .range = {.lowest = 0, .highest = kInfinity, .above = true},
                        .help = help,
                        .reach = OptionReach::library});
  };
  return {
      prior(&PhotometricOptions::prior_a, "prior-a", "standard deviation of an image's a about 1"),
      prior(&PhotometricOptions::prior_b, "prior-b",
            "standard deviation of an image's b about 0, grey levels")};
}

Table make_table() {
  Table table;
  for (const Table& part : {model_fields(), patch_fields(), anchor_fields(), limit_fields(),
                            Shared::checkpoints(), library_fields()})
    table.insert(table.end(), part.begin(), part.end());
  return table;
}

}  // namespace

const OptionTable<PhotometricOptions>& photometric_fields() {
  static const Table kTable = make_table();
  return kTable;
}

std::vector<BoundOption> options_of(PhotometricArguments& arguments) {
  std::vector<BoundOption> out = bound(photometric_read_fields(), arguments.read);
  for (BoundOption& option : bound(photometric_fields(), arguments.options))
    out.push_back(std::move(option));
  return out;
}

Result<void> check_fields(const PhotometricOptions& options) {
  return check_fields(photometric_fields(), options);
}

}  // namespace sheaf
