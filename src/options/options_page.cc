// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "options/options_page.h"

#include <vector>

#include "options/option.h"
#include "options/option_field.h"
#include "options/photometric_options.h"
#include "options/solve_options.h"
#include "options/words.h"

namespace sheaf {
namespace {

const char kIntroduction[] =
    "# Options\n"
    "\n"
    "Every option of `sheaf solve` and `sheaf photometric`. The command's parser, its `--help`, "
    "the "
    "key of\n"
    "an option in its JSON, the checks of the library and this page are made from one table in\n"
    "`src/options/`; `sheaf --options` prints the page, and a test holds it against the table.\n"
    "\n"
    "The key is that of `options` in the JSON of a verb ([json.md](json.md)). Where the default "
    "is\n"
    "`none`, `none` can be asked for too, and is `null` in JSON.\n";

std::string type_name(OptionKind kind) {
  switch (kind) {
    case OptionKind::flag:
      return "flag";
    case OptionKind::whole:
      return "whole number";
    case OptionKind::real:
      return "number";
    case OptionKind::bytes:
      return "bytes";
    case OptionKind::choice:
      return "name";
    case OptionKind::text:
      return "text";
    case OptionKind::list:
      return "list";
  }
  return "";
}

/// A cell of a table: its bars are no columns.
std::string cell(const std::string& text) {
  std::string out;
  for (const char c : text) out += c == '|' ? std::string("\\|") : std::string(1, c);
  return out.empty() ? out : out + " ";
}

std::string code(const std::string& text) { return text.empty() ? "" : "`" + text + "`"; }

std::string meaning_of(const OptionSpec& spec) {
  std::vector<std::string> choices;
  for (const OptionChoice& c : spec.choices)
    choices.push_back(code(c.name) + (c.meaning.empty() ? "" : " (" + c.meaning + ")"));
  std::string out = spec.help;
  if (!choices.empty()) out += ": " + listed(choices, " or ");
  if (!spec.needs.empty()) out += "; needs " + code("--" + listed(spec.needs, ", --"));
  return out;
}

std::string row(const BoundOption& option) {
  const OptionSpec& spec = option.spec;
  const bool command = spec.reach != OptionReach::library;
  const bool keyed = spec.reach != OptionReach::every_verb;
  const std::string call = spec.name + (spec.placeholder.empty() ? "" : " " + spec.placeholder);
  std::string out = "|";
  for (const std::string& text :
       {command ? code("--" + call) : "", keyed ? code(key_of(spec)) : "", type_name(spec.kind),
        spec.unit, range_text(spec), code(text_of(option.get())), meaning_of(spec)})
    out += " " + cell(text) + "|";
  return out + "\n";
}

std::string table_of(const std::vector<BoundOption>& options, bool library) {
  std::string out =
      "| Option | Key | Type | Unit | Range | Default | Means |\n|---|---|---|---|---|---|---|\n";
  for (const BoundOption& option : options)
    if ((option.spec.reach == OptionReach::library) == library) out += row(option);
  return out;
}

std::string section(const std::string& verb, const std::string& structs,
                    const std::vector<BoundOption>& options) {
  return "\n## " + verb + "\n\n" + table_of(options, false) + "\nFields of " + structs +
         " that no verb has:\n\n" + table_of(options, true);
}

}  // namespace

std::string options_page() {
  SolveArguments solve;
  PhotometricArguments photometric;
  return kIntroduction + section("solve", "`SolveOptions`", options_of(solve)) +
         section("photometric", "`PhotometricOptions`", options_of(photometric));
}

}  // namespace sheaf
