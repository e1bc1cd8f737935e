// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "arrays.h"
#include "bindings.h"
#include "camera_records.h"
#include "summary_text.h"

namespace sheaf {
namespace {

/// What the keys of `rigs` are.
constexpr const char* kRigKeys[] = {"sensor_from_rig", "sensor_rig", "is_reference",
                                    "rig_from_world",  "frame_rig",  "image_frame",
                                    "image_sensor"};

/// From a mapping, or an object with these attributes.
Rigs rigs_from(nb::handle given) {
  const bool mapping = nb::isinstance<nb::dict>(given);
  const auto part = [&](const char* key) -> nb::object {
    if (mapping) {
      const auto dict = nb::borrow<nb::dict>(given);
      if (dict.contains(key)) return dict[key];
    } else if (nb::hasattr(given, key)) {
      return given.attr(key);
    }
    throw Error(ErrorCode::usage, std::string("rigs: ") + key + " is missing");
  };
  Rigs out;
  out.sensor_from_rig = poses_from(part(kRigKeys[0]), "rigs.sensor_from_rig");
  out.sensor_rig = indices_from(part(kRigKeys[1]), "rigs.sensor_rig");
  out.is_reference = flags_from(part(kRigKeys[2]), "rigs.is_reference");
  out.rig_from_world = poses_from(part(kRigKeys[3]), "rigs.rig_from_world");
  out.frame_rig = indices_from(part(kRigKeys[4]), "rigs.frame_rig");
  out.image_frame = indices_from(part(kRigKeys[5]), "rigs.image_frame", -1);
  out.image_sensor = indices_from(part(kRigKeys[6]), "rigs.image_sensor", -1);
  for (const std::uint32_t rig : out.sensor_rig) out.count = std::max(out.count, rig + 1);
  return out;
}

void set_names(Problem& problem, const std::vector<std::string>& names) {
  if (names.size() != problem.num_images())
    throw Error(ErrorCode::usage, "names: found " + std::to_string(names.size()) + " for " +
                                      std::to_string(problem.num_images()) + " images");
  auto metadata = problem.metadata ? std::make_shared<SceneMetadata>(*problem.metadata)
                                   : std::make_shared<SceneMetadata>();
  metadata->image_names = names;
  problem.metadata = std::move(metadata);
}

void construct(HeldProblem* self, nb::handle poses, nb::handle points, nb::handle cameras,
               nb::handle image_camera, nb::handle observation_image, nb::handle observation_point,
               nb::handle observation_xy, nb::handle observation_sigma, nb::handle rigs,
               const std::optional<std::vector<std::string>>& names) {
  auto held = std::make_unique<HeldProblem>();
  Problem& p = held->problem;
  p.poses = poses_from(poses, "poses");
  p.points = reals_from(points, "points", 3);
  p.cameras = cameras_from(cameras);
  p.image_camera = indices_from(image_camera, "image_camera");
  p.observation_image = indices_from(observation_image, "observation_image");
  p.observation_point = indices_from(observation_point, "observation_point");
  p.observation_xy = reals_from(observation_xy, "observation_xy", 2);
  if (!observation_sigma.is_none())
    p.observation_sigma = reals_from(observation_sigma, "observation_sigma", 1);
  if (!rigs.is_none()) p.rigs = rigs_from(rigs);
  if (names) set_names(p, *names);
  validate(p).value();
  place_images(p);
  new (self) HeldProblem();
  self->problem = std::move(p);
}

template <std::size_t (Problem::*kCount)() const>
std::size_t count_of(const HeldProblem& held) {
  held.check_at_hand();
  return (held.problem.*kCount)();
}

nb::object names_of(const HeldProblem& held) {
  held.check_at_hand();
  const SceneMetadata* m = held.problem.metadata.get();
  if (m == nullptr || m->image_names.empty()) return nb::none();
  return nb::cast(m->image_names);
}

ProblemHandle copy_of(const ProblemHandle& held) {
  const ReadUse use(held, Validity::any);
  auto out = std::make_shared<HeldProblem>();
  out->problem = use.problem();
  out->format = held->format;
  out->notes = held->notes;
  return out;
}

nb::object evaluate_problem(const ProblemHandle& held) {
  const ReadUse use(held);
  Evaluation found;
  TermCosts terms;
  {
    const nb::gil_scoped_release released;
    found = evaluate(use.problem());
    terms = evaluate_terms(use.problem());
  }
  return nb::module_::import_("sheaf._records")
      .attr("Evaluation")(found.cost + terms.total(), found.rms_px, array_of(found.behind),
                          array_of(found.not_finite));
}

constexpr const char* kProblemText =
    R"(A bundle adjustment problem as flat arrays.

  poses: (n, 7), float64: qw qx qy qz tx ty tz of each image; X_cam = R X_world + t
  points: (m, 3), float64: X, Y, Z, scene units
  cameras: lenses: a sequence of sheaf.Camera or (model, parameters[, width_px, height_px]), or an
    array of sheaf.camera_dtype(); docs/cameras.md states the models
  image_camera: (n,), integers: the lens of each image
  observation_image, observation_point: (k,), integers
  observation_xy: (k, 2), float64, pixels
  observation_sigma: (k,), float64, pixels; None: 1 each
  rigs: a sheaf.Rigs or a dict with its fields; None: no image is of a rig
  names: of the images

Arrays are copied once, whatever their strides and types of integers; float32 is refused. The
attributes are views of the problem's own memory: what is written into them is in the problem. While
a view lives the problem cannot be resized. Errors: sheaf.Error (usage) for what is out of range or
does not fit together, TypeError for arrays of another type.)";

}  // namespace

ProblemHandle handle_of(Problem problem) {
  auto out = std::make_shared<HeldProblem>();
  out->problem = std::move(problem);
  return out;
}

ProblemClass bind_problem(nb::module_& module) {
  ProblemClass problem(module, "Problem", kProblemText, nb::is_weak_referenceable());
  problem.def(
      "__init__", &construct, nb::arg("poses"), nb::arg("points"), nb::arg("cameras"),
      nb::arg("image_camera"), nb::arg("observation_image"), nb::arg("observation_point"),
      nb::arg("observation_xy"), nb::arg("observation_sigma") = nb::none(),
      nb::arg("rigs") = nb::none(), nb::arg("names") = nb::none(),
      nb::sig("def __init__(self, poses: numpy.typing.ArrayLike, points: numpy.typing.ArrayLike, "
              "cameras: numpy.typing.NDArray[numpy.void] | "
              "collections.abc.Sequence[sheaf._records.CameraLike], image_camera: "
              "numpy.typing.ArrayLike, observation_image: numpy.typing.ArrayLike, "
              "observation_point: numpy.typing.ArrayLike, observation_xy: numpy.typing.ArrayLike, "
              "observation_sigma: numpy.typing.ArrayLike | None = None, rigs: sheaf._records.Rigs "
              "| collections.abc.Mapping[str, numpy.typing.ArrayLike] | None = None, names: "
              "collections.abc.Sequence[str] | None = None) -> None"));
  problem.def("copy", &copy_of, "A copy of its own, that no view looks at.")
      .def("__copy__", &copy_of)
      .def(
          "__deepcopy__", [](const ProblemHandle& held, nb::handle) { return copy_of(held); },
          nb::arg("memo"))
      .def("evaluate", &evaluate_problem,
           nb::sig("def evaluate(self) -> sheaf._records.Evaluation"),
           "Cost 1/2 sum |r / sigma|^2 of the plain problem, with what its priors cost, by plain "
           "scalar code, independent of the solver's. Without the interpreter's lock.")
      .def("__repr__",
           [](const HeldProblem& held) {
             return "<sheaf.Problem: " + counts_text(held.problem) + ">";
           })
      .def_prop_ro("num_images", &count_of<&Problem::num_images>)
      .def_prop_ro("num_points", &count_of<&Problem::num_points>)
      .def_prop_ro("num_observations", &count_of<&Problem::num_observations>)
      .def_prop_rw(
          "names", &names_of,
          [](HeldProblem& held, const std::vector<std::string>& names) {
            held.check_idle();
            set_names(held.problem, names);
          },
          nb::for_getter(nb::sig("def names(self) -> list[str] | None")),
          nb::for_setter(
              nb::sig("def names(self, names: collections.abc.Sequence[str], /) -> None")),
          "Names of the images, or None.")
      .def_prop_ro(
          "format", [](const HeldProblem& held) { return held.format; },
          "Format of the file that it was read from, or ''.")
      .def_prop_ro(
          "notes", [](const HeldProblem& held) { return held.notes; },
          "Sentences about what of the file is not in the problem.");
  return problem;
}

}  // namespace sheaf
