// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <map>

#include "scene/rigs.h"
#include "starts/sights.h"
#include "survey/image_names.h"
#include "survey/triangulate.h"

namespace sheaf {
namespace {

void judge(SurveyResidual& r) {
  for (std::size_t k = 0; k < 3; ++k)
    r.worst_sigmas = std::max(r.worst_sigmas, std::abs(r.residual[k]) / r.sigma[k]);
  for (const MarkResidual& mark : r.marks)
    for (const double x : mark.residual_px)
      r.worst_sigmas = std::max(r.worst_sigmas, std::abs(x) / mark.sigma_px);
  r.blunder = r.worst_sigmas > kBlunderSigmas;
}

void sort_worst_first(std::vector<SurveyResidual>& list) {
  std::stable_sort(list.begin(), list.end(), [](const SurveyResidual& a, const SurveyResidual& b) {
    return a.worst_sigmas > b.worst_sigmas;
  });
}

std::array<double, 3> rmse(const std::vector<SurveyResidual>& list) {
  std::array<double, 3> out{};
  if (list.empty()) return out;
  for (const SurveyResidual& r : list)
    for (std::size_t k = 0; k < 3; ++k) out[k] += r.residual[k] * r.residual[k];
  for (double& x : out) x = std::sqrt(x / static_cast<double>(list.size()));
  return out;
}

SurveyResidual residual_of(const Survey& survey, const std::string& name,
                           const Vector3<double>& adjusted, const std::array<double, 3>& stated) {
  SurveyResidual out;
  out.name = name;
  out.adjusted = to_world(survey.frame, adjusted);
  const std::array<double, 3> at = to_local(survey.frame, stated);
  for (std::size_t k = 0; k < 3; ++k) out.residual[k] = adjusted[k] - at[k];
  return out;
}

SurveyResidual measured(const Problem& problem, const Survey& survey, std::size_t i) {
  const ImagePosition& p = survey.constraints.positions[i];
  const Pose& pose = problem.poses[survey.position_image[i]];
  const Matrix3<double> R = matrix_from_quaternion(pose.rotation);
  Vector3<double> antenna = camera_centre(R, pose);
  const Vector3<double> arm = turned_back(R, p.lever_arm);
  for (std::size_t k = 0; k < 3; ++k) antenna[k] += arm[k];
  SurveyResidual out = residual_of(survey, p.image, antenna, p.at);
  for (std::size_t k = 0; k < 3; ++k) out.sigma[k] = std::sqrt(p.covariance[4 * k]);
  judge(out);
  return out;
}

SurveyResidual measured(const Problem& problem, const Survey& survey, const ImageNames& names,
                        const SurveyPoint& point, const Vector3<double>& X) {
  SurveyResidual out = residual_of(survey, point.id, X, point.at);
  out.sigma = point.sigma;
  for (const SurveyMark& mark : point.marks) {
    const std::uint32_t image = names.find(mark.image);
    if (image == Survey::kNone) continue;
    out.marks.push_back(
        {mark.image, mark_residual(problem, {image, mark.pixel}, X), mark.sigma_px});
  }
  judge(out);
  return out;
}

/// Where each point is: those that took part as they were adjusted, check points triangulated.
std::vector<std::optional<Vector3<double>>> places_of(const Problem& problem, const Survey& survey,
                                                      const ImageNames& names) {
  const std::vector<SurveyPoint>& points = survey.constraints.points;
  std::vector<std::vector<Sighting>> sightings(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (survey.point[i] != Survey::kNone) continue;
    for (const SurveyMark& mark : points[i].marks)
      if (const std::uint32_t image = names.find(mark.image); image != Survey::kNone)
        sightings[i].push_back({image, mark.pixel});
  }
  auto out = triangulate(problem, sightings);
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (survey.point[i] == Survey::kNone) {
      if (points[i].role != SurveyRole::check) out[i].reset();
      continue;
    }
    const double* X = &problem.points[3 * std::size_t(survey.point[i])];
    out[i] = {X[0], X[1], X[2]};
  }
  return out;
}

std::vector<DistanceResidual> distances_of(
    const Survey& survey, const std::vector<std::optional<Vector3<double>>>& places) {
  std::map<std::string, std::size_t> index;
  for (std::size_t i = 0; i < places.size(); ++i) index[survey.constraints.points[i].id] = i;
  std::vector<DistanceResidual> out;
  for (const ScaleBar& bar : survey.constraints.scale_bars) {
    const auto &a = places[index[bar.first]], &b = places[index[bar.second]];
    if (!a || !b) continue;
    const double length = std::hypot((*a)[0] - (*b)[0], (*a)[1] - (*b)[1], (*a)[2] - (*b)[2]);
    const double residual = length - bar.distance;
    out.push_back({bar.first, bar.second, residual, bar.sigma,
                   std::abs(residual) > kBlunderSigmas * bar.sigma});
  }
  std::stable_sort(out.begin(), out.end(),
                   [](const DistanceResidual& a, const DistanceResidual& b) {
                     return std::abs(a.residual) / a.sigma > std::abs(b.residual) / b.sigma;
                   });
  return out;
}

void take_out(Problem& problem, const Survey& survey) {
  problem.terms = {};
  problem.points.resize(3 * survey.own_points);
  problem.observation_image.resize(survey.own_observations);
  problem.observation_point.resize(survey.own_observations);
  problem.observation_xy.resize(2 * survey.own_observations);
  problem.observation_sigma.resize(survey.own_sigmas ? survey.own_observations : 0);
  problem.metadata = survey.metadata;
}

}  // namespace

SurveyReport finish_survey(Problem& problem, const Survey& survey) {
  place_images(problem);
  problem.metadata = survey.metadata;
  const ImageNames names(problem);
  const auto places = places_of(problem, survey, names);
  SurveyReport out;
  for (std::size_t i = 0; i < survey.position_image.size(); ++i)
    if (survey.position_image[i] != Survey::kNone)
      out.positions.push_back(measured(problem, survey, i));
  for (std::size_t i = 0; i < places.size(); ++i) {
    const SurveyPoint& point = survey.constraints.points[i];
    if (!places[i] || point.role == SurveyRole::tie) continue;
    (point.role == SurveyRole::control ? out.control : out.check)
        .push_back(measured(problem, survey, names, point, *places[i]));
  }
  out.distances = distances_of(survey, places);
  for (auto* list : {&out.positions, &out.control, &out.check}) sort_worst_first(*list);
  out.positions_rmse = rmse(out.positions);
  out.control_rmse = rmse(out.control);
  out.check_rmse = rmse(out.check);
  take_out(problem, survey);
  return out;
}

}  // namespace sheaf
