// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "survey_use.h"

#include <nanobind/stl/string.h>

#include <filesystem>
#include <string>
#include <vector>

#include "arrays.h"
#include "constraints_option.h"

namespace sheaf {
namespace {

bool is_path(nb::handle given) {
  return PyUnicode_Check(given.ptr()) || nb::hasattr(given, "__fspath__");
}

std::string path_from(nb::handle given) {
  return nb::cast<std::string>(nb::str(nb::module_::import_("os").attr("fspath")(given)));
}

}  // namespace

nb::object object_of_json(const std::string& text) {
  return nb::module_::import_("json").attr("loads")(text);
}

std::optional<Constraints> constraints_from(nb::handle given) {
  if (given.is_none()) return {};
  if (nb::isinstance<nb::dict>(given)) {
    const auto text = nb::cast<std::string>(nb::module_::import_("json").attr("dumps")(
        given, nb::arg("indent") = 1,
        nb::arg("default") = nb::module_::import_("sheaf._records").attr("plain_of")));
    return parse_constraints(text, "constraints").value();
  }
  if (is_path(given)) return read_constraints(std::filesystem::path(path_from(given))).value();
  if (!PySequence_Check(given.ptr())) {
    const std::string text =
        "constraints: expected a path, several of them or a dict, not " + type_of(given);
    throw nb::type_error(text.c_str());
  }
  std::vector<std::filesystem::path> paths;
  for (nb::handle path : nb::borrow<nb::object>(given)) paths.emplace_back(path_from(path));
  return read_constraints(paths).value();
}

nb::object survey_object(const std::optional<Survey>& survey, const SurveyReport* report) {
  if (!survey) return nb::none();
  return object_of_json(survey_json(survey, report).dump());
}

}  // namespace sheaf
