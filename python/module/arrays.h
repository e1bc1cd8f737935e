// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nanobind/nanobind.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "sheaf/problem.h"

namespace sheaf {

namespace nb = nanobind;

/// Numbers of an array (or of nested sequences) of float64 or integers, of any strides, row by row:
/// n x columns of them, or n where columns is 1. Copied once. Throws TypeError for other types,
/// float32 among them, naming the conversion to write; Error (usage) for another shape.
std::vector<double> reals_from(nb::handle array, const char* name, std::size_t columns);

/// Likewise of integers of any type. Throws Error (usage) for one that is not within 0 and 2^32 - 1
/// or, with a least of -1, for which -1 stands for 2^32 - 1.
std::vector<std::uint32_t> indices_from(nb::handle array, const char* name, int least = 0);

/// n x 7: qw qx qy qz tx ty tz.
std::vector<Pose> poses_from(nb::handle array, const char* name);

/// True or False, or 0 or 1, one for each.
std::vector<std::uint8_t> flags_from(nb::handle array, const char* name);

/// An array of NumPy that owns a copy.
nb::object array_of(const std::vector<double>& numbers, const std::vector<std::size_t>& shape);
nb::object array_of(const double* numbers, const std::vector<std::size_t>& shape);
nb::object array_of(const std::vector<std::uint64_t>& numbers);
nb::object array_of(const std::vector<std::uint32_t>& numbers);

/// "float32", "a str": what a message calls a value of Python.
std::string type_of(nb::handle value);

}  // namespace sheaf
