// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "arrays.h"

#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>

#include <algorithm>
#include <cstring>
#include <utility>

#include "sheaf/error.h"

namespace sheaf {
namespace {

static_assert(sizeof(Pose) == 7 * sizeof(double), "a pose is seven numbers");

using AnyArray = nb::ndarray<nb::ro, nb::device::cpu>;

/// An array of what is a list or an array; NumPy chooses the type of a list.
nb::object as_array(nb::handle given) {
  static const auto is_array = [](nb::handle h) {
    return nb::isinstance(h, nb::module_::import_("numpy").attr("ndarray"));
  };
  if (is_array(given)) return nb::borrow(given);
  return nb::module_::import_("numpy").attr("asarray")(given);
}

std::string dtype_of(nb::handle array) {
  return nb::cast<std::string>(nb::str(nb::object(array.attr("dtype"))));
}

std::string shape_of(nb::handle array) {
  return nb::cast<std::string>(nb::str(nb::object(array.attr("shape"))));
}

char kind_of(nb::handle array) {
  return nb::cast<std::string>(array.attr("dtype").attr("kind"))[0];
}

[[noreturn]] void refuse_type(nb::handle array, const char* name, const std::string& expected,
                              const std::string& conversion) {
  const std::string text = std::string(name) + ": found an array of " + dtype_of(array) +
                           ", expected " + expected + ": write " + name + ".astype(" + conversion +
                           ")";
  throw nb::type_error(text.c_str());
}

void check_shape(nb::handle array, const char* name, std::size_t columns) {
  const std::size_t dimensions = nb::cast<std::size_t>(array.attr("ndim"));
  const bool fits =
      columns == 1
          ? dimensions == 1
          : dimensions == 2 && nb::cast<std::size_t>(nb::object(array.attr("shape")[1])) == columns;
  if (fits) return;
  throw Error(ErrorCode::usage, std::string(name) + ": found the shape " + shape_of(array) +
                                    ", expected (n" +
                                    (columns == 1 ? ",)" : ", " + std::to_string(columns) + ")"));
}

/// Row by row, whatever the strides.
template <class From, class Put>
void each_number(const AnyArray& array, const Put& put) {
  const auto* data = static_cast<const From*>(array.data());
  const std::size_t rows = array.shape(0), columns = array.ndim() > 1 ? array.shape(1) : 1;
  const std::int64_t down = array.stride(0), right = array.ndim() > 1 ? array.stride(1) : 1;
  for (std::size_t i = 0; i < rows; ++i)
    for (std::size_t j = 0; j < columns; ++j)
      put(i * columns + j,
          data[static_cast<std::int64_t>(i) * down + static_cast<std::int64_t>(j) * right]);
}

/// Calls each_number with the array's own type of integers.
template <class Put>
void each_integer(const AnyArray& array, const Put& put) {
  const bool is_signed =
      array.dtype().code == static_cast<std::uint8_t>(nb::dlpack::dtype_code::Int);
  switch (array.dtype().bits) {
    case 8:
      return is_signed ? each_number<std::int8_t>(array, put)
                       : each_number<std::uint8_t>(array, put);
    case 16:
      return is_signed ? each_number<std::int16_t>(array, put)
                       : each_number<std::uint16_t>(array, put);
    case 32:
      return is_signed ? each_number<std::int32_t>(array, put)
                       : each_number<std::uint32_t>(array, put);
    default:
      return is_signed ? each_number<std::int64_t>(array, put)
                       : each_number<std::uint64_t>(array, put);
  }
}

/// Arrays in the other byte order, which the exchange of arrays does not know, in this machine's.
nb::object in_native_order(nb::object array) {
  if (nb::cast<bool>(array.attr("dtype").attr("isnative"))) return array;
  return array.attr("astype")(array.attr("dtype").attr("newbyteorder")("="));
}

nb::object empty_as(nb::object array, const char* type) {
  return nb::cast<std::size_t>(array.attr("size")) == 0 && kind_of(array) == 'f'
             ? nb::object(array.attr("astype")(type))
             : array;
}

}  // namespace

std::string type_of(nb::handle value) {
  return nb::cast<std::string>(nb::str(value.type().attr("__name__")));
}

std::vector<double> reals_from(nb::handle given, const char* name, std::size_t columns) {
  nb::object array = in_native_order(as_array(given));
  const char kind = kind_of(array);
  const bool is_double = kind == 'f' && nb::cast<int>(array.attr("dtype").attr("itemsize")) == 8;
  if (!is_double && kind != 'i' && kind != 'u')
    refuse_type(array, name, "float64", "numpy.float64");
  if (nb::cast<std::size_t>(array.attr("size")) == 0) {
    if (nb::cast<std::size_t>(array.attr("ndim")) > 1) check_shape(array, name, columns);
    return {};
  }
  check_shape(array, name, columns);
  const auto numbers = nb::cast<AnyArray>(array);
  std::vector<double> out;
  const nb::gil_scoped_release released;
  if (is_double) {
    const bool whole =
        numbers.stride(numbers.ndim() - 1) == 1 &&
        (numbers.ndim() == 1 || numbers.stride(0) == static_cast<std::int64_t>(numbers.shape(1)));
    const auto* data = static_cast<const double*>(numbers.data());
    if (whole) return {data, data + numbers.size()};
    out.resize(numbers.size());
    each_number<double>(numbers, [&](std::size_t i, double x) { out[i] = x; });
  } else {
    out.resize(numbers.size());
    each_integer(numbers, [&](std::size_t i, auto x) { out[i] = static_cast<double>(x); });
  }
  return out;
}

std::vector<std::uint32_t> indices_from(nb::handle given, const char* name, int least) {
  nb::object array = empty_as(in_native_order(as_array(given)), "uint32");
  const char kind = kind_of(array);
  if (kind != 'i' && kind != 'u') refuse_type(array, name, "integers", "numpy.uint32");
  check_shape(array, name, 1);
  const auto numbers = nb::cast<AnyArray>(array);
  std::vector<std::uint32_t> out(numbers.size());
  const nb::gil_scoped_release released;
  std::size_t wrong = out.size();
  each_integer(numbers, [&](std::size_t i, auto x) {
    const bool fits = std::cmp_greater_equal(x, least) && std::cmp_less_equal(x, UINT32_MAX);
    if (!fits) wrong = std::min(wrong, i);
    out[i] = static_cast<std::uint32_t>(x);
  });
  if (wrong == out.size()) return out;
  std::string found;
  each_integer(numbers, [&](std::size_t i, auto x) {
    if (i == wrong) found = std::to_string(x);
  });
  throw Error(ErrorCode::usage, std::string(name) + "[" + std::to_string(wrong) + "]: found " +
                                    found + ", expected an index from " + std::to_string(least) +
                                    " to 4294967295");
}

std::vector<Pose> poses_from(nb::handle array, const char* name) {
  const std::vector<double> numbers = reals_from(array, name, 7);
  std::vector<Pose> out(numbers.size() / 7);
  if (!out.empty())
    std::memcpy(static_cast<void*>(out.data()), numbers.data(), numbers.size() * sizeof(double));
  return out;
}

std::vector<std::uint8_t> flags_from(nb::handle given, const char* name) {
  nb::object array = as_array(given);
  if (kind_of(array) == 'b') array = array.attr("astype")("uint8");
  std::vector<std::uint8_t> out;
  for (const std::uint32_t flag : indices_from(array, name)) {
    if (flag > 1)
      throw Error(ErrorCode::usage, std::string(name) + "[" + std::to_string(out.size()) +
                                        "]: found " + std::to_string(flag) +
                                        ", expected True or False");
    out.push_back(static_cast<std::uint8_t>(flag));
  }
  return out;
}

namespace {

template <class Number>
nb::object copy_of(const Number* numbers, const std::vector<std::size_t>& shape) {
  std::size_t size = 1;
  for (const std::size_t extent : shape) size *= extent;
  auto* copy = new Number[std::max<std::size_t>(size, 1)];
  nb::capsule owner(copy, [](void* p) noexcept { delete[] static_cast<Number*>(p); });
  std::copy_n(numbers, size, copy);
  return nb::cast(
      nb::ndarray<nb::numpy, Number, nb::c_contig>(copy, shape.size(), shape.data(), owner));
}

}  // namespace

nb::object array_of(const double* numbers, const std::vector<std::size_t>& shape) {
  return copy_of(numbers, shape);
}
nb::object array_of(const std::vector<double>& numbers, const std::vector<std::size_t>& shape) {
  return copy_of(numbers.data(), shape);
}
nb::object array_of(const std::vector<std::uint64_t>& numbers) {
  return copy_of(numbers.data(), {numbers.size()});
}
nb::object array_of(const std::vector<std::uint32_t>& numbers) {
  return copy_of(numbers.data(), {numbers.size()});
}

}  // namespace sheaf
