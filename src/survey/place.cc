// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "io/line_cursor.h"
#include "platform/real_text.h"
#include "scene/rigs.h"
#include "starts/sights.h"
#include "survey/file_place.h"
#include "survey/image_names.h"
#include "survey/motion.h"
#include "survey/survey_terms.h"
#include "survey/triangulate.h"

namespace sheaf {
namespace {

constexpr std::size_t kLeastTies = 3;
// A model that may not move is in the survey's frame where its ties stray by less, in the median.
constexpr double kInPlaceSigmas = 10;
// Doubles of this size are 1.5e-11 apart.
constexpr double kFarFromZero = 1e5;

std::string figures(double x) { return few_digits(x, 6); }
std::string counted(std::size_t n, const std::string& what) {
  return std::to_string(n) + " " + what + (n == 1 ? "" : "s");
}

/// How a survey is brought to a problem.
struct Manner {
  SurveyTies by = SurveyTies::all;
  bool rigid = false;
  bool must_move = false;  ///< where the motion is not determined, that is an error
};

/// Brings a problem and a survey together, step by step; the problem changes in the last one.
class Placing {
 public:
  Placing(Problem& problem, const Constraints& constraints, const Fixed& fixed,
          const Manner& manner)
      : problem_(problem), fixed_(fixed), manner_(manner), names_(problem) {
    out_.constraints = constraints;
    out_.frame = constraints.frame;
  }

  Result<Survey> run() {
    if (!problem_.terms.empty())
      return Error(ErrorCode::usage, "the problem has terms already: it can take no survey");
    place_images(problem_);
    if (auto e = find_positions()) return *e;
    count_marks_in_pixels();
    find_points();
    choose_origin();
    collect_ties();
    if (auto e = used_at_all()) return *e;
    if (auto e = find_motion()) return *e;
    Result<Terms> terms = survey_terms(problem_, out_, names_);
    if (!terms.ok()) return terms.error();
    if (motion_) move(problem_, *motion_);
    add_points();
    add_survey_points(terms.value());
    problem_.terms = std::move(terms).value();
    if (!manner_.must_move) start_within_bounds();
    out_.metadata = std::move(problem_.metadata);
    problem_.metadata = nullptr;
    return std::move(out_);
  }

 private:
  template <class Entry>
  void leave_out(const Entry& entry, const std::string& what) {
    out_.unused.push_back(place_of(constraints_, entry) + ": " + what);
  }

  /// Two names may mean one image: with its folder and without.
  std::optional<Error> find_positions() {
    std::map<std::uint32_t, const ImagePosition*> seen;
    for (const ImagePosition& p : constraints_.positions) {
      out_.position_image.push_back(names_.find(p.image));
      if (out_.position_image.back() == Survey::kNone) {
        leave_out(p, "the model has no image " + sheaf::quoted(p.image));
        continue;
      }
      const auto [at, is_new] = seen.try_emplace(out_.position_image.back(), &p);
      if (!is_new)
        return Error(ErrorCode::unreadable_input,
                     place_of(constraints_, p) + ": found a second position of the image " +
                         sheaf::quoted(p.image) + " of the model, expected one (" +
                         place_beside(constraints_, *at->second, p) + ", of " +
                         sheaf::quoted(at->second->image) + ")");
    }
    return {};
  }

  /// Marks that count in the size of their image, from its middle.
  void count_marks_in_pixels() {
    for (SurveyPoint& point : out_.constraints.points)
      std::erase_if(point.marks, [&](SurveyMark& mark) {
        const std::uint32_t image = mark.normalised ? names_.find(mark.image) : Survey::kNone;
        if (image == Survey::kNone) return false;
        const Camera& camera = problem_.cameras[problem_.image_camera[image]];
        if (camera.width_px == 0 || camera.height_px == 0) {
          leave_out(mark, "the mark of point " + sheaf::quoted(point.id) + " in image " +
                              sheaf::quoted(mark.image) +
                              " counts in the size of the image, which the model does not have");
          return true;
        }
        const double width = static_cast<double>(camera.width_px);
        const double height = static_cast<double>(camera.height_px);
        const double longer = std::max(width, height);
        mark.pixel = {width / 2 + longer * mark.pixel[0], height / 2 + longer * mark.pixel[1]};
        mark.normalised = false;
        return false;
      });
  }

  std::uint32_t model_point(const SurveyPoint& point) {
    const std::uint64_t id = *point.model_point;
    const bool has_ids = problem_.metadata != nullptr && !problem_.metadata->point_ids.empty();
    if (!has_ids)
      return id < problem_.num_points() ? static_cast<std::uint32_t>(id) : Survey::kNone;
    const std::vector<std::uint64_t>& ids = problem_.metadata->point_ids;
    const auto found = std::find(ids.begin(), ids.end(), id);
    return found == ids.end() ? Survey::kNone : static_cast<std::uint32_t>(found - ids.begin());
  }

  std::vector<Sighting> sightings_of(const SurveyPoint& point) {
    std::vector<Sighting> out;
    for (const SurveyMark& mark : point.marks) {
      const std::uint32_t image = names_.find(mark.image);
      if (image == Survey::kNone) {
        leave_out(mark, "the model has no image " + sheaf::quoted(mark.image) +
                            ", which has a mark "
                            "of point " +
                            sheaf::quoted(point.id));
      } else {
        out.push_back({image, mark.pixel});
      }
    }
    return out;
  }

  /// Where each point is in the model as it is; check points wait for the adjusted one.
  void find_points() {
    std::vector<std::vector<Sighting>> sightings;
    for (const SurveyPoint& point : constraints_.points) sightings.push_back(sightings_of(point));
    places_ = triangulate(problem_, sightings);
    for (std::size_t i = 0; i < constraints_.points.size(); ++i) {
      const SurveyPoint& point = constraints_.points[i];
      out_.point.push_back(Survey::kNone);
      if (point.model_point) {
        const std::uint32_t own = out_.point[i] = model_point(point);
        if (own == Survey::kNone) {
          leave_out(point, "the model has no point " + std::to_string(*point.model_point) +
                               ", which point " + sheaf::quoted(point.id) + " is to be");
        } else {
          const double* X = &problem_.points[3 * std::size_t(own)];
          places_[i] = {X[0], X[1], X[2]};
        }
      } else if (sightings[i].size() < 2) {
        leave_out(point, "point " + sheaf::quoted(point.id) + " has " +
                             counted(sightings[i].size(), "mark") +
                             " in images of the model, and needs two");
      } else if (!places_[i]) {
        leave_out(point, "the rays of the marks of point " + sheaf::quoted(point.id) +
                             " meet nowhere in front of their cameras");
      }
    }
  }

  /// At the first of what is used, to whole hundreds: few digits, which are taken off exactly.
  void choose_origin() {
    std::optional<std::array<double, 3>>& origin = out_.frame.origin;
    if (origin || out_.frame.kind == WorldKind::local) return;
    for (std::size_t i = 0; i < out_.position_image.size() && !origin; ++i)
      if (out_.position_image[i] != Survey::kNone) origin = constraints_.positions[i].at;
    for (std::size_t i = 0; i < places_.size() && !origin; ++i)
      if (places_[i] && constraints_.points[i].role != SurveyRole::tie)
        origin = constraints_.points[i].at;
    if (!origin) origin.emplace();
    if (out_.frame.kind == WorldKind::projected)
      for (double& x : *origin) x = 100 * std::round(x / 100);
  }

  void collect_ties() {
    for (std::size_t i = 0; i < constraints_.positions.size(); ++i) {
      if (out_.position_image[i] == Survey::kNone || manner_.by == SurveyTies::control) continue;
      const ImagePosition& p = constraints_.positions[i];
      const Pose& pose = problem_.poses[out_.position_image[i]];
      const Matrix3<double> R = matrix_from_quaternion(pose.rotation);
      ties_.push_back({"the position of " + sheaf::quoted(p.image), camera_centre(R, pose),
                       turned_back(R, p.lever_arm), to_local(out_.frame, p.at), p.covariance});
      ++positions_;
    }
    for (std::size_t i = 0; i < constraints_.points.size(); ++i) {
      const SurveyPoint& point = constraints_.points[i];
      if (!places_[i] || point.role != SurveyRole::control) continue;
      if (manner_.by == SurveyTies::positions) continue;
      ties_.push_back({"control point " + sheaf::quoted(point.id),
                       *places_[i],
                       {},
                       to_local(out_.frame, point.at),
                       covariance_of(point)});
      ++control_;
    }
  }

  std::optional<Error> used_at_all() const {
    const std::size_t others = constraints_.rotations.size() + constraints_.gravities.size() +
                               constraints_.lenses.size() + constraints_.scale_bars.size();
    if (!ties_.empty() || others > 0 || manner_.must_move) return {};
    std::string why = "it states neither positions nor control points";
    if (!out_.unused.empty()) why = out_.unused.front();
    return Error(ErrorCode::unreadable_input,
                 paths_of(constraints_) + ": nothing of it can be used with this model; " + why);
  }

  bool held() const {
    return fixed_.points || fixed_.poses || !fixed_.pose_ids.empty() || !fixed_.frame_ids.empty();
  }
  std::string ties_text() const {
    if (manner_.by == SurveyTies::positions) return counted(positions_, "position");
    if (manner_.by == SurveyTies::control) return counted(control_, "control point");
    return counted(positions_, "position") + " and " + counted(control_, "control point");
  }

  /// Whether the model is in the survey's frame as it is: its numbers are those of the local frame,
  /// or those of the survey's own coordinates, of which the origin is then taken off.
  bool stays_in_place(const std::string& why) {
    if (manner_.must_move) return false;
    if (median_sigmas(ties_, {}) <= kInPlaceSigmas) {
      out_.words.push_back(why + ": the model stays");
      return true;
    }
    if (out_.frame.kind != WorldKind::projected) return false;
    const std::array<double, 3>& o = *out_.frame.origin;
    const Similarity shift{1, {1, 0, 0, 0}, {-o[0], -o[1], -o[2]}};
    if (!(median_sigmas(ties_, shift) <= kInPlaceSigmas)) return false;
    set_motion(shift);
    out_.rigid = true;
    out_.words.push_back(why +
                         ": the model, which counts in the survey's coordinates, stays there; it "
                         "is written less their origin " +
                         few_digits(o[0], 15) + " " + few_digits(o[1], 15) + " " +
                         few_digits(o[2], 15));
    return true;
  }

  std::optional<Error> find_motion() {
    if (manner_.must_move && ties_.size() < kLeastTies)
      return Error(ErrorCode::unreadable_input,
                   paths_of(constraints_) + ": found " + ties_text() +
                       " that can be used, expected three: by fewer it is not determined how the "
                       "model is turned and scaled" +
                       (out_.unused.empty() ? "" : "; " + out_.unused.front()));
    if (ties_.empty()) return {};
    tell_far_numbers();
    if (held()) {
      if (stays_in_place("poses or points are held")) return {};
      return Error(ErrorCode::usage,
                   paths_of(constraints_) + ": the model is not in the frame of its coordinates (" +
                       ties_text() + " are off by " + figures(median_sigmas(ties_, {})) +
                       " sigmas in the median) and cannot be moved there, since poses or points "
                       "are held: solve without --fix of these first");
    }
    if (ties_.size() < kLeastTies) {
      if (stays_in_place(ties_text() + " are too few to move by")) return {};
      out_.words.push_back(ties_text() +
                           " of the three that are needed: how the model is turned "
                           "and scaled is not determined by them, and it was not moved");
      return {};
    }
    if (in_a_line(ties_)) {
      if (stays_in_place("what is used lies in a line")) return {};
      return Error(ErrorCode::unreadable_input,
                   paths_of(constraints_) + ": " + ties_text() +
                       " that are used lie in a line: how the "
                       "model is turned about it is not determined; add one beside the line");
    }
    out_.rigid =
        manner_.rigid || (!problem_.rigs.empty() && (fixed_.sensors || !fixed_.sensor_ids.empty()));
    const SurveyMotion motion = motion_of(ties_, out_.rigid);
    if (!(motion.similarity.scale > 0) || !std::isfinite(motion.similarity.scale))
      return Error(ErrorCode::unreadable_input,
                   paths_of(constraints_) + ": no motion takes the model to its coordinates");
    tell(motion);
    return {};
  }

  void tell_far_numbers() {
    double most = 0;
    for (const SurveyTie& tie : ties_)
      for (const double x : tie.to) most = std::max(most, std::abs(x));
    if (out_.frame.kind == WorldKind::local && most > kFarFromZero)
      out_.words.push_back("coordinates are up to " + figures(most) +
                           " from 0 and their frame is \"local\", which takes nothing off: as "
                           "\"projected\" they lose no digits");
  }

  void set_motion(const Similarity& motion) {
    motion_ = motion;
    out_.moved = true;
    out_.scale = motion.scale;
    out_.rotation = motion.rotation;
    out_.translation = motion.translation;
    out_.ties = ties_.size();
  }

  void tell(const SurveyMotion& motion) {
    set_motion(motion.similarity);
    out_.outliers = motion.outliers;
    out_.threshold_sigmas = motion.threshold_sigmas;
    const std::string why = manner_.rigid ? "" : "sensors are held: ";
    out_.words.push_back(out_.rigid ? why + "the model was turned and shifted to " + ties_text()
                                    : "the model was turned, shifted and scaled by " +
                                          figures(out_.scale) + " to " + ties_text());
  }

  void add_points() {
    for (std::size_t i = 0; i < places_.size(); ++i)
      if (places_[i] && motion_) places_[i] = (*motion_)(*places_[i]);
    out_.own_points = problem_.num_points();
    out_.own_observations = problem_.num_observations();
    out_.own_sigmas = !problem_.observation_sigma.empty();
  }

  /// Control points and ends of scale bars with their marks; then what ties them.
  void add_survey_points(Terms& terms) {
    std::vector<double> sigmas;
    for (std::size_t i = 0; i < constraints_.points.size(); ++i) {
      const SurveyPoint& point = constraints_.points[i];
      if (!places_[i] || point.role == SurveyRole::check) continue;
      if (!point.model_point) {
        const Vector3<double>& X = *places_[i];
        out_.point[i] = problem_.add_point(X[0], X[1], X[2]);
        for (const SurveyMark& mark : point.marks) {
          const std::uint32_t image = names_.find(mark.image);
          if (image == Survey::kNone) continue;
          problem_.add_observation(image, out_.point[i], mark.pixel[0], mark.pixel[1]);
          sigmas.push_back(mark.sigma_px);
        }
      }
      if (point.role == SurveyRole::control)
        terms.points.push_back(
            {out_.point[i], to_local(out_.frame, point.at), covariance_of(point)});
    }
    const bool weighed = std::any_of(sigmas.begin(), sigmas.end(), [](double s) { return s != 1; });
    if (weighed && !out_.own_sigmas) problem_.observation_sigma.assign(out_.own_observations, 1);
    if (weighed || out_.own_sigmas)
      problem_.observation_sigma.insert(problem_.observation_sigma.end(), sigmas.begin(),
                                        sigmas.end());
    add_scale_bars(terms);
  }

  void start_within_bounds() {
    for (const ParameterBound& bound : problem_.terms.bounds) {
      Camera& camera = problem_.cameras[bound.camera];
      double& value = camera.parameters[bound.parameter];
      const double start = std::clamp(value, bound.lower, bound.upper);
      if (start == value) continue;
      out_.words.push_back(std::string(parameter_names(camera.model)[bound.parameter]) +
                           " of camera " + std::to_string(bound.camera) + " starts at its bound " +
                           figures(start) + ": the model has " + figures(value));
      value = start;
    }
  }

  void add_scale_bars(Terms& terms) {
    std::map<std::string, std::uint32_t> points;
    for (std::size_t i = 0; i < constraints_.points.size(); ++i)
      points[constraints_.points[i].id] =
          constraints_.points[i].role == SurveyRole::check ? Survey::kNone : out_.point[i];
    for (const ScaleBar& bar : constraints_.scale_bars) {
      const std::uint32_t first = points[bar.first], second = points[bar.second];
      if (first == Survey::kNone || second == Survey::kNone) {
        leave_out(bar, "the scale bar from " + sheaf::quoted(bar.first) + " to " +
                           sheaf::quoted(bar.second) + " has an end that takes no part");
        continue;
      }
      terms.distances.push_back({first, second, bar.distance, bar.sigma, bar.loss});
    }
  }

  Problem& problem_;
  const Fixed& fixed_;
  const Manner manner_;
  ImageNames names_;
  Survey out_;
  const Constraints& constraints_ = out_.constraints;
  std::vector<std::optional<Vector3<double>>> places_;  ///< of points, in the model
  std::vector<SurveyTie> ties_;
  std::size_t positions_ = 0, control_ = 0;
  std::optional<Similarity> motion_;
};

}  // namespace

Result<Survey> place_survey(Problem& problem, const Constraints& constraints, const Fixed& fixed) {
  return Placing(problem, constraints, fixed, {}).run();
}

Result<Survey> move_to_survey(Problem& problem, const Constraints& constraints,
                              const SurveyMotionOptions& options) {
  const Manner manner{options.by, options.rigid, true};
  return Placing(problem, constraints, {}, manner).run();
}

}  // namespace sheaf
