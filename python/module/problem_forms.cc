// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>
#include <string>
#include <vector>

#include "arrays.h"
#include "bindings.h"
#include "geometry/rotation.h"
#include "scene/camera_frame.h"
#include "scene/stated_rotation.h"

namespace sheaf {
namespace {

ProblemHandle problem_from_bal(nb::handle camera_params, nb::handle points_3d,
                               nb::handle camera_indices, nb::handle point_indices,
                               nb::handle points_2d) {
  const std::vector<double> numbers = reals_from(camera_params, "camera_params", 9);
  Problem p;
  p.points = reals_from(points_3d, "points_3d", 3);
  p.observation_image = indices_from(camera_indices, "camera_indices");
  p.observation_point = indices_from(point_indices, "point_indices");
  p.observation_xy = reals_from(points_2d, "points_2d", 2);
  for (std::size_t i = 0; i < numbers.size(); i += 9) {
    const double* v = &numbers[i];
    Pose pose;
    pose.rotation = quaternion_from_angle_axis<double>({v[0], v[1], v[2]});
    pose.translation = {v[3], v[4], v[5]};
    p.add_image(pose, Camera{CameraModel::bal, {v[6], v[7], v[8]}});
    p.bal_angle_axis.insert(p.bal_angle_axis.end(), v, v + 3);
  }
  validate(p).value();
  return handle_of(std::move(p));
}

/// Angle-axis, translation, f, k1, k2 of each image, as a BAL file has them.
std::vector<double> bal_rows(const Problem& p) {
  std::vector<double> out;
  for (std::size_t i = 0; i < p.num_images(); ++i) {
    const auto stated = stated_rotation(p, i);
    const Vector3<double> phi = stated ? *stated : angle_axis_from_quaternion(p.poses[i].rotation);
    const auto& lens = p.cameras[p.image_camera[i]].parameters;
    out.insert(out.end(), phi.begin(), phi.end());
    out.insert(out.end(), p.poses[i].translation.begin(), p.poses[i].translation.end());
    out.insert(out.end(), lens.begin(), lens.begin() + 3);
  }
  return out;
}

nb::object bal_arrays(const ProblemHandle& held) {
  const ReadUse use(held);
  Problem turned;
  const Problem& p = *with_bal_cameras(use.problem(), turned).value();
  return nb::make_tuple(array_of(bal_rows(p), {p.num_images(), 9}),
                        array_of(p.points, {p.num_points(), 3}), array_of(p.observation_image),
                        array_of(p.observation_point),
                        array_of(p.observation_xy, {p.num_observations(), 2}));
}

/// What reads or writes other libraries' objects is Python.
template <class... Arguments>
nb::object in_python(const char* module, const char* function, Arguments&&... arguments) {
  return nb::module_::import_(module).attr(function)(std::forward<Arguments>(arguments)...);
}

}  // namespace

void bind_forms(ProblemClass& problem) {
  problem
      .def_static("from_bal", &problem_from_bal, nb::arg("camera_params"), nb::arg("points_3d"),
                  nb::arg("camera_indices"), nb::arg("point_indices"), nb::arg("points_2d"),
                  nb::sig("def from_bal(camera_params: numpy.typing.ArrayLike, points_3d: "
                          "numpy.typing.ArrayLike, camera_indices: numpy.typing.ArrayLike, "
                          "point_indices: numpy.typing.ArrayLike, points_2d: "
                          "numpy.typing.ArrayLike) -> Problem"),
                  "From the arrays of SciPy's cookbook of bundle adjustment: (n, 9) angle-axis "
                  "(radians), translation, f, k1, k2; (m, 3); (k,); (k,); (k, 2).")
      .def("to_bal", &bal_arrays,
           nb::sig("def to_bal(self) -> tuple[numpy.typing.NDArray[numpy.float64], "
                   "numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.uint32], "
                   "numpy.typing.NDArray[numpy.uint32], numpy.typing.NDArray[numpy.float64]]"),
           "camera_params, points_3d, camera_indices, point_indices, points_2d: copies, as "
           "from_bal takes them. Raises sheaf.Error for lenses that BAL's formula is not.")
      .def(
          "without_bal_cameras",
          [](const ProblemHandle& held) {
            const ReadUse use(held);
            Problem turned;
            return handle_of(*without_bal_cameras(use.problem(), turned));
          },
          "A copy whose BAL cameras are RADIAL ones that look along +z with y down: exact.")
      .def_static(
          "from_pycolmap",
          [](nb::handle rec) { return in_python("sheaf._pycolmap", "problem_from", rec); },
          nb::arg("rec"), nb::sig("def from_pycolmap(rec: typing.Any) -> Problem"),
          "From a pycolmap.Reconstruction, with its ids, names, colours and features.")
      .def(
          "to_pycolmap",
          [](nb::handle self, nb::handle rec) {
            return in_python("sheaf._pycolmap", "reconstruction_of", self, rec);
          },
          nb::arg("rec") = nb::none(),
          nb::sig("def to_pycolmap(self, rec: typing.Any = None) -> typing.Any"),
          "As a pycolmap.Reconstruction: a new one, or rec with all in it replaced.")
      .def_static(
          "from_gtsam",
          [](nb::handle data) { return in_python("sheaf._gtsam", "problem_from", data); },
          nb::arg("data"), nb::sig("def from_gtsam(data: typing.Any) -> Problem"),
          "From a gtsam.SfmData of Bundler cameras.")
      .def(
          "to_gtsam",
          [](nb::handle self, nb::handle gtsam) {
            return in_python("sheaf._gtsam", "sfm_data_of", self, gtsam);
          },
          nb::arg("gtsam") = nb::none(),
          nb::sig("def to_gtsam(self, gtsam: typing.Any = None) -> typing.Any"),
          "As a gtsam.SfmData; gtsam: the module, where it goes by another name.");
}

}  // namespace sheaf
