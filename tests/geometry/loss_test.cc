// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/loss.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "geometry/dual.h"

namespace sheaf {
namespace {

using D = test::Dual<double, 1>;

constexpr LossKind kLosses[] = {LossKind::none,   LossKind::huber, LossKind::soft_l1,
                                LossKind::cauchy, LossKind::tukey, LossKind::geman_mcclure};

/// The textbook's formula as it stands, in long double.
long double formula(LossKind kind, long double c, long double s) {
  const long double z = s / (c * c);
  switch (kind) {
    case LossKind::none:
      return s;
    case LossKind::huber:
      return std::sqrt(s) <= c ? s : 2 * c * std::sqrt(s) - c * c;
    case LossKind::soft_l1:
      return 2 * c * c * (std::sqrt(1 + z) - 1);
    case LossKind::cauchy:
      return c * c * std::log(1 + z);
    case LossKind::tukey:
      return z <= 1 ? c * c / 3 * (1 - std::pow(1 - z, 3)) : c * c / 3;
    case LossKind::geman_mcclure:
      return s / (1 + z);
  }
  return 0;
}

TEST(Loss, ValuesAreTheFormulas) {
  for (LossKind kind : kLosses)
    for (double c : {0.1, 1.0, 3.7, 250.0})
      for (double r : {1e-3, 0.2, 0.999, 1.001, 2.5, 80.0, 1e4}) {
        const double s = r * r * c * c;
        const double value = evaluate_loss<double>({kind, c}, s).value;
        EXPECT_NEAR(value, static_cast<double>(formula(kind, c, s)), 1e-12 * s)
            << to_string(kind) << ", " << c << ", " << s;
      }
}

TEST(Loss, DerivativesMatchAutomaticDifferentiation) {
  for (LossKind kind : kLosses)
    for (double c : {0.1, 1.0, 3.7, 250.0})
      for (double r : {0.0, 1e-6, 0.2, 0.999, 1.001, 2.5, 80.0}) {
        SCOPED_TRACE(testing::Message() << to_string(kind) << ", c " << c << ", |r| / c " << r);
        const double s = r * r * c * c;
        const auto dual = evaluate_loss<D>({kind, c}, D::variable(s, 0));
        const auto plain = evaluate_loss<double>({kind, c}, s);
        EXPECT_NEAR(plain.first, dual.value.d[0], 1e-14);
        EXPECT_NEAR(plain.second, dual.first.d[0], 1e-13 / (c * c));
      }
}

TEST(Loss, SmallResidualsCountAsTheyAreAndNoneCountsMore) {
  for (LossKind kind : kLosses) {
    double last = 0, last_slope = 1;
    for (double s = 1e-12; s < 1e6; s *= 1.1) {
      const auto rho = evaluate_loss<double>({kind, 2.0}, s);
      EXPECT_LE(rho.value, s);
      EXPECT_GE(rho.value, last);
      EXPECT_GE(rho.first, 0);
      EXPECT_LE(rho.first, last_slope);  // concave in s
      EXPECT_LE(rho.second, 0);
      EXPECT_GE(rho.value, rho.first * s * (1 - 1e-15)) << "by concavity from rho(0) = 0";
      if (s < 1e-6) {
        EXPECT_NEAR(rho.value, s, 1e-6 * s);
      }
      last = rho.value;
      last_slope = rho.first;
    }
  }
}

TEST(Loss, ConvexOnesAreConvexInTheResidual) {
  for (LossKind kind : kLosses) {
    bool convex = true;
    // d^2/dx^2 of rho(x^2) = 2 rho' + 4 s rho''
    for (double s = 1e-6; s < 1e6; s *= 1.1) {
      const auto rho = evaluate_loss<double>({kind, 2.0}, s);
      convex = convex && 2 * rho.first + 4 * s * rho.second >= -1e-12;
    }
    EXPECT_EQ(is_convex(kind), convex) << to_string(kind);
  }
}

double integral(const std::function<double(double)>& f, double from, double to) {
  constexpr int kSteps = 4000;  // Simpson's
  const double h = (to - from) / kSteps;
  double sum = f(from) + f(to);
  for (int i = 1; i < kSteps; ++i) sum += (i % 2 == 0 ? 2 : 4) * f(from + i * h);
  return sum * h / 3;
}

/// Of an M-estimator on the norm d of residuals with `dimension` standard normal components.
double efficiency(LossKind kind, double c, int dimension) {
  const auto mean = [&](const std::function<double(double)>& f) {
    const auto weighted = [&](double d) {
      const double density =
          dimension == 2 ? d * std::exp(-d * d / 2) : std::sqrt(2 / M_PI) * std::exp(-d * d / 2);
      return f(d) * density;
    };
    return integral(weighted, 0, std::min(c, 12.0)) + integral(weighted, std::min(c, 12.0), 12);
  };
  const auto slope = [&](double d) { return evaluate_loss<double>({kind, c}, d * d).first; };
  const double a = mean([&](double d) { return d * d * slope(d); }) / dimension;
  const double b = mean([&](double d) { return d * d * slope(d) * slope(d); }) / dimension;
  return a * a / b;
}

TEST(Loss, TuningConstantsKeep95PercentOfTheEfficiency) {
  for (LossKind kind : kLosses)
    if (kind != LossKind::none) {
      EXPECT_NEAR(efficiency(kind, tuning_constant(kind), 2), 0.95, 1e-9) << to_string(kind);
    }
  // The same integrals give the well-known constants for one component.
  EXPECT_NEAR(efficiency(LossKind::huber, 1.345, 1), 0.95, 1e-5);
  EXPECT_NEAR(efficiency(LossKind::cauchy, 2.3849, 1), 0.95, 1e-5);
  EXPECT_NEAR(efficiency(LossKind::tukey, 4.6851, 1), 0.95, 1e-5);
}

}  // namespace
}  // namespace sheaf
