// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <new>
#include <string>

#include "sheaf/error.h"
#include "verb.h"

namespace {

// Of the verb that was named, so that a message says where it comes from.
std::string name_of(const CLI::App& app) {
  const auto verbs = app.get_subcommands();
  return verbs.empty() ? "sheaf" : "sheaf " + verbs.front()->get_name();
}

int usage_error(const CLI::App& app, const CLI::ParseError& error) {
  const bool asked_for_help = error.get_exit_code() == 0;
  if (asked_for_help) return app.exit(error);  // --help and --version, on stdout
  const std::string name = name_of(app);
  std::string message = error.what();
  if (app.get_subcommands().empty()) {
    message = "expected a verb:";
    for (const CLI::App* verb : app.get_subcommands({})) message += " " + verb->get_name();
  }
  std::fprintf(stderr, "%s: %s\nSee '%s --help'.\n", name.c_str(), message.c_str(), name.c_str());
  return static_cast<int>(sheaf::ErrorCode::usage);
}

int complain(const CLI::App& app, const char* message, int code) {
  std::fprintf(stderr, "%s: %s\n", name_of(app).c_str(), message);
  return code;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Sheaf: a bundle adjustment engine.");
  app.name("sheaf");
  app.set_version_flag("--version", "sheaf " SHEAF_VERSION);
  app.require_subcommand(1);
  app.footer("Each verb explains itself: sheaf solve --help\nTo begin: sheaf demo");
  int exit_code = 0;
  sheaf::add_solve(app, exit_code);
  sheaf::add_info(app, exit_code);
  sheaf::add_check(app, exit_code);
  sheaf::add_convert(app, exit_code);
  sheaf::add_perturb(app, exit_code);
  sheaf::add_evaluate(app, exit_code);
  sheaf::add_compare(app, exit_code);
  sheaf::add_photometric(app, exit_code);
  sheaf::add_generate(app, exit_code);
  sheaf::add_demo(app, exit_code);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return usage_error(app, error);
  } catch (const sheaf::Error& error) {
    return complain(app, error.what(), static_cast<int>(error.code()));
  } catch (const std::bad_alloc&) {
    return complain(app, "out of memory", static_cast<int>(sheaf::ErrorCode::memory_limit));
  } catch (const std::exception& error) {
    return complain(app, error.what(), 1);
  }
  return exit_code;
}
