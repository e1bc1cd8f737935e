// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "report/alignment.h"
#include "sheaf/survey.h"

namespace sheaf {

/// A place of the model whose coordinates in the survey's local frame were measured.
struct SurveyTie {
  std::string name;
  Vector3<double> from{};  ///< in the model
  Vector3<double>
      lever_arm{};       ///< from there to what was measured: the model's axes, survey's unit
  Vector3<double> to{};  ///< in the local frame
  Covariance3 covariance = kUnitCovariance3;
};

/// A tie is an outlier beyond this many sigmas, times how far the ties stray in the median where
/// that is more than their sigmas say.
inline constexpr double kOutlierSigmas = 5;

struct SurveyMotion {
  Similarity similarity;
  double threshold_sigmas = kOutlierSigmas;
  std::vector<SurveyOutlier> outliers;  ///< worst first
};

/// The Sim(3), or the rigid motion, that takes a model to its measured places: the robust one, then
/// weighed by the ties' sigmas under a Cauchy loss whose scale follows their median.
SurveyMotion motion_of(const std::vector<SurveyTie>& ties, bool rigid);

/// Whether measured places lie in a line, or so near to one that it is not known to half a radian
/// how the model is turned about it.
bool in_a_line(const std::vector<SurveyTie>& ties);

/// Median of sqrt(e^T C^-1 e) after a motion.
double median_sigmas(const std::vector<SurveyTie>& ties, const Similarity& motion);

}  // namespace sheaf
