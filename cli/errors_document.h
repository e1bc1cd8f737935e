// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "json_document.h"
#include "report/errors.h"

namespace sheaf {

/// mean, median, rms, max.
Json error_json(const ErrorStatistics& errors);

/// aligned, scale, rotation_error_rad, translation_error, center_error, point_error.
Json errors_json(const StateErrors& errors);

/// One line for each common image, by its number in the reference: its errors. Needs no locale,
/// every digit of the double.
std::string errors_csv(const ErrorLists& lists);

/// "Mean rot error" and "Mean trans error", then a table of all.
std::string errors_text(const ErrorLists& lists);

}  // namespace sheaf
