// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
//
// One test over all camera models: values against an independent implementation and against the
// published formulas written down again, Jacobians against automatic differentiation and
// differences, and the borders of each model's domain.
#include "geometry/camera_model.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "geometry/dual.h"
#include "geometry/lenses.h"

namespace sheaf {
namespace {

using test::Dual;
using test::ordinary;
using Real = long double;

constexpr std::array<CameraModel, kCameraModels> kAll{CameraModel::bal,
                                                      CameraModel::simple_pinhole,
                                                      CameraModel::pinhole,
                                                      CameraModel::simple_radial,
                                                      CameraModel::radial,
                                                      CameraModel::opencv,
                                                      CameraModel::full_opencv,
                                                      CameraModel::opencv_fisheye,
                                                      CameraModel::simple_radial_fisheye,
                                                      CameraModel::radial_fisheye,
                                                      CameraModel::thin_prism_fisheye,
                                                      CameraModel::fov,
                                                      CameraModel::eucm};

bool is_fisheye(CameraModel model) {
  return model == CameraModel::opencv_fisheye || model == CameraModel::simple_radial_fisheye ||
         model == CameraModel::radial_fisheye || model == CameraModel::thin_prism_fisheye;
}

/// The published formulas once more, in the form "u plus what distortion adds to it", in long
/// double and with the angle by acos.
std::array<Real, 2> published(const Camera& camera, const std::array<double, 3>& P) {
  std::array<Real, 12> k;
  for (std::size_t i = 0; i < 12; ++i) k[i] = camera.parameters[i];
  const Real X = P[0], Y = P[1], Z = P[2], r = std::sqrt(X * X + Y * Y);
  if (camera.model == CameraModel::bal) {
    const Real x = -X / Z, y = -Y / Z, n = x * x + y * y;
    return {k[0] * (1 + k[1] * n + k[2] * n * n) * x, k[0] * (1 + k[1] * n + k[2] * n * n) * y};
  }
  Real u = X / Z, v = Y / Z;
  if (is_fisheye(camera.model)) {
    const Real theta = std::acos(Z / std::sqrt(X * X + Y * Y + Z * Z));
    u = theta * X / r, v = theta * Y / r;
  }
  const Real n = u * u + v * v;
  Real du = 0, dv = 0;
  const auto radial = [&](Real factor) { du += u * factor, dv += v * factor; };
  const auto tangential = [&](Real p1, Real p2) {
    du += 2 * p1 * u * v + p2 * (n + 2 * u * u);
    dv += 2 * p2 * u * v + p1 * (n + 2 * v * v);
  };
  switch (camera.model) {
    case CameraModel::simple_radial:
    case CameraModel::simple_radial_fisheye:
      radial(k[3] * n);
      break;
    case CameraModel::radial:
    case CameraModel::radial_fisheye:
      radial(k[3] * n + k[4] * n * n);
      break;
    case CameraModel::opencv:
      radial(k[4] * n + k[5] * n * n);
      tangential(k[6], k[7]);
      break;
    case CameraModel::full_opencv:
      radial((1 + k[4] * n + k[5] * n * n + k[8] * n * n * n) /
                 (1 + k[9] * n + k[10] * n * n + k[11] * n * n * n) -
             1);
      tangential(k[6], k[7]);
      break;
    case CameraModel::opencv_fisheye:
      radial(k[4] * n + k[5] * n * n + k[6] * n * n * n + k[7] * n * n * n * n);
      break;
    case CameraModel::thin_prism_fisheye:
      radial(k[4] * n + k[5] * n * n + k[8] * n * n * n + k[9] * n * n * n * n);
      tangential(k[6], k[7]);
      du += k[10] * n, dv += k[11] * n;
      break;
    case CameraModel::fov: {
      const Real radius = std::atan(2 * std::tan(k[4] / 2) * r / Z) / k[4];
      du = radius * X / r - u, dv = radius * Y / r - v;
      break;
    }
    case CameraModel::eucm: {
      const Real h = k[4] * std::sqrt(k[5] * r * r + Z * Z) + (1 - k[4]) * Z;
      du = X / h - u, dv = Y / h - v;
      break;
    }
    default:
      break;
  }
  const ParameterRoles at = roles_of(camera.model);
  const auto of = [&](int i) { return k[static_cast<std::size_t>(i)]; };
  return {of(at.fx) * (u + du) + of(at.cx), of(at.fy) * (v + dv) + of(at.cy)};
}

/// A point that the model sees, at most `angle` from its axis.
std::array<double, 3> seen_point(CameraModel model, double angle, std::mt19937& random) {
  std::uniform_real_distribution<double> unit(0, 1);
  const double theta = angle * unit(random), phi = 2 * std::numbers::pi * unit(random);
  const double length = 0.5 + 4 * unit(random);
  const double side = model == CameraModel::bal ? -1 : 1;
  return {length * std::sin(theta) * std::cos(phi), length * std::sin(theta) * std::sin(phi),
          side * length * std::cos(theta)};
}

TEST(CameraModels, AreThePublishedFormulas) {
  std::mt19937 random(11);
  for (CameraModel model : kAll) {
    const Camera camera = ordinary(model);
    for (int i = 0; i < 200; ++i) {
      const auto P = seen_point(model, 1.3, random);
      const auto u = project(camera, P);
      const auto want = published(camera, P);
      EXPECT_TRUE(u.before) << to_string(model);
      for (std::size_t r = 0; r < 2; ++r)
        ASSERT_NEAR(u.pixel[r], static_cast<double>(want[r]),
                    1e-12 * (1 + std::abs(static_cast<double>(want[r]))))
            << to_string(model);
      // One body computes the value alone and with its Jacobian.
      if (model != CameraModel::bal) {
        EXPECT_EQ(u.pixel, project_with_jacobian(camera, P).pixel);
      }
    }
  }
}

struct Recorded {
  CameraModel model;
  std::array<double, 3> P;
  std::array<double, 2> pixel;
};

/// By COLMAP 4.2.1 with the parameters of `ordinary`.
const Recorded kRecorded[] = {
    {CameraModel::simple_pinhole, {0.3, -0.2, 1}, {470, 140}},
    {CameraModel::simple_pinhole, {-1.1, 0.7, 1.6}, {-23.75, 458.75}},
    {CameraModel::simple_pinhole, {0.02, 0.5, 0.4}, {345, 865}},
    {CameraModel::pinhole, {0.3, -0.2, 1}, {470, 138}},
    {CameraModel::pinhole, {-1.1, 0.7, 1.6}, {-23.75, 463.125}},
    {CameraModel::pinhole, {0.02, 0.5, 0.4}, {345, 877.5}},
    {CameraModel::simple_radial, {0.3, -0.2, 1}, {469.02499999999998, 140.64999999999998}},
    {CameraModel::simple_radial, {-1.1, 0.7, 1.6}, {-12.33642578125, 451.48681640625}},
    {CameraModel::simple_radial, {0.02, 0.5, 0.4}, {343.04374999999999, 816.09375}},
    {CameraModel::radial, {0.3, -0.2, 1}, {469.05034999999998, 140.63310000000001}},
    {CameraModel::radial, {-1.1, 0.7, 1.6}, {-13.852291107177734, 452.45145797729492}},
    {CameraModel::radial, {0.02, 0.5, 0.4}, {343.65605625000001, 831.40140625000004}},
    {CameraModel::opencv, {0.3, -0.2, 1}, {468.46535, 139.04356200000001}},
    {CameraModel::opencv, {-1.1, 0.7, 1.6}, {-16.867916107177734, 458.6886902618408}},
    {CameraModel::opencv, {0.02, 0.5, 0.4}, {341.42605624999999, 847.82198437500006}},
    {CameraModel::full_opencv, {0.3, -0.2, 1}, {467.93437920052668, 139.40462214364186}},
    {CameraModel::full_opencv, {-1.1, 0.7, 1.6}, {-12.645637537287257, 455.94804762647556}},
    {CameraModel::full_opencv, {0.02, 0.5, 0.4}, {340.96739046485175, 836.12600685371979}},
    {CameraModel::opencv_fisheye, {0.3, -0.2, 1}, {406.67674928017152, 180.28935049588185}},
    {CameraModel::opencv_fisheye, {-1.1, 0.7, 1.6}, {144.86014821612471, 355.16772071848766}},
    {CameraModel::opencv_fisheye, {0.02, 0.5, 0.4}, {330.94783170221854, 522.818985640645}},
    {CameraModel::simple_radial_fisheye, {0.3, -0.2, 1}, {406.17166124720853, 182.55222583519429}},
    {CameraModel::simple_radial_fisheye, {-1.1, 0.7, 1.6}, {148.55943155427082, 349.0985435563731}},
    {CameraModel::simple_radial_fisheye,
     {0.02, 0.5, 0.4},
     {330.57599091120818, 504.39977278020507}},
    {CameraModel::radial_fisheye, {0.3, -0.2, 1}, {406.57797732075647, 182.28134845282901}},
    {CameraModel::radial_fisheye, {-1.1, 0.7, 1.6}, {145.55000040050786, 351.01363610876774}},
    {CameraModel::radial_fisheye, {0.02, 0.5, 0.4}, {330.87985577238328, 511.99639430958132}},
    {CameraModel::thin_prism_fisheye, {0.3, -0.2, 1}, {406.38935293206464, 180.43783860907038}},
    {CameraModel::thin_prism_fisheye, {-1.1, 0.7, 1.6}, {143.72652868741631, 355.72870012524641}},
    {CameraModel::thin_prism_fisheye, {0.02, 0.5, 0.4}, {330.50186436400793, 523.75418197307567}},
    {CameraModel::fov, {0.3, -0.2, 1}, {412.96542629242282, 175.95715077633093}},
    {CameraModel::fov, {-1.1, 0.7, 1.6}, {132.44316847124421, 363.33282558103031}},
    {CameraModel::fov, {0.02, 0.5, 0.4}, {331.71821795516075, 542.72063050832003}},
    {CameraModel::eucm, {0.3, -0.2, 1}, {406.13077661609429, 180.66546499780168}},
    {CameraModel::eucm, {-1.1, 0.7, 1.6}, {148.8463179835598, 352.546512113841}},
    {CameraModel::eucm, {0.02, 0.5, 0.4}, {330.54627591392523, 512.44546110973533}},
};

TEST(CameraModels, AgreeWithAnotherImplementation) {
  for (const Recorded& record : kRecorded) {
    const auto u = project(ordinary(record.model), record.P).pixel;
    for (std::size_t r = 0; r < 2; ++r)
      EXPECT_NEAR(u[r], record.pixel[r], 1e-10) << to_string(record.model);
  }
}

constexpr int kVariables = 3 + static_cast<int>(kMaxCameraParameters);
using D = Dual<double, kVariables>;

/// The model's formula for the pixel, differentiated automatically.
std::array<D, 2> differentiate(const Camera& camera, const std::array<double, 3>& P) {
  std::array<D, kMaxCameraParameters> k;
  for (std::size_t i = 0; i < k.size(); ++i)
    k[i] = D::variable(camera.parameters[i], 3 + static_cast<int>(i));
  const std::array<D, 3> X{D::variable(P[0], 0), D::variable(P[1], 1), D::variable(P[2], 2)};
  return with_lens(camera.model, [&](auto lens) {
    LensJacobian<D> J;
    lens.project(k.data(), X.data(), J);
    return J.pixel;
  });
}

void expect_exact_jacobian(const Camera& camera, const std::array<double, 3>& P, double tolerance) {
  const LensJacobian<double> J = project_with_jacobian(camera, P);
  const auto want = differentiate(camera, P);
  const auto expect = [&](double got, double wanted, double scale) {
    EXPECT_NEAR(got, wanted, tolerance * (1 + scale))
        << to_string(camera.model) << " at " << P[0] << " " << P[1] << " " << P[2];
  };
  for (std::size_t r = 0; r < 2; ++r) {
    double scale = 0;
    for (std::size_t j = 0; j < 3; ++j) scale = std::max(scale, std::abs(want[r].d[j]));
    for (std::size_t j = 0; j < 3; ++j) expect(J.point[r][j], want[r].d[j], scale);
    for (std::size_t i = 0; i < parameter_count(camera.model); ++i)
      expect(J.parameters[r][i], want[r].d[3 + i], std::abs(want[r].d[3 + i]));
  }
}

TEST(CameraModels, JacobiansMatchAutomaticDifferentiation) {
  std::mt19937 random(12);
  for (CameraModel model : kAll)
    for (int i = 0; i < 200; ++i)
      expect_exact_jacobian(ordinary(model), seen_point(model, 1.3, random), 1e-10);
  // The FOV model on both sides of where its series begins, and with none of its distortion.
  for (double omega : {0.0, 1e-6, 0.99e-4, 1.01e-4, 1e-2, 1.5})
    for (int i = 0; i < 50; ++i)
      expect_exact_jacobian({CameraModel::fov, {300, 310, 320, 240, omega}},
                            seen_point(CameraModel::fov, 1.0, random), 1e-7);
}

TEST(CameraModels, JacobiansMatchCentralDifferences) {
  std::mt19937 random(13);
  for (CameraModel model : kAll) {
    const Camera camera = ordinary(model);
    const auto P = seen_point(model, 1.1, random);
    const LensJacobian<double> J = project_with_jacobian(camera, P);
    const double h = 1e-6;
    for (std::size_t j = 0; j < 3 + parameter_count(model); ++j) {
      const auto at = [&](double step) {
        Camera moved = camera;
        auto X = P;
        (j < 3 ? X[j] : moved.parameters[j - 3]) += step;
        return project(moved, X).pixel;
      };
      const auto plus = at(h), minus = at(-h);
      for (std::size_t r = 0; r < 2; ++r) {
        const double got = j < 3 ? J.point[r][j] : J.parameters[r][j - 3];
        EXPECT_NEAR(got, (plus[r] - minus[r]) / (2 * h), 1e-5 * (1 + std::abs(got)))
            << to_string(model) << " column " << j;
      }
    }
  }
}

TEST(CameraModels, FovIsContinuousWhereItsSeriesBegins) {
  std::mt19937 random(14);
  for (int i = 0; i < 50; ++i) {
    const auto P = seen_point(CameraModel::fov, 1.2, random);
    const auto below = project({CameraModel::fov, {300, 300, 0, 0, 1e-4 * (1 - 1e-12)}}, P).pixel;
    const auto above = project({CameraModel::fov, {300, 300, 0, 0, 1e-4 * (1 + 1e-12)}}, P).pixel;
    for (std::size_t r = 0; r < 2; ++r)
      EXPECT_NEAR(below[r], above[r], 1e-10 * (1 + std::abs(above[r])));
  }
}

bool all_finite(const LensJacobian<double>& J, std::size_t parameters) {
  bool finite = true;
  for (std::size_t r = 0; r < 2; ++r) {
    finite = finite && std::isfinite(J.pixel[r]);
    for (double x : J.point[r]) finite = finite && std::isfinite(x);
    for (std::size_t i = 0; i < parameters; ++i)
      finite = finite && std::isfinite(J.parameters[r][i]);
  }
  return finite;
}

/// All around, the axis and exactly 90 degrees included, no model but BAL's (whose formula is
/// kept as published) turns NaN or infinite.
TEST(CameraModels, NothingIsNotFiniteAtNinetyDegreesAndBeyond) {
  for (CameraModel model : kAll) {
    if (model == CameraModel::bal) continue;
    const Camera camera = ordinary(model);
    for (int degrees = 0; degrees <= 180; ++degrees) {
      const double theta = degrees * std::numbers::pi / 180;
      for (double phi : {0.0, 0.7, 2.0, std::numbers::pi / 2, std::numbers::pi, 5.0}) {
        std::array<double, 3> P{std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi),
                                std::cos(theta)};
        if (degrees == 90) P[2] = 0;
        if (degrees == 180) P[0] = P[1] = 0;
        const LensJacobian<double> J = project_with_jacobian(camera, P);
        ASSERT_TRUE(all_finite(J, parameter_count(model)))
            << to_string(model) << " at " << degrees << " degrees";
      }
    }
    ASSERT_TRUE(all_finite(project_with_jacobian(camera, {0, 0, 0}), parameter_count(model)));
  }
}

/// Wide models go on smoothly from 89 degrees to 91 and further, with exact Jacobians there.
TEST(CameraModels, WideLensesSeeBehindTheirImagePlane) {
  std::mt19937 random(15);
  for (CameraModel model : kAll) {
    const Camera camera = ordinary(model);
    const bool wide = is_fisheye(model) || model == CameraModel::fov || model == CameraModel::eucm;
    EXPECT_EQ(project(camera, {1, 0.2, -0.1}).before, wide || model == CameraModel::bal)
        << to_string(model);
    if (!wide) continue;
    double last = 0;
    for (int degrees = 80; degrees <= 100; ++degrees) {
      const double theta = degrees * std::numbers::pi / 180;
      const std::array<double, 3> P{std::sin(theta), 0, std::cos(theta)};
      const double x = project(camera, P).pixel[0];
      if (degrees > 80) {
        EXPECT_LT(std::abs(x - last), 25) << to_string(model);  // px a degree
      }
      last = x;
      expect_exact_jacobian(camera, P, 1e-10);
    }
    EXPECT_FALSE(project(camera, {0, 0, -1}).before) << to_string(model);
  }
  // 200 degrees in all: 100 from the axis.
  const double theta = 100 * std::numbers::pi / 180;
  EXPECT_TRUE(project(ordinary(CameraModel::eucm), {std::sin(theta), 0, std::cos(theta)}).before);
  EXPECT_FALSE(project(ordinary(CameraModel::eucm), {0.1, 0, -1}).before);
}

/// The centre of a pixel: a point on the axis falls on the principal point, and (0.5, 0.5) is the
/// centre of the first pixel of an image whose principal point is the middle of its area.
TEST(CameraModels, PixelsCountFromTheCornerOfTheFirstOne) {
  for (CameraModel model : kAll) {
    if (model == CameraModel::bal) continue;
    const auto u = project(ordinary(model), {0, 0, 2}).pixel;
    EXPECT_EQ(u[0], 320) << to_string(model);
    EXPECT_EQ(u[1], 240) << to_string(model);
  }
  const Camera wide{CameraModel::simple_pinhole, {1, 2, 1}, 4, 2};  // 4 x 2 pixels
  const auto first = project(wide, {-1.5, -0.5, 1}).pixel;
  EXPECT_EQ(first[0], 0.5);
  EXPECT_EQ(first[1], 0.5);
  // BAL: right of the axis is +x and up is +y, the camera looks along -z.
  const auto bal = project(ordinary(CameraModel::bal), {0.1, 0.2, -1}).pixel;
  EXPECT_GT(bal[0], 0);
  EXPECT_GT(bal[1], 0);
}

TEST(CameraModels, HaveNamesThatLeadBack) {
  for (CameraModel model : kAll) {
    EXPECT_EQ(camera_model_named(to_string(model)), model);
    EXPECT_EQ(parameter_names(model).size(), parameter_count(model));
    if (model != CameraModel::bal) {
      EXPECT_EQ(camera_model_of_colmap(colmap_id(model)), model);
    }
  }
  EXPECT_FALSE(camera_model_named("NO_SUCH_CAMERA").has_value());
  EXPECT_FALSE(camera_model_of_colmap(-1).has_value());
  EXPECT_FALSE(camera_model_of_colmap(99).has_value());
}

TEST(CameraModels, WorkInFloat) {
  std::mt19937 random(16);
  for (CameraModel model : kAll) {
    const Camera camera = ordinary(model);
    std::array<float, 12> k;
    for (std::size_t i = 0; i < 12; ++i) k[i] = static_cast<float>(camera.parameters[i]);
    for (int i = 0; i < 50; ++i) {
      const auto P = seen_point(model, 1.0, random);
      const std::array<float, 3> X{static_cast<float>(P[0]), static_cast<float>(P[1]),
                                   static_cast<float>(P[2])};
      const auto want = project(camera, P).pixel;
      with_lens(model, [&](auto lens) {
        LensJacobian<float> J;
        lens.project(k.data(), X.data(), J);
        for (std::size_t r = 0; r < 2; ++r)
          EXPECT_NEAR(J.pixel[r], want[r], 3e-6 * (500 + std::abs(want[r]))) << to_string(model);
      });
    }
  }
}

}  // namespace
}  // namespace sheaf
