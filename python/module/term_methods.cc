// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <nanobind/stl/string.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "arrays.h"
#include "bindings.h"
#include "geometry/camera_model.h"
#include "options/loss_option.h"
#include "scene/terms.h"

namespace sheaf {
namespace {

template <std::size_t kCount>
std::array<double, kCount> numbers_from(nb::handle given, const char* name) {
  const std::vector<double> numbers = reals_from(given, name, 1);
  if (numbers.size() != kCount)
    throw Error(ErrorCode::usage, std::string(name) + ": found " + std::to_string(numbers.size()) +
                                      " numbers, expected " + std::to_string(kCount));
  std::array<double, kCount> out;
  std::copy(numbers.begin(), numbers.end(), out.begin());
  return out;
}

template <std::size_t kSize>
std::array<double, kSize * kSize> matrix_from(nb::handle given, const char* name) {
  const std::vector<double> numbers = reals_from(given, name, kSize);
  if (numbers.size() != kSize * kSize)
    throw Error(ErrorCode::usage, std::string(name) + ": expected a matrix of " +
                                      std::to_string(kSize) + " x " + std::to_string(kSize));
  std::array<double, kSize * kSize> out;
  std::copy(numbers.begin(), numbers.end(), out.begin());
  return out;
}

/// Exactly one of the two: a matrix, or standard deviations of each axis or of all.
Covariance3 covariance_from(nb::handle covariance, nb::handle sigma) {
  if (covariance.is_none() == sigma.is_none())
    throw Error(ErrorCode::usage, "expected either covariance or sigma");
  if (sigma.is_none()) return matrix_from<3>(covariance, "covariance");
  std::array<double, 3> of;
  if (nb::hasattr(sigma, "__len__"))
    of = numbers_from<3>(sigma, "sigma");
  else
    of.fill(nb::cast<double>(nb::float_(nb::borrow(sigma))));
  Covariance3 out{};
  for (std::size_t k = 0; k < 3; ++k) out[4 * k] = of[k] * of[k];
  return out;
}

/// Of a term: its scale is in sigmas, and is never estimated.
TermLoss loss_from(const std::string& text) {
  const Loss loss = parse_loss({.unit = "sigmas", .automatic = false}, text).value();
  return {loss.kind, loss.scale_px};
}

std::uint32_t parameter_named(const ProblemHandle& held, std::uint32_t camera,
                              const std::string& name) {
  const WriteUse use(held, Validity::any);
  const Problem& p = use.problem();
  if (camera >= p.cameras.size())
    throw Error(ErrorCode::usage, "camera: found " + std::to_string(camera) +
                                      ", expected less than " + std::to_string(p.cameras.size()));
  const auto names = parameter_names(p.cameras[camera].model);
  for (std::size_t k = 0; k < names.size(); ++k)
    if (names[k] == name) return static_cast<std::uint32_t>(k);
  throw Error(ErrorCode::usage,
              "parameter: " + std::string(to_string(p.cameras[camera].model)) + " has no " + name);
}

/// Adds a term, or leaves the problem as it was where that is not valid.
template <class Term>
void add(const ProblemHandle& held, std::vector<Term>& list, Term term) {
  const WriteUse use(held, Validity::any);
  list.push_back(std::move(term));
  if (const auto wrong = wrong_terms(use.problem())) {
    list.pop_back();
    throw Error(ErrorCode::usage, *wrong);
  }
}

void add_centre_prior(const ProblemHandle& held, std::uint32_t image, nb::handle position,
                      nb::handle covariance, nb::handle sigma, nb::handle lever_arm,
                      const std::string& loss) {
  CentrePrior prior{image, numbers_from<3>(position, "position"),
                    covariance_from(covariance, sigma), loss_from(loss)};
  if (!lever_arm.is_none()) prior.lever_arm = numbers_from<3>(lever_arm, "lever_arm");
  add(held, held->problem.terms.centres, prior);
}

void add_rotation_prior(const ProblemHandle& held, std::uint32_t image, nb::handle rotation,
                        nb::handle covariance, nb::handle sigma, const std::string& loss) {
  add(held, held->problem.terms.rotations,
      RotationPrior{image, numbers_from<4>(rotation, "rotation"),
                    covariance_from(covariance, sigma), loss_from(loss)});
}

void add_gravity_prior(const ProblemHandle& held, std::uint32_t image, nb::handle measured,
                       double sigma_rad, nb::handle down, const std::string& loss) {
  GravityPrior prior;
  prior.image = image;
  prior.measured = numbers_from<3>(measured, "measured");
  if (!down.is_none()) prior.down = numbers_from<3>(down, "down");
  prior.sigma_rad = sigma_rad;
  prior.loss = loss_from(loss);
  add(held, held->problem.terms.gravities, prior);
}

void add_relative_pose_prior(const ProblemHandle& held, std::uint32_t first, std::uint32_t second,
                             nb::handle second_from_first, nb::handle square_root,
                             const std::string& loss) {
  const auto pose = numbers_from<7>(second_from_first, "second_from_first");
  RelativePosePrior prior;
  prior.first = first;
  prior.second = second;
  std::copy_n(pose.begin(), 4, prior.rotation.begin());
  std::copy_n(pose.begin() + 4, 3, prior.translation.begin());
  prior.square_root = matrix_from<6>(square_root, "square_root");
  prior.loss = loss_from(loss);
  add(held, held->problem.terms.relative_poses, prior);
}

void add_parameter_prior(const ProblemHandle& held, std::uint32_t camera, const std::string& name,
                         double value, double sigma, const std::string& loss) {
  add(held, held->problem.terms.parameters,
      ParameterPrior{camera, parameter_named(held, camera, name), value, sigma, loss_from(loss)});
}

void add_parameter_bound(const ProblemHandle& held, std::uint32_t camera, const std::string& name,
                         double lower, double upper) {
  add(held, held->problem.terms.bounds,
      ParameterBound{camera, parameter_named(held, camera, name), lower, upper});
}

void add_point_prior(const ProblemHandle& held, std::uint32_t point, nb::handle position,
                     nb::handle covariance, nb::handle sigma) {
  add(held, held->problem.terms.points,
      PointPrior{point, numbers_from<3>(position, "position"), covariance_from(covariance, sigma)});
}

void add_distance_prior(const ProblemHandle& held, std::uint32_t first, std::uint32_t second,
                        double distance, double sigma, const std::string& loss) {
  add(held, held->problem.terms.distances,
      DistancePrior{first, second, distance, sigma, loss_from(loss)});
}

/// Blocks: (kind, index, state).
GaussianPrior::Block block_from(nb::handle given) {
  using Kind = GaussianPrior::Block::Kind;
  const auto parts = nb::cast<nb::sequence>(given);
  if (nb::len(parts) != 3)
    throw Error(ErrorCode::usage, "blocks: expected (kind, index, state) of each");
  const auto kind = nb::cast<std::string>(nb::object(parts[0]));
  if (kind != "pose" && kind != "camera" && kind != "point")
    throw Error(ErrorCode::usage, "blocks: expected pose, camera or point, not '" + kind + "'");
  return {kind == "pose"     ? Kind::pose
          : kind == "camera" ? Kind::camera
                             : Kind::point,
          nb::cast<std::uint32_t>(nb::object(parts[1])),
          reals_from(nb::object(parts[2]), "state", 1)};
}

void add_gaussian_prior(const ProblemHandle& held, nb::handle blocks, nb::handle square_root,
                        nb::handle mean, const std::string& loss) {
  GaussianPrior prior;
  for (nb::handle block : nb::borrow<nb::object>(blocks)) prior.blocks.push_back(block_from(block));
  const nb::object S = nb::module_::import_("numpy").attr("asarray")(square_root);
  prior.square_root = reals_from(S.attr("reshape")(-1), "square_root", 1);
  if (!mean.is_none()) prior.mean = reals_from(mean, "mean", 1);
  prior.loss = loss_from(loss);
  add(held, held->problem.terms.gaussians, std::move(prior));
}

nb::dict counts_of(const HeldProblem& held) {
  const Terms& terms = held.problem.terms;
  nb::dict out;
  out["centres"] = terms.centres.size();
  out["rotations"] = terms.rotations.size();
  out["gravities"] = terms.gravities.size();
  out["relative_poses"] = terms.relative_poses.size();
  out["parameters"] = terms.parameters.size();
  out["points"] = terms.points.size();
  out["distances"] = terms.distances.size();
  out["gaussians"] = terms.gaussians.size();
  out["bounds"] = terms.bounds.size();
  return out;
}

#define SHEAF_ARRAY "numpy.typing.ArrayLike"
#define SHEAF_COVARIANCE \
  "covariance: " SHEAF_ARRAY " | None = None, sigma: float | " SHEAF_ARRAY " | None = None"

void bind_image_priors(ProblemClass& problem) {
  problem
      .def("add_centre_prior", &add_centre_prior, nb::arg("image"), nb::arg("position"),
           nb::kw_only(), nb::arg("covariance") = nb::none(), nb::arg("sigma") = nb::none(),
           nb::arg("lever_arm") = nb::none(), nb::arg("loss") = "none",
           nb::sig("def add_centre_prior(self, image: int, position: " SHEAF_ARRAY
                   ", *, " SHEAF_COVARIANCE ", lever_arm: " SHEAF_ARRAY
                   " | None = None, loss: str = 'none') -> None"),
           "Where a camera was (its antenna, with a lever arm in its frame) has been measured: "
           "world, scene units. sigma: of all axes or of each; loss: as in solve, its scale in "
           "sigmas.")
      .def("add_rotation_prior", &add_rotation_prior, nb::arg("image"), nb::arg("rotation"),
           nb::kw_only(), nb::arg("covariance") = nb::none(), nb::arg("sigma") = nb::none(),
           nb::arg("loss") = "none",
           nb::sig("def add_rotation_prior(self, image: int, rotation: " SHEAF_ARRAY
                   ", *, " SHEAF_COVARIANCE ", loss: str = 'none') -> None"),
           "The rotation of an image was measured: qw qx qy qz of cam_from_world; covariance in "
           "rad^2, sigma in rad, in the camera's frame.")
      .def("add_gravity_prior", &add_gravity_prior, nb::arg("image"), nb::arg("measured"),
           nb::arg("sigma_rad"), nb::kw_only(), nb::arg("down") = nb::none(),
           nb::arg("loss") = "none",
           nb::sig("def add_gravity_prior(self, image: int, measured: " SHEAF_ARRAY
                   ", sigma_rad: float, *, down: " SHEAF_ARRAY
                   " | None = None, loss: str = 'none') -> None"),
           "The direction of gravity was measured in a camera's frame: unit vectors; down: in the "
           "world, 0 0 -1 by default.")
      .def("add_relative_pose_prior", &add_relative_pose_prior, nb::arg("first"), nb::arg("second"),
           nb::arg("second_from_first"), nb::arg("square_root"), nb::kw_only(),
           nb::arg("loss") = "none",
           nb::sig("def add_relative_pose_prior(self, first: int, second: int, "
                   "second_from_first: " SHEAF_ARRAY ", square_root: " SHEAF_ARRAY
                   ", *, loss: str = 'none') -> None"),
           "The motion between two images was measured: qw qx qy qz tx ty tz; square_root: S "
           "(6, 6), S^T S the inverse covariance of (rho, phi).");
}

void bind_lens_and_point_priors(ProblemClass& problem) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  problem
      .def("add_parameter_prior", &add_parameter_prior, nb::arg("camera"), nb::arg("parameter"),
           nb::arg("value"), nb::arg("sigma"), nb::kw_only(), nb::arg("loss") = "none",
           "A parameter of a lens was measured, in its unit: 'fx', 'k1', as docs/cameras.md has "
           "them.")
      .def("add_parameter_bound", &add_parameter_bound, nb::arg("camera"), nb::arg("parameter"),
           nb::kw_only(), nb::arg("lower") = -kInfinity, nb::arg("upper") = kInfinity,
           nb::sig("def add_parameter_bound(self, camera: int, parameter: str, *, lower: float = "
                   "float('-inf'), upper: float = float('inf')) -> None"),
           "A parameter of a lens stays within an interval that it starts in.")
      .def("add_point_prior", &add_point_prior, nb::arg("point"), nb::arg("position"),
           nb::kw_only(), nb::arg("covariance") = nb::none(), nb::arg("sigma") = nb::none(),
           nb::sig("def add_point_prior(self, point: int, position: " SHEAF_ARRAY
                   ", *, " SHEAF_COVARIANCE ") -> None"),
           "A point was measured: world, scene units.")
      .def("add_distance_prior", &add_distance_prior, nb::arg("first"), nb::arg("second"),
           nb::arg("distance"), nb::arg("sigma"), nb::kw_only(), nb::arg("loss") = "none",
           "The distance between two points was measured, scene units. Few: both points become "
           "columns of the camera system.")
      .def(
          "add_gaussian_prior", &add_gaussian_prior, nb::arg("blocks"), nb::arg("square_root"),
          nb::arg("mean") = nb::none(), nb::kw_only(), nb::arg("loss") = "none",
          nb::sig("def add_gaussian_prior(self, blocks: "
                  "collections.abc.Sequence[tuple[str, int, " SHEAF_ARRAY
                  "]], square_root: " SHEAF_ARRAY ", mean: " SHEAF_ARRAY
                  " | None = None, *, loss: str = 'none') -> None"),
          "A Gaussian over several blocks at once, such as marginalisation leaves: cost "
          "1/2 |S (d - mean)|^2, d the blocks' differences from their states, stacked. Blocks: "
          "(kind, index, state): 'pose' (7 numbers), 'camera' (its parameters), 'point' (X, Y, Z).")
      .def(
          "clear_priors",
          [](const ProblemHandle& held) {
            const WriteUse use(held, Validity::any);
            use.problem().terms = {};
          },
          "Takes out all priors and bounds.")
      .def_prop_ro("priors", &counts_of, nb::sig("def priors(self) -> dict[str, int]"),
                   "How many there are of each kind.");
}

}  // namespace

void bind_terms(ProblemClass& problem) {
  bind_image_priors(problem);
  bind_lens_and_point_priors(problem);
}

}  // namespace sheaf
