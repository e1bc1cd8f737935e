// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "page/report.h"

#include <spawn.h>
#include <sys/wait.h>

#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>

#include "io/folder_files.h"
#include "json_document.h"
#include "outputs.h"
#include "read_input.h"
#include "sheaf/sheaf.h"
#include "summary_text.h"
#include "terminal.h"
#include "timer.h"
#include "verb.h"

extern char** environ;

namespace sheaf {
namespace {

struct Arguments {
  CommonOptions common;
  std::string before, after, summary, images, title, out;
  bool no_sigmas = false, no_open = false;
};

// What a page is called where nobody says: the file or folder that it is of.
std::string title_of(const std::string& path) {
  std::filesystem::path name(path);
  if (name.filename().empty()) name = name.parent_path();
  name = name.filename();
  for (const char* ending : {".gz", ".bz2", ".txt"})
    if (name.extension() == ending) name = name.stem();
  return name.string();
}

ReportOptions options_of_page(const Arguments& arguments) {
  ReportOptions options;
  options.title = arguments.title.empty() ? title_of(arguments.before) : arguments.title;
  options.images = arguments.images;
  options.sigmas = !arguments.no_sigmas;
  options.threads = arguments.common.threads;
  if (arguments.summary.empty()) return options;
  options.summary = bytes_of(arguments.summary).value();
  options.summary_name = arguments.summary;
  return options;
}

void write_page(const Arguments& arguments, const std::string& out) {
  const Timer total;
  const std::string& json = arguments.common.json;
  const bool two = !arguments.after.empty();
  const InputFile first = read_input(arguments.before, arguments.common);
  InputFile second;
  if (two) second = read_input(arguments.after, arguments.common);
  const Problem& result = two ? second.problem : first.problem;
  const ReportOptions options = options_of_page(arguments);
  const Timer writing;
  write_report(two ? &first.problem : nullptr, result, out, options).value();
  const double write_s = writing.seconds();
  const std::uint64_t bytes = bytes_at(out);
  print_out("{}: {}\nwrote       {}, {:.2f} MB in {:.2f} s\n", arguments.before,
            counts_text(result), out, 1e-6 * static_cast<double>(bytes), write_s);
  if (json.empty()) return;
  write_json({{"version", SHEAF_VERSION},
              {"before", input_json(arguments.before, first)},
              {"after", two ? input_json(arguments.after, second) : Json()},
              {"report", {{"path", out}, {"bytes", bytes}}},
              {"time",
               {{"read_s", first.read_s + second.read_s},
                {"write_s", write_s},
                {"total_s", total.seconds()}}}},
             json);
}

std::vector<std::string> inputs_of(const Arguments& a) {
  return {a.before, a.after, a.summary, a.images};
}

int run(const Arguments& arguments) {
  if (arguments.out.empty())
    throw Error(ErrorCode::usage, "--output: found nothing, expected a file for the page");
  check_outputs({{"-o", arguments.out}, {"--json", arguments.common.json}}, inputs_of(arguments));
  write_page(arguments, arguments.out);
  return 0;
}

// Whether something took the file; its own words would stand among ours, and are not waited for.
bool open_in_browser(const std::string& path) {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  for (const int stream : {1, 2})
    posix_spawn_file_actions_addopen(&actions, stream, "/dev/null", 1, 0);
  std::string program = "xdg-open", file = path;
  char* words[] = {program.data(), file.data(), nullptr};
  pid_t child = 0;
  const bool started = posix_spawnp(&child, "xdg-open", &actions, nullptr, words, environ) == 0;
  posix_spawn_file_actions_destroy(&actions);
  int status = 0;
  return started && waitpid(child, &status, 0) == child && WIFEXITED(status) &&
         WEXITSTATUS(status) == 0;
}

int run_view(const Arguments& arguments) {
  check_outputs({{"--json", arguments.common.json}}, inputs_of(arguments));
  std::string folder = (std::filesystem::temp_directory_path() / "sheaf-view-XXXXXX").string();
  if (::mkdtemp(folder.data()) == nullptr)
    throw Error(ErrorCode::unwritable_output, folder + ": cannot be made");
  const std::string page = folder + "/report.html";
  write_page(arguments, page);
  if (!arguments.no_open && !open_in_browser(page))
    print_out("xdg-open shows nothing here: open {} in a browser\n", page);
  return 0;
}

// What both verbs take.
void add_inputs(Verb& verb, Arguments& a) {
  using F = FieldsOf<Arguments>;
  verb.places = bound<Arguments>(
      {F::text(&Arguments::before,
               {.name = "BEFORE",
                .placeholder = "FILE",
                .help = "start, or the only state: a file or folder, as in convert"})},
      a);
  verb.more_places = bound<Arguments>(
      {F::text(&Arguments::after,
               {.name = "AFTER", .placeholder = "FILE", .help = "result, by whatever solver"})},
      a);
  verb.options = bound<Arguments>(
      {F::text(
           &Arguments::summary,
           {.name = "summary", .placeholder = "FILE", .help = "JSON of the solve that led there"}),
       F::text(&Arguments::images, {.name = "images",
                                    .placeholder = "FOLDER",
                                    .help = "where the images are, for thumbnails"}),
       F::text(
           &Arguments::title,
           {.name = "title", .placeholder = "TEXT", .help = "heading; else the name of BEFORE"}),
       F::flag(&Arguments::no_sigmas,
               {.name = "no-sigmas", .help = "do not compute how well the result is known"})},
      a);
}

}  // namespace

Verb report_verb() {
  using F = FieldsOf<Arguments>;
  auto a = std::make_shared<Arguments>();
  Verb verb{"report", "one page of HTML that shows an adjustment, before and after",
            "Example:\n  sheaf report problem.txt -o report.html\n"
            "\nBefore and after, with what the solver said and the images:\n"
            "  sheaf report model refined --summary summary.json --images images -o report.html"};
  add_inputs(verb, *a);
  verb.options = joined({bound<Arguments>({F::text(&Arguments::out, {.name = "output",
                                                                     .placeholder = "FILE",
                                                                     .help = "page to write",
                                                                     .short_name = "o"})},
                                          *a),
                         verb.options, options_of(a->common)});
  verb.run = [a] { return run(*a); };
  return verb;
}

Verb view_verb() {
  using F = FieldsOf<Arguments>;
  auto a = std::make_shared<Arguments>();
  Verb verb{"view", "show an adjustment in the browser",
            "Example:\n  sheaf view problem.txt\n"
            "\nThe page lies in a new folder for temporary files, and stays there."};
  add_inputs(verb, *a);
  verb.options = joined(
      {verb.options,
       bound<Arguments>({F::flag(&Arguments::no_open,
                                 {.name = "no-open", .help = "only make the page, and say where"})},
                        *a),
       options_of(a->common)});
  verb.run = [a] { return run_view(*a); };
  return verb;
}

}  // namespace sheaf
