// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <string>
#include <vector>

#include "bindings.h"
#include "camera_records.h"
#include "command_line.h"
#include "sheaf/error.h"
#include "verb.h"

namespace sheaf {

/// sheaf.Error with the code that the command would exit with.
void bind_errors(nb::module_&) {
  nb::register_exception_translator([](const std::exception_ptr& thrown, void*) {
    try {
      std::rethrow_exception(thrown);
    } catch (const Error& error) {
      const nb::object type = nb::module_::import_("sheaf._records").attr("Error");
      const nb::object made = type(error.what(), static_cast<int>(error.code()));
      PyErr_SetObject(type.ptr(), made.ptr());
    }
  });
}

void bind_command(nb::module_& module) {
  module.def(
      "run_command",
      [](const std::vector<std::string>& words) {
        std::vector<std::string> texts = words;
        std::vector<char*> arguments;
        for (std::string& text : texts) arguments.push_back(text.data());
        arguments.push_back(nullptr);
        const nb::gil_scoped_release released;
        return run_command_line(static_cast<int>(texts.size()), arguments.data(), all_verbs);
      },
      nb::arg("words"),
      "The command, as in a shell: words[0] is its name. Returns the exit code. It takes signals "
      "for itself and may end the process.");
  module.def("camera_dtype", &camera_dtype,
             nb::sig("def camera_dtype() -> numpy.dtype[numpy.void]"),
             "The type of Problem.cameras: model, parameters, width_px, height_px.");
  module.def(
      "camera_models",
      [] {
        nb::list models;
        for (std::size_t m = 0; m < kCameraModels; ++m)
          models.append(std::string(to_string(static_cast<CameraModel>(m))));
        return nb::tuple(models);
      },
      nb::sig("def camera_models() -> tuple[str, ...]"),
      "Names, by the numbers that records of cameras have.");
  module.attr("VERSION") = SHEAF_VERSION;
}

}  // namespace sheaf

NB_MODULE(_sheaf, module) {
  module.doc() = "The compiled part of sheaf: docs/python.md.";
  sheaf::bind_errors(module);
  sheaf::bind_iteration(module);
  sheaf::ProblemClass problem = sheaf::bind_problem(module);
  sheaf::bind_views(problem);
  sheaf::bind_forms(problem);
  sheaf::bind_pickling(problem);
  sheaf::bind_terms(problem);
  sheaf::bind_files(module, problem);
  sheaf::bind_solve(module);
  sheaf::bind_solver(module);
  sheaf::bind_scenes(module);
  sheaf::bind_reports(module);
  sheaf::bind_covariance(module);
  sheaf::bind_photometric(module);
  sheaf::bind_command(module);
}
