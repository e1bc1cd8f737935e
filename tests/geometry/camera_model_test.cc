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
#include "geometry/recorded_pixels.h"

namespace sheaf {
namespace {

using test::Dual;
using test::ordinary;
using Real = long double;

std::vector<CameraModel> every_model() {
  std::vector<CameraModel> out;
  for (std::size_t m = 0; m < kCameraModels; ++m) out.push_back(static_cast<CameraModel>(m));
  return out;
}

const std::vector<CameraModel> kAll = every_model();

bool is_fisheye(CameraModel model) {
  return model == CameraModel::opencv_fisheye || model == CameraModel::simple_radial_fisheye ||
         model == CameraModel::radial_fisheye || model == CameraModel::thin_prism_fisheye ||
         model == CameraModel::rad_tan_thin_prism_fisheye || model == CameraModel::simple_fisheye ||
         model == CameraModel::fisheye;
}

/// Whether the model sees behind its image plane, with its ordinary parameters.
bool is_wide(CameraModel model) {
  return is_fisheye(model) || model == CameraModel::fov || model == CameraModel::eucm ||
         model == CameraModel::simple_division || model == CameraModel::division ||
         model == CameraModel::equirectangular || model == CameraModel::double_sphere ||
         model == CameraModel::ucm;
}

/// The published formulas once more, in the form "u plus what distortion adds to it", in long
/// double and with the angle by acos.
std::array<Real, 2> published(const Camera& camera, const std::array<double, 3>& P) {
  std::array<Real, kMaxCameraParameters> k;
  for (std::size_t i = 0; i < k.size(); ++i) k[i] = camera.parameters[i];
  const Real X = P[0], Y = P[1], Z = P[2], r = std::sqrt(X * X + Y * Y);
  if (camera.model == CameraModel::bal) {
    const Real x = -X / Z, y = -Y / Z, n = x * x + y * y;
    return {k[0] * (1 + k[1] * n + k[2] * n * n) * x, k[0] * (1 + k[1] * n + k[2] * n * n) * y};
  }
  if (camera.model == CameraModel::equirectangular) {
    constexpr Real kPi = std::numbers::pi_v<Real>;
    const Real flat = std::sqrt(X * X + Z * Z), turn = std::acos(Z / flat);
    const Real rise = std::asin(Y / std::sqrt(X * X + Y * Y + Z * Z));
    return {k[0] * ((X < 0 ? -turn : turn) / (2 * kPi) + 0.5L), k[1] * (rise / kPi + 0.5L)};
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
    case CameraModel::ucm: {  // as MEI's model states it, with xi
      const Real xi = k[4] / (1 - k[4]), h = (Z + xi * std::sqrt(r * r + Z * Z)) / (1 + xi);
      du = X / h - u, dv = Y / h - v;
      break;
    }
    case CameraModel::double_sphere: {
      const Real d1 = std::sqrt(r * r + Z * Z), e = k[4] * d1 + Z;
      const Real h = k[5] * std::sqrt(r * r + e * e) + (1 - k[5]) * e;
      du = X / h - u, dv = Y / h - v;
      break;
    }
    case CameraModel::radial_k3:
      radial(k[3] * n + k[4] * n * n + k[5] * n * n * n);
      break;
    case CameraModel::simple_division:
    case CameraModel::division: {
      // The distorted radius s has s / (1 + l s^2) = r / Z.
      const Real l = k[camera.model == CameraModel::division ? 4 : 3];
      const Real s = (Z - std::sqrt(Z * Z - 4 * l * r * r)) / (2 * l * r);
      du = s * X / r - u, dv = s * Y / r - v;
      break;
    }
    case CameraModel::rad_tan_thin_prism_fisheye: {
      Real factor = 1, power = 1;
      for (std::size_t i = 4; i < 10; ++i) factor += k[i] * (power *= n);
      const Real x = factor * u, y = factor * v, q = x * x + y * y;
      du = x + 2 * k[11] * x * y + k[10] * (q + 2 * x * x) + k[12] * q + k[13] * q * q - u;
      dv = y + 2 * k[10] * x * y + k[11] * (q + 2 * y * y) + k[14] * q + k[15] * q * q - v;
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

TEST(CameraModels, AgreeWithAnotherImplementation) {
  for (const test::RecordedPixel& record : test::kRecordedPixels) {
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

/// Parameters of the division models and of unified ones on both sides of where they turn into
/// others, and without distortion.
TEST(CameraModels, JacobiansAreExactWithoutDistortionAndWithTheOtherSign) {
  std::mt19937 random(17);
  for (int i = 0; i < 50; ++i) {
    for (double k : {-0.3, -1e-9, 0.0, 1e-9, 0.02})
      expect_exact_jacobian({CameraModel::division, {300, 310, 320, 240, k}},
                            seen_point(CameraModel::division, 1.1, random), 1e-9);
    for (double alpha : {0.0, 0.3, 0.5, 0.8}) {
      expect_exact_jacobian({CameraModel::ucm, {300, 310, 320, 240, alpha}},
                            seen_point(CameraModel::ucm, 1.1, random), 1e-10);
      for (double xi : {-0.4, 0.0, 0.3})
        expect_exact_jacobian({CameraModel::double_sphere, {300, 310, 320, 240, xi, alpha}},
                              seen_point(CameraModel::double_sphere, 1.0, random), 1e-10);
    }
  }
}

/// With k >= 0 pixels end where Z = 2 sqrt(k) r: beyond is not seen, and finite.
TEST(CameraModels, DivisionSeesUpToWhereItsPixelsEnd) {
  const Camera lens{CameraModel::simple_division, {500, 0, 0, 0.25}};  // Z = r
  EXPECT_TRUE(sees(lens, {0.999, 0, 1}));
  EXPECT_NEAR(project(lens, {1 - 1e-12, 0, 1}).pixel[0], 1000, 1e-2);
  for (const std::array<double, 3>& P :
       {std::array{1.001, 0.0, 1.0}, {0.1, 0.0, -1.0}, {1.0, 0.0, 0.0}, {0.0, 0.0, -1.0}}) {
    EXPECT_FALSE(sees(lens, P));
    EXPECT_TRUE(all_finite(project_with_jacobian(lens, P), 4));
    EXPECT_FALSE(sees({CameraModel::simple_division, {500, 0, 0, 0}}, P) && P[2] <= 0);
  }
  // The formula is the perspective one, behind the camera too, as k vanishes from above.
  const Camera plain{CameraModel::simple_division, {500, 0, 0, 0}};
  EXPECT_DOUBLE_EQ(project(plain, {0.3, 0.1, -2}).pixel[0], -75);
  // From below the rays go on behind the plane, to all directions but one.
  const Camera wide{CameraModel::simple_division, {500, 0, 0, -0.25}};
  EXPECT_TRUE(sees(wide, {0.001, 0, -1}));
  EXPECT_FALSE(sees(wide, {0, 0, -1}));
  EXPECT_NEAR(project(wide, {1, 0, 0}).pixel[0], 1000, 1e-9);
}

TEST(CameraModels, PanoramasJoinAtTheirBorders) {
  const Camera panorama = ordinary(CameraModel::equirectangular);
  const std::array<double, 2> left = project(panorama, {-1e-3, 0.1, -1}).pixel;
  const std::array<double, 2> right = project(panorama, {1e-3, 0.1, -1}).pixel;
  EXPECT_LT(left[0], 1);
  EXPECT_GT(right[0], 639);
  const auto e = residual(panorama, left, right.data());
  EXPECT_NEAR(e[0], 640e-3 / std::numbers::pi, 1e-6);
  EXPECT_EQ(e[1], 0);
  const double far[2] = {right[0] - 3 * 640, right[1]};
  EXPECT_NEAR(residual(panorama, right, far)[0], 0, 1e-12);
  const Camera pinhole = ordinary(CameraModel::pinhole);
  EXPECT_EQ(residual(pinhole, {1000, 0}, far)[0], 1000 - far[0]);
  // There is no behind.
  EXPECT_TRUE(sees(panorama, {0, 0, -1}));
  EXPECT_TRUE(sees(panorama, {0, 1, 0}));
  EXPECT_FALSE(sees(panorama, {0, 0, 0}));
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
    EXPECT_EQ(project(camera, {1, 0.2, -0.1}).before, is_wide(model) || model == CameraModel::bal)
        << to_string(model);
    if (!is_wide(model)) continue;
    // Division models stretch their borders far.
    const bool stretches = parameter_names(model).back() == "k" && !is_fisheye(model);
    double last = 0;
    for (int degrees = 80; degrees <= 100; ++degrees) {
      const double theta = degrees * std::numbers::pi / 180;
      const std::array<double, 3> P{std::sin(theta), 0, std::cos(theta)};
      const double x = project(camera, P).pixel[0];
      if (degrees > 80) {
        EXPECT_LT(std::abs(x - last), stretches ? 100 : 25) << to_string(model);  // px a degree
      }
      last = x;
      expect_exact_jacobian(camera, P, 1e-10);
    }
    EXPECT_EQ(project(camera, {0, 0, -1}).before, model == CameraModel::equirectangular)
        << to_string(model);
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
    if (const int id = colmap_id(model); id >= 0) {
      EXPECT_EQ(camera_model_of_colmap(id), model);
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
    std::array<float, kMaxCameraParameters> k;
    for (std::size_t i = 0; i < k.size(); ++i) k[i] = static_cast<float>(camera.parameters[i]);
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
