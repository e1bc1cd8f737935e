// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "survey/textbook_covariance.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <functional>

namespace sheaf::test {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;
using Image = TextbookSurvey::Image;

constexpr Index kImage = 6, kLens = 4;

Image moved(const Image& image, const VectorXd& by) {
  const Vector3d turn = by.head<3>();
  const double angle = turn.norm();
  Image out = image;
  if (angle > 0) out.rotation = Eigen::AngleAxisd(angle, turn / angle) * image.rotation;
  out.centre += by.segment<3>(3);
  return out;
}

/// Central differences of a function of `columns` small numbers.
MatrixXd derivatives(Index columns, const std::function<VectorXd(const VectorXd&)>& f,
                     const VectorXd& steps) {
  MatrixXd out;
  for (Index k = 0; k < columns; ++k) {
    VectorXd x = VectorXd::Zero(columns);
    x[k] = steps[k];
    const VectorXd up = f(x);
    x[k] = -steps[k];
    const VectorXd down = f(x);
    if (k == 0) out.resize(up.size(), columns);
    out.col(k) = (up - down) / (2 * steps[k]);
  }
  return out;
}

/// Of a sight's pixel by its image, the lens and the point.
MatrixXd sight_derivatives(const TextbookSurvey& s, std::size_t image, const Vector3d& X) {
  VectorXd steps(kImage + kLens + 3);
  steps << VectorXd::Constant(3, 1e-5), VectorXd::Constant(3, 1e-4), 1e-2, 1e-2, 1e-2, 1e-4,
      VectorXd::Constant(3, 1e-4);
  return derivatives(
      steps.size(),
      [&](const VectorXd& x) -> VectorXd {
        return pixel_of(moved(s.images[image], x), s.lens + x.segment<4>(kImage), X + x.tail<3>());
      },
      steps);
}

Index column_of_image(std::size_t image) { return kImage * static_cast<Index>(image); }
Index column_of_lens(const TextbookSurvey& s) { return column_of_image(s.images.size()); }
Index column_of_kept(const TextbookSurvey& s, std::size_t point) {
  return column_of_lens(s) + kLens + 3 * static_cast<Index>(point - s.eliminated);
}

/// Rows by columns that stand anywhere in the normal matrix.
struct Rows {
  std::vector<Index> columns;
  MatrixXd J;
};
void append(std::vector<Index>& columns, Index first, Index count) {
  for (Index k = 0; k < count; ++k) columns.push_back(first + k);
}

void add(const Rows& rows, MatrixXd& N) {
  const MatrixXd square = rows.J.transpose() * rows.J;
  for (std::size_t r = 0; r < rows.columns.size(); ++r)
    for (std::size_t c = 0; c < rows.columns.size(); ++c)
      N(rows.columns[r], rows.columns[c]) += square(static_cast<Index>(r), static_cast<Index>(c));
}

/// All sights of a point that is eliminated: what is left of them for images and lens.
void add_eliminated(const TextbookSurvey& s, std::size_t point,
                    const std::vector<TextbookSurvey::Sight>& sights, MatrixXd& N) {
  const auto n = static_cast<Index>(sights.size());
  Rows rows;
  rows.J = MatrixXd::Zero(2 * n, kImage * n + kLens);
  MatrixXd by_point(2 * n, 3);
  for (Index i = 0; i < n; ++i) {
    const auto& sight = sights[static_cast<std::size_t>(i)];
    const MatrixXd J = sight_derivatives(s, sight.image, s.points[point]) / sight.sigma_px;
    append(rows.columns, column_of_image(sight.image), kImage);
    rows.J.block(2 * i, kImage * i, 2, kImage) = J.leftCols(kImage);
    rows.J.block(2 * i, kImage * n, 2, kLens) = J.middleCols(kImage, kLens);
    by_point.middleRows(2 * i, 2) = J.rightCols(3);
  }
  append(rows.columns, column_of_lens(s), kLens);
  const Matrix3d V = by_point.transpose() * by_point;
  rows.J -= by_point * V.inverse() * (by_point.transpose() * rows.J);
  add(rows, N);
}

void add_sights(const TextbookSurvey& s, MatrixXd& N) {
  std::vector<std::vector<TextbookSurvey::Sight>> of_point(s.points.size());
  for (const auto& sight : s.sights) of_point[sight.point].push_back(sight);
  for (std::size_t point = 0; point < s.points.size(); ++point) {
    if (point < s.eliminated) {
      add_eliminated(s, point, of_point[point], N);
      continue;
    }
    for (const auto& sight : of_point[point]) {
      Rows rows{{}, sight_derivatives(s, sight.image, s.points[point]) / sight.sigma_px};
      append(rows.columns, column_of_image(sight.image), kImage);
      append(rows.columns, column_of_lens(s), kLens);
      append(rows.columns, column_of_kept(s, point), 3);
      add(rows, N);
    }
  }
}

void add_terms(const TextbookSurvey& s, MatrixXd& N) {
  for (const auto& p : s.positions) {
    const VectorXd steps = VectorXd::Constant(kImage, 1e-5);
    const auto antenna = [&](const VectorXd& x) -> VectorXd {
      const Image at = moved(s.images[p.image], x);
      return at.centre + at.rotation.transpose() * p.lever_arm;
    };
    Rows rows{{}, derivatives(kImage, antenna, steps) / p.sigma};
    append(rows.columns, column_of_image(p.image), kImage);
    add(rows, N);
  }
  for (const auto& c : s.coordinates) {
    Rows rows{{}, Matrix3d::Identity() / c.sigma};
    append(rows.columns, column_of_kept(s, c.point), 3);
    add(rows, N);
  }
  for (const auto& d : s.distances) {
    const Vector3d along = (s.points[d.first] - s.points[d.second]).normalized() / d.sigma;
    Rows rows{{}, MatrixXd(1, 6)};
    rows.J << along.transpose(), -along.transpose();
    append(rows.columns, column_of_kept(s, d.first), 3);
    append(rows.columns, column_of_kept(s, d.second), 3);
    add(rows, N);
  }
}

}  // namespace

Vector2d pixel_of(const Image& image, const Eigen::Vector4d& lens, const Vector3d& X) {
  const Vector3d P = image.rotation * (X - image.centre);
  const Vector2d u = P.head<2>() / P[2];
  return lens[0] * (1 + lens[3] * u.squaredNorm()) * u + lens.segment<2>(1);
}

TextbookCovariance::TextbookCovariance(const TextbookSurvey& survey) : survey_(survey) {
  const Index n = column_of_kept(survey, survey.points.size());
  MatrixXd N = MatrixXd::Zero(n, n);
  add_sights(survey, N);
  add_terms(survey, N);
  covariance_ = N.llt().solve(MatrixXd::Identity(n, n));
}

Matrix3d TextbookCovariance::of_centre(std::size_t image) const {
  const Index at = column_of_image(image) + 3;
  return covariance_.block<3, 3>(at, at);
}

Matrix3d TextbookCovariance::of_triangulated(
    const Vector3d& X, const std::vector<TextbookSurvey::Sight>& sights) const {
  const auto n = static_cast<Index>(sights.size());
  MatrixXd by_point(2 * n, 3), by_others = MatrixXd::Zero(2 * n, covariance_.rows());
  VectorXd variances(2 * n);
  for (Index i = 0; i < n; ++i) {
    const auto& sight = sights[static_cast<std::size_t>(i)];
    const MatrixXd J = sight_derivatives(survey_, sight.image, X);
    by_others.block(2 * i, column_of_image(sight.image), 2, kImage) = J.leftCols(kImage);
    by_others.block(2 * i, column_of_lens(survey_), 2, kLens) = J.middleCols(kImage, kLens);
    by_point.middleRows(2 * i, 2) = J.rightCols(3);
    variances.segment<2>(2 * i).setConstant(sight.sigma_px * sight.sigma_px);
  }
  // X moves by -G times the errors of the sights' residuals.
  const Matrix3d V = by_point.transpose() * by_point;
  const MatrixXd G = V.inverse() * by_point.transpose();
  const MatrixXd errors = by_others * covariance_ * by_others.transpose();
  return G * (errors + MatrixXd(variances.asDiagonal())) * G.transpose();
}

}  // namespace sheaf::test
