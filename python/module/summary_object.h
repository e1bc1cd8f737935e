// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nanobind/nanobind.h>

#include "sheaf/solve.h"

namespace sheaf {

namespace nb = nanobind;

/// The fields of a Summary by their names: enumerators as texts, lists as arrays, iterations as an
/// array of records.
nb::dict fields_of(const Summary& summary);

}  // namespace sheaf
