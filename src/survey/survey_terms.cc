// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "survey/survey_terms.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "io/line_cursor.h"
#include "survey/file_place.h"

namespace sheaf {
namespace {

template <class Entry>
std::string at(const Survey& survey, const Entry& entry) {
  return place_of(survey.constraints, entry) + ": ";
}

/// The image of something that names one, or kNone and a sentence among the unused.
template <class Named>
std::uint32_t image_of(const Named& named, Survey& survey, const ImageNames& names) {
  const std::uint32_t image = names.find(named.image);
  if (image == Survey::kNone)
    survey.unused.push_back(at(survey, named) + "the model has no image " +
                            sheaf::quoted(named.image));
  return image;
}

Result<void> add_lens(const Problem& problem, const LensValue& lens, std::uint32_t image,
                      const Survey& survey, Terms& terms) {
  const std::uint32_t camera = problem.image_camera[image];
  const std::vector<std::string_view> names = parameter_names(problem.cameras[camera].model);
  const auto found = std::find(names.begin(), names.end(), lens.parameter);
  if (found == names.end()) {
    std::string all;
    for (const std::string_view name : names) all += (all.empty() ? "" : ", ") + std::string(name);
    return Error(ErrorCode::unreadable_input, at(survey, lens) + "found the parameter " +
                                                  sheaf::quoted(lens.parameter) +
                                                  ", expected one that the lens of image " +
                                                  sheaf::quoted(lens.image) + " has: " + all);
  }
  const auto parameter = static_cast<std::uint32_t>(found - names.begin());
  if (lens.value)
    terms.parameters.push_back({camera, parameter, *lens.value, lens.sigma, lens.loss});
  if (!std::isfinite(lens.lower) && !std::isfinite(lens.upper)) return {};
  for (const ParameterBound& bound : terms.bounds)
    if (bound.camera == camera && bound.parameter == parameter)
      return Error(ErrorCode::unreadable_input,
                   at(survey, lens) + "found bounds of " + lens.parameter +
                       " of a lens that has them already, expected them once for all its images");
  terms.bounds.push_back({camera, parameter, lens.lower, lens.upper});
  return {};
}

Result<void> check_model_points(const Survey& survey) {
  std::map<std::uint64_t, const SurveyPoint*> seen;
  for (const SurveyPoint& point : survey.constraints.points) {
    if (!point.model_point) continue;
    const auto [found, is_new] = seen.try_emplace(*point.model_point, &point);
    if (!is_new)
      return Error(ErrorCode::unreadable_input,
                   at(survey, point) + "found the model's point " +
                       std::to_string(*point.model_point) + " a second time, expected it once (" +
                       place_beside(survey.constraints, *found->second, point) + ")");
  }
  return {};
}

}  // namespace

Covariance3 covariance_of(const SurveyPoint& point) {
  Covariance3 C{};
  for (std::size_t k = 0; k < 3; ++k) C[4 * k] = point.sigma[k] * point.sigma[k];
  return C;
}

Result<Terms> survey_terms(const Problem& problem, Survey& survey, const ImageNames& names) {
  const Constraints& c = survey.constraints;
  if (Result<void> good = check_model_points(survey); !good.ok()) return good.error();
  Terms terms;
  for (std::size_t i = 0; i < c.positions.size(); ++i) {
    const ImagePosition& p = c.positions[i];
    if (survey.position_image[i] != Survey::kNone)
      terms.centres.push_back({survey.position_image[i], to_local(survey.frame, p.at), p.covariance,
                               p.loss, p.lever_arm});
  }
  for (const ImageRotation& r : c.rotations)
    if (const std::uint32_t image = image_of(r, survey, names); image != Survey::kNone)
      terms.rotations.push_back({image, r.rotation, r.covariance, r.loss});
  for (const ImageGravity& g : c.gravities)
    if (const std::uint32_t image = image_of(g, survey, names); image != Survey::kNone)
      terms.gravities.push_back({image, g.down, {0, 0, -1}, g.sigma_rad, g.loss});
  for (const LensValue& lens : c.lenses) {
    const std::uint32_t image = image_of(lens, survey, names);
    if (image == Survey::kNone) continue;
    if (Result<void> good = add_lens(problem, lens, image, survey, terms); !good.ok())
      return good.error();
  }
  return terms;
}

}  // namespace sheaf
