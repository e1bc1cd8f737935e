// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <nanobind/stl/string.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "arrays.h"
#include "bindings.h"
#include "camera_records.h"

namespace sheaf {
namespace {

nb::object poses_view(const ProblemHandle& held, std::vector<Pose>& poses) {
  double* numbers = poses.empty() ? nullptr : poses.front().rotation.data();
  return view_of(held, numbers, {poses.size(), 7});
}

nb::object reals_view(const ProblemHandle& held, std::vector<double>& numbers,
                      std::size_t columns) {
  if (columns == 1) return view_of(held, numbers.data(), {numbers.size()});
  return view_of(held, numbers.data(), {numbers.size() / columns, columns});
}

template <class Word>
nb::object words_view(const ProblemHandle& held, std::vector<Word>& words) {
  return view_of(held, words.data(), {words.size()});
}

nb::object cameras_view(const ProblemHandle& held) {
  held->check_at_hand();
  std::vector<Camera>& cameras = held->problem.cameras;
  if (cameras.empty()) return nb::module_::import_("numpy").attr("empty")(0, camera_dtype());
  auto* bytes = reinterpret_cast<std::uint8_t*>(cameras.data());
  return view_of(held, bytes, {sizeof(Camera) * cameras.size()}).attr("view")(camera_dtype());
}

nb::object rigs_view(const ProblemHandle& held) {
  held->check_at_hand();
  Rigs& rigs = held->problem.rigs;
  if (rigs.empty()) return nb::none();
  return nb::module_::import_("sheaf._records")
      .attr("Rigs")(poses_view(held, rigs.sensor_from_rig), words_view(held, rigs.sensor_rig),
                    words_view(held, rigs.is_reference), poses_view(held, rigs.rig_from_world),
                    words_view(held, rigs.frame_rig), words_view(held, rigs.image_frame),
                    words_view(held, rigs.image_sensor));
}

/// In place where the size stays; else a resize, which no view may live through.
template <class Element>
void assign(const ProblemHandle& held, std::vector<Element>& to, std::vector<Element> from,
            const char* name) {
  held->check_idle();
  if (from.size() == to.size()) {
    std::copy(from.begin(), from.end(), to.begin());
    return;
  }
  held->check_resizable(std::string("setting ") + name);
  to = std::move(from);
}

template <std::vector<double> Problem::*kMember, std::size_t kColumns>
void def_reals(ProblemClass& problem, const char* name, const char* what) {
  problem.def_prop_rw(
      name,
      [](const ProblemHandle& held) { return reals_view(held, held->problem.*kMember, kColumns); },
      [name](const ProblemHandle& held, nb::handle given) {
        assign(held, held->problem.*kMember, reals_from(given, name, kColumns), name);
      },
      nb::for_getter(nb::sig(
          ("def " + std::string(name) + "(self) -> numpy.typing.NDArray[numpy.float64]").c_str())),
      nb::for_setter(
          nb::sig(("def " + std::string(name) + "(self, value: numpy.typing.ArrayLike, /) -> None")
                      .c_str())),
      what);
}

template <std::vector<std::uint32_t> Problem::*kMember>
void def_indices(ProblemClass& problem, const char* name, const char* what) {
  problem.def_prop_rw(
      name, [](const ProblemHandle& held) { return words_view(held, held->problem.*kMember); },
      [name](const ProblemHandle& held, nb::handle given) {
        assign(held, held->problem.*kMember, indices_from(given, name), name);
      },
      nb::for_getter(nb::sig(
          ("def " + std::string(name) + "(self) -> numpy.typing.NDArray[numpy.uint32]").c_str())),
      nb::for_setter(
          nb::sig(("def " + std::string(name) + "(self, value: numpy.typing.ArrayLike, /) -> None")
                      .c_str())),
      what);
}

}  // namespace

void bind_views(ProblemClass& problem) {
  problem.def_prop_rw(
      "poses", [](const ProblemHandle& held) { return poses_view(held, held->problem.poses); },
      [](const ProblemHandle& held, nb::handle given) {
        assign(held, held->problem.poses, poses_from(given, "poses"), "poses");
      },
      nb::for_getter(nb::sig("def poses(self) -> numpy.typing.NDArray[numpy.float64]")),
      nb::for_setter(nb::sig("def poses(self, value: numpy.typing.ArrayLike, /) -> None")),
      "(n, 7): qw qx qy qz tx ty tz of each image, cam_from_world. Of an image of a rig what its "
      "frame and sensor made of it when they were last placed.");
  def_reals<&Problem::points, 3>(problem, "points", "(m, 3): X, Y, Z, scene units.");
  def_indices<&Problem::image_camera>(problem, "image_camera", "(n,): the lens of each image.");
  def_indices<&Problem::observation_image>(problem, "observation_image", "(k,).");
  def_indices<&Problem::observation_point>(problem, "observation_point", "(k,).");
  def_reals<&Problem::observation_xy, 2>(problem, "observation_xy", "(k, 2), pixels.");
  def_reals<&Problem::observation_sigma, 1>(problem, "observation_sigma",
                                            "(k,), pixels; empty: 1 each.");
  problem.def_prop_rw(
      "cameras", &cameras_view,
      [](const ProblemHandle& held, nb::handle given) {
        assign(held, held->problem.cameras, cameras_from(given), "cameras");
      },
      nb::for_getter(nb::sig("def cameras(self) -> numpy.typing.NDArray[numpy.void]")),
      nb::for_setter(nb::sig("def cameras(self, value: numpy.typing.NDArray[numpy.void] | "
                             "collections.abc.Sequence[sheaf._records.CameraLike], /) -> None")),
      "Lenses, as records of sheaf.camera_dtype(): model (number), parameters (16, those that the "
      "model does not have are 0), width_px, height_px.");
  problem.def(
      "camera",
      [](const HeldProblem& held, std::size_t index) {
        held.check_at_hand();
        if (index >= held.problem.cameras.size())
          throw nb::index_error("the problem has no such camera");
        return camera_object(held.problem.cameras[index]);
      },
      nb::arg("index"), nb::sig("def camera(self, index: int) -> sheaf._records.Camera"),
      "A copy of one lens, its model by name.");
  problem.def_prop_ro("rigs", &rigs_view, nb::sig("def rigs(self) -> sheaf._records.Rigs | None"),
                      "Views of which images move as one, or None.");
}

}  // namespace sheaf
