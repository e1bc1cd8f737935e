// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iomanip>
#include <map>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include "geometry/rigid_motion.h"
#include "platform/random.h"
#include "scene/rigs.h"
#include "scene/similarity.h"
#include "sheaf/scene.h"
#include "sheaf/solve.h"
#include "starts/sights.h"
#include "survey/study_scene.h"

// Surveys of rigs, from survey.json to the adjusted model.
namespace sheaf {
namespace {

constexpr std::array<double, 3> kFar{500000, 4650000, 300};
constexpr double kDegree = std::numbers::pi / 180;

std::string list(const auto& numbers) {
  std::ostringstream out;
  out << std::setprecision(17);
  for (const double x : numbers) out << (out.tellp() == 0 ? "[" : ", ") << x;
  return out.str() + "]";
}
std::string text(double x) {
  std::ostringstream out;
  out << std::setprecision(17) << x;
  return out.str();
}

/// A drive of a stereo rig, its truth in the local frame of a survey, and what the survey states.
class Drive {
 public:
  explicit Drive(double scale, double sensor_noise) : random_(5) {
    RigSceneOptions options;
    options.frames = 24;
    options.scene.points = 900;
    options.scene.pixel_noise_px = 1;
    options.sensor_rotation_noise_rad = 0.3 * sensor_noise;
    options.sensor_translation_noise = sensor_noise;
    const Scene scene = generate(options).value();
    start = scene.start;
    truth = scene.truth;
    move(truth, {scale, normalized(Quaternion<double>{0.6, 0.5, -0.4, 0.3}), {1, 2, 3}});
    place_images(truth);
  }

  const std::string& name(std::size_t image) const { return start.metadata->image_names[image]; }
  Matrix3<double> rotation(std::size_t image) const {
    return matrix_from_quaternion(truth.poses[image].rotation);
  }

  /// Every `every`-th image; the antenna of each sensor is somewhere else.
  void add_positions(double sigma, std::size_t every) {
    for (std::size_t j = 0; j < truth.num_images(); j += every) {
      const Vector3<double> arm = truth.rigs.image_sensor[j] == 0
                                      ? Vector3<double>{0.2, -0.9, 0.1}
                                      : Vector3<double>{-0.3, -0.8, 0.4};
      const Matrix3<double> R = rotation(j);
      Vector3<double> at = camera_centre(R, truth.poses[j]);
      const Vector3<double> turned = turned_back(R, arm);
      for (std::size_t k = 0; k < 3; ++k) at[k] += turned[k] + kFar[k] + sigma * random_.normal();
      add("positions", R"({"image": ")" + name(j) + R"(", "xyz": )" + list(at) + R"(, "sigma": )" +
                           text(sigma) + R"(, "lever_arm": )" + list(arm) + "}");
    }
  }
  void add_gravity(double sigma_deg) {
    for (std::size_t j = 0; j < truth.num_images(); j += 3) {
      Vector3<double> down = multiply(rotation(j), Vector3<double>{0, 0, -1});
      for (double& x : down) x += kDegree * sigma_deg * random_.normal();
      add("gravity", R"({"image": ")" + name(j) + R"(", "down": )" + list(down) +
                         R"(, "sigma_deg": )" + text(sigma_deg) + "}");
    }
  }
  void add_rotations(double sigma_deg) {
    for (std::size_t j = 1; j < truth.num_images(); j += 4) {
      Vector3<double> phi;
      for (double& x : phi) x = kDegree * sigma_deg * random_.normal();
      const auto turned = left_perturbed<double>({truth.poses[j].rotation, {}}, {}, phi);
      add("rotations", R"({"image": ")" + name(j) + R"(", "rotation": )" + list(turned.rotation) +
                           R"(, "sigma_deg": )" + text(sigma_deg) + "}");
    }
  }
  void add_lenses(double sigma) {
    for (std::size_t j = 0; j < 2; ++j) {
      const double fx = truth.cameras[truth.image_camera[j]].parameters[0];
      add("lenses", R"({"image": ")" + name(j) + R"(", "parameter": "fx", "value": )" +
                        text(fx + sigma * random_.normal()) + R"(, "sigma": )" + text(sigma) + "}");
    }
  }
  /// Between points of the model that many images see, as far apart as possible.
  void add_bars(std::size_t count, double sigma, double too_long) {
    std::vector<std::uint32_t> seen(truth.num_points());
    for (const std::uint32_t point : truth.observation_point) ++seen[point];
    std::vector<std::uint32_t> order(truth.num_points());
    for (std::uint32_t i = 0; i < order.size(); ++i) order[i] = i;
    std::stable_sort(order.begin(), order.end(), [&](auto a, auto b) { return seen[a] > seen[b]; });
    for (std::size_t i = 0; i < count; ++i) {
      const std::uint32_t a = order[2 * i], b = order[2 * i + 1];
      for (const std::uint32_t point : {a, b})
        add("points", R"({"id": "p)" + std::to_string(point) +
                          R"(", "role": "tie", "model_point": )" + std::to_string(id_of(point)) +
                          "}");
      double square = 0;
      for (std::size_t k = 0; k < 3; ++k)
        square += std::pow(truth.points[3 * a + k] - truth.points[3 * b + k], 2);
      const double length = std::sqrt(square) + sigma * random_.normal() + (i == 0 ? too_long : 0);
      add("scale_bars", R"({"first": "p)" + std::to_string(a) + R"(", "second": "p)" +
                            std::to_string(b) + R"(", "distance": )" + text(length) +
                            R"(, "sigma": )" + text(sigma) + "}");
    }
  }

  Constraints constraints() const {
    std::string all = R"({"frame": {"kind": "projected", "origin": )" + list(kFar) + "}";
    for (const auto& [key, items] : lists_) all += ",\n\"" + key + "\": [" + items + "]";
    return parse_constraints(all + "}", "survey.json").value();
  }

  Problem start, truth;

 private:
  std::uint64_t id_of(std::uint32_t point) const {
    const std::vector<std::uint64_t>& ids = start.metadata->point_ids;
    return ids.empty() ? point : ids[point];
  }
  void add(const std::string& key, const std::string& item) {
    std::string& of = lists_[key];
    of += (of.empty() ? "" : ",\n") + item;
  }

  Random random_;
  std::map<std::string, std::string> lists_;
};

struct Adjusted {
  Problem problem;
  Survey survey;
  Summary summary;
  SurveyReport report;
};
Adjusted adjust(const Drive& drive, const Fixed& fixed) {
  Adjusted out{drive.start, {}, {}, {}};
  out.survey = place_survey(out.problem, drive.constraints(), fixed).value();
  EXPECT_TRUE(out.survey.unused.empty());
  SolveOptions options = test::tight();
  options.fixed = fixed;
  out.summary = solve(out.problem, options);
  out.report = finish_survey(out.problem, out.survey);
  return out;
}
Fixed sensors_held() {
  Fixed fixed;
  fixed.sensors = true;
  return fixed;
}

double largest_off(const Drive& drive, const Problem& problem) {
  double most = 0;
  for (std::size_t j = 0; j < problem.num_images(); ++j) {
    const Vector3<double> a = camera_centre(drive.rotation(j), drive.truth.poses[j]);
    const Matrix3<double> R = matrix_from_quaternion(problem.poses[j].rotation);
    const Vector3<double> b = camera_centre(R, problem.poses[j]);
    most = std::max(most, std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]));
  }
  return most;
}

/// What rows of one kind cost: half a squared sigma each, within four of its standard deviations.
void expect_ordinary(double cost, double rows) {
  EXPECT_NEAR(2 * cost / rows, 1, 4 * std::sqrt(2 / rows));
}

TEST(SurveyRigs, AllThatAFileStatesBringsHeldSensorsToTheTruth) {
  Drive drive(1, 0);
  drive.add_positions(0.05, 1);
  drive.add_gravity(0.2);
  drive.add_rotations(0.3);
  drive.add_lenses(0.5);
  const Adjusted end = adjust(drive, sensors_held());
  EXPECT_TRUE(end.survey.rigid);
  EXPECT_EQ(end.survey.scale, 1);
  for (std::size_t s = 0; s < drive.start.rigs.num_sensors(); ++s)
    EXPECT_EQ(end.problem.rigs.sensor_from_rig[s].translation,
              drive.start.rigs.sensor_from_rig[s].translation);
  EXPECT_LT(largest_off(drive, end.problem), 0.05);
  const TermCosts& costs = end.summary.final_terms;
  expect_ordinary(costs.centres, 3 * 48);
  expect_ordinary(costs.gravities, 2 * 16);
  expect_ordinary(costs.rotations, 3 * 12);
  EXPECT_LT(costs.parameters, 8);
  for (std::size_t c = 0; c < 2; ++c)
    EXPECT_NEAR(end.problem.cameras[c].parameters[0], drive.truth.cameras[c].parameters[0], 2);
}

TEST(SurveyRigs, FreeSensorsAreScaledWithTheModelAndFound) {
  Drive drive(10, 0.01);
  drive.add_positions(0.05, 2);
  drive.add_gravity(0.2);
  drive.add_lenses(0.5);
  const Adjusted end = adjust(drive, {});
  EXPECT_FALSE(end.survey.rigid);
  EXPECT_NEAR(end.survey.scale, 10, 0.3);
  EXPECT_LT(largest_off(drive, end.problem), 0.2);
  expect_ordinary(end.summary.final_terms.centres, 3 * 24);
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(end.problem.rigs.sensor_from_rig[1].translation[k],
                drive.truth.rigs.sensor_from_rig[1].translation[k], 0.1);
  }
}

TEST(SurveyRigs, AScaleBarAgreesWithHeldSensorsOrIsNamed) {
  for (const double too_long : {0.0, 0.5}) {
    Drive drive(1, 0);
    drive.add_positions(0.05, 3);
    drive.add_bars(3, 0.01, too_long);
    const Adjusted end = adjust(drive, sensors_held());
    ASSERT_EQ(end.report.distances.size(), 3u);
    EXPECT_EQ(end.report.distances[0].blunder, too_long > 0);
    EXPECT_FALSE(end.report.distances[1].blunder);
    EXPECT_LT(largest_off(drive, end.problem), too_long > 0 ? 0.5 : 0.1);
  }
}

TEST(SurveyRigs, HeldFramesInTheSurveysCoordinatesStayThere) {
  Drive drive(1, 0);
  drive.add_positions(0.05, 1);
  Problem problem = drive.truth;
  move(problem, {1, {1, 0, 0, 0}, kFar});
  Fixed fixed;
  fixed.poses = true;
  const Survey survey = place_survey(problem, drive.constraints(), fixed).value();
  EXPECT_TRUE(survey.moved && survey.rigid);
  EXPECT_EQ(survey.translation, (std::array<double, 3>{-kFar[0], -kFar[1], -kFar[2]}));
  EXPECT_EQ(survey.ties, 48u);
  EXPECT_LT(largest_off(drive, problem), 1e-8);
  for (std::size_t i = 0; i < problem.points.size(); ++i)
    EXPECT_NEAR(problem.points[i], drive.truth.points[i], 1e-9);
  EXPECT_EQ(problem.rigs.sensor_from_rig[1].translation,
            drive.truth.rigs.sensor_from_rig[1].translation);
}

}  // namespace
}  // namespace sheaf
