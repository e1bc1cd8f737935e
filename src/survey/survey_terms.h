// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "sheaf/survey.h"
#include "survey/image_names.h"

namespace sheaf {

/// What a survey knows of images and lenses, as terms in its local frame; what names an image that
/// the problem lacks is put among the survey's unused. Errors: unreadable_input with file and line
/// for parameters that a lens does not have, and for points of the model that are named twice.
Result<Terms> survey_terms(const Problem& problem, Survey& survey, const ImageNames& names);

/// Of the coordinates of a point, from its sigmas.
Covariance3 covariance_of(const SurveyPoint& point);

}  // namespace sheaf
