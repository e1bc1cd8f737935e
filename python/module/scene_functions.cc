// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <nanobind/stl/string.h>

#include <string>
#include <utility>
#include <vector>

#include "arrays.h"
#include "bindings.h"
#include "keyword_options.h"
#include "options/noise_options.h"
#include "options/scene_options.h"
#include "scene_arguments.h"
#include "sheaf/scene.h"
#include "verb.h"

namespace sheaf {
namespace {

/// What a scene is made of, as the command states it.
struct GenerateArguments {
  SceneOptions scene;
  FamilyArguments family;
  LensArguments lens;
  RigArguments rigs;
};

std::vector<BoundOption> options_of(GenerateArguments& a) {
  return joined({bound(scene_fields(), a.scene), options_of(a.family), options_of(a.lens),
                 options_of(a.rigs)});
}

Scene make_scene(const GenerateArguments& a) {
  if (a.rigs.chosen()) return generate(rig_options(a.rigs, a.lens, a.scene)).value();
  if (a.lens.chosen()) return generate(lens_options(a.lens, a.scene)).value();
  if (a.family.chosen()) return generate(family_options(a.family, a.scene)).value();
  return generate(a.scene).value();
}

nb::tuple generate_scene(const nb::kwargs& keywords) {
  nb::dict left = nb::cast<nb::dict>(keywords.attr("copy")());
  GenerateArguments arguments;
  take_options(left, options_of(arguments));
  check_all_taken(left, "generate");
  Scene scene;
  {
    const nb::gil_scoped_release released;
    scene = make_scene(arguments);
  }
  return nb::make_tuple(handle_of(std::move(scene.start)), handle_of(std::move(scene.truth)));
}

nb::object perturb_problem(const ProblemHandle& held, const nb::kwargs& keywords) {
  nb::dict left = nb::cast<nb::dict>(keywords.attr("copy")());
  NoiseOptions options;
  take_options(left, bound(noise_fields(), options));
  check_all_taken(left, "perturb");
  WriteUse use(held);
  if (options.least_depth > 0) use.resize("perturb with min_depth");
  NoiseRecord record;
  {
    const nb::gil_scoped_release released;
    record = perturb(use.problem(), options).value();
  }
  const Normalization& n = record.normalization;
  return nb::module_::import_("sheaf._records")
      .attr("NoiseRecord")(array_of(n.center.data(), {3}), n.scale, array_of(record.outliers),
                           record.dropped_observations, record.dropped_points);
}

}  // namespace

void bind_scenes(nb::module_& module) {
  GenerateArguments scene;
  const std::vector<BoundOption> of_scene = options_of(scene);
  module.def("generate", &generate_scene, nb::arg("options"),
             nb::sig(signature_of("generate", "", {}, of_scene, "tuple[Problem, Problem]").c_str()),
             ("Makes a synthetic scene: (start, truth), disturbed and as it was, the latter with "
              "its exact "
              "pixels (docs/scenes.md). The same options give the same bytes on every machine.\n" +
              help_of(of_scene))
                 .c_str());
  NoiseOptions noise;
  const std::vector<BoundOption> of_noise = bound(noise_fields(), noise);
  module.def("perturb", &perturb_problem, nb::arg("problem"), nb::arg("options"),
             nb::sig(signature_of("perturb", "problem: Problem", {}, of_noise,
                                  "sheaf._records.NoiseRecord")
                         .c_str()),
             ("Adds noise and outliers to a problem, in place.\n" + help_of(of_noise)).c_str());
}

}  // namespace sheaf
