// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
//
// The only file that knows the library which parses the command line: including it takes seconds.

#include "command_line.h"

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <cstdlib>
#include <exception>
#include <new>
#include <string>
#include <string_view>
#include <utility>

#include "exit_code.h"
#include "interrupt.h"
#include "io/partial.h"
#include "man_page.h"
#include "options/options_page.h"
#include "sheaf/error.h"
#include "terminal.h"

namespace sheaf {
namespace {

CLI::Validator accepted_by(const OptionSpec& spec) {
  return CLI::Validator(
      [spec](std::string& text) {
        const Result<OptionValue> value = parse(spec, text);
        return value.ok() ? std::string() : std::string(value.error().what());
      },
      "");
}

/// Texts have passed the validator by the time that they are put.
CLI::Option* add_by_kind(CLI::App& app, const std::string& names, const BoundOption& option) {
  const std::string help = help_text(option.spec);
  if (option.spec.kind == OptionKind::flag)
    return app.add_flag_function(
        names, [option](std::int64_t count) { option.put(count > 0); }, help);
  if (option.spec.kind == OptionKind::list) {
    const auto put = [option](const std::vector<std::string>& texts) {
      std::vector<std::string> items;
      for (const std::string& text : texts)
        for (std::string& item : split_items(text)) items.push_back(std::move(item));
      option.put(items);
    };
    return app.add_option_function<std::vector<std::string>>(names, put, help)
        ->allow_extra_args(false);
  }
  const auto put = [option](const std::string& text) {
    if (text.empty() && option.spec.kind == OptionKind::text)
      throw Error(ErrorCode::usage, "--" + option.spec.name + ": found an empty text, expected " +
                                        option.spec.placeholder);
    option.put(parse(option.spec, text).value());
  };
  return app.add_option_function<std::string>(names, put, help);
}

CLI::Option* add(CLI::App& app, const std::string& names, const BoundOption& option) {
  CLI::Option* added = add_by_kind(app, names, option);
  if (option.spec.kind == OptionKind::flag) return added;
  added->type_name(option.spec.placeholder)->check(accepted_by(option.spec));
  const OptionValue value = option.get();
  if (value != OptionValue() && !text_of(value).empty()) added->default_str(text_of(value));
  return added;
}

void add_options(CLI::App& app, const std::vector<BoundOption>& options) {
  for (const BoundOption& option : options) {
    const OptionSpec& spec = option.spec;
    add(app, (spec.short_name.empty() ? "" : "-" + spec.short_name + ",") + "--" + spec.name,
        option);
  }
  for (const BoundOption& option : options) {
    CLI::Option* added = app.get_option("--" + option.spec.name);
    for (const std::string& name : option.spec.needs) added->needs(app.get_option("--" + name));
    for (const std::string& name : option.spec.excludes)
      added->excludes(app.get_option("--" + name));
  }
}

void add_verb(CLI::App& app, const Verb& verb, int& exit_code) {
  CLI::App& added = *app.add_subcommand(verb.name, verb.purpose);
  for (const BoundOption& place : verb.places) add(added, place.spec.name, place)->required();
  for (const BoundOption& place : verb.more_places) add(added, place.spec.name, place);
  add_options(added, verb.options);
  added.footer(verb.examples);
  added.callback([&verb, &exit_code] { exit_code = verb.run(); });
}

/// The page goes to stdout, as --version does; its end of line is added there.
[[noreturn]] void print_page(std::string page) {
  page.pop_back();
  throw CLI::CallForVersion(page, 0);
}

// Of the verb that was named, so that a message says where it comes from.
std::string name_of(const CLI::App& app) {
  const auto verbs = app.get_subcommands();
  return verbs.empty() ? "sheaf" : "sheaf " + verbs.front()->get_name();
}

constexpr std::string_view kOutOfMemory = "sheaf: out of memory\n";

/// Takes no memory.
int tell_out_of_memory() {
  (void)!::write(STDERR_FILENO, kOutOfMemory.data(), kOutOfMemory.size());
  return static_cast<int>(ErrorCode::memory_limit);
}

/// Functions of libraries that promise not to throw allocate all the same: an allocation that fails
/// in one of them ends the command as any other does.
std::atomic<bool> allocation_failed = false;

[[noreturn]] void end_without_memory() {
  if (!allocation_failed) std::abort();
  unlink_partial_files();
  ::_exit(tell_out_of_memory());
}

[[noreturn]] void note_failed_allocation() {
  allocation_failed = true;
  throw std::bad_alloc();
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
  print_err("{}: {}\nSee '{} --help'.\n", name, message, name);
  return static_cast<int>(ErrorCode::usage);
}

int complain(const CLI::App& app, const char* message, int code) {
  print_err("{}: {}\n", name_of(app), message);
  return code;
}

int run(int argc, char** argv, const std::vector<Verb>& verbs) {
  CLI::App app("Sheaf: a bundle adjustment engine.");
  app.name("sheaf");
  app.set_version_flag("--version", "sheaf " SHEAF_VERSION);
  app.add_flag_callback(
      "--options", [] { print_page(options_page()); },
      "Print the page of all options of solve and photometric (docs/options.md) and exit");
  app.add_flag_callback(
      "--man", [&verbs] { print_page(man_page(verbs)); },
      "Print the manual page, sheaf(1), in the macros of man(7) and exit");
  app.require_subcommand(1);
  app.footer("Each verb explains itself: sheaf solve --help\nTo begin: sheaf demo");
  int exit_code = 0;
  for (const Verb& verb : verbs) add_verb(app, verb, exit_code);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return usage_error(app, error);
  } catch (const Error& error) {
    return complain(app, error.what(), static_cast<int>(error.code()));
  } catch (const std::bad_alloc&) {
    return complain(app, "out of memory", static_cast<int>(ErrorCode::memory_limit));
  } catch (const std::exception& error) {
    return complain(app, error.what(), 1);
  }
  return exit_code;
}

/// A result that nobody could read is none; an error that was told already stays.
int finish(int exit_code) {
  const std::string failed = finish_stdout();
  if (failed.empty()) return exit_code;
  print_err("sheaf: stdout: cannot be written: {}\n", failed);
  const bool ran = exit_code == 0 || exit_code == kExitInterrupted || exit_code == kExitTimeLimit;
  return ran ? static_cast<int>(ErrorCode::unwritable_output) : exit_code;
}

}  // namespace

int run_command_line(int argc, char** argv, std::vector<Verb> (*verbs)()) {
  watch_signals();
  guard_streams();
  std::set_new_handler(note_failed_allocation);
  std::set_terminate(end_without_memory);
  try {
    return finish(run(argc, argv, verbs()));
  } catch (const std::bad_alloc&) {
    return tell_out_of_memory();
  }
}

}  // namespace sheaf
