// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "man_page.h"

#include <fmt/format.h>

#include <sstream>
#include <string_view>

#include "options/option.h"

namespace sheaf {
namespace {

constexpr std::string_view kBeginning =
    ".TH SHEAF 1 \"\" \"sheaf " SHEAF_VERSION
    "\" \"User Commands\"\n"
    ".SH NAME\nsheaf \\- bundle adjustment engine\n"
    ".SH SYNOPSIS\n.B sheaf\n.I VERB\n.RI [ ARGUMENT ...]\n.RI [ OPTION ...]\n"
    ".br\n.B sheaf\n.RB { \\-\\-help | \\-\\-version | \\-\\-options | \\-\\-man }\n"
    ".SH DESCRIPTION\nSheaf refines the poses and lenses of cameras together with the points that "
    "they see, so that all of them fit the images.\nEach verb explains itself:\n"
    ".BR \"sheaf solve \\-\\-help\" .\n"
    ".SH OPTIONS\n"
    ".TP\n.B \\-h, \\-\\-help\nPrint the verbs, or behind a verb its arguments and options.\n"
    ".TP\n.B \\-\\-version\nPrint the version.\n"
    ".TP\n.B \\-\\-options\nPrint a page of all options of solve and photometric, in Markdown.\n"
    ".TP\n.B \\-\\-man\nPrint this page, in the macros of man(7).\n"
    ".SH VERBS\n";

constexpr std::string_view kEnd =
    ".SH EXIT STATUS\n"
    ".TP\n.B 0\nThere is a usable result; the reason for stopping is in the summary.\n"
    ".TP\n.B 2\nThe usage was wrong.\n"
    ".TP\n.B 3\nThe input cannot be read: the message names file, place and what was expected.\n"
    ".TP\n.B 4\nNo usable step could be made (a start that is already a minimum is 0).\n"
    ".TP\n.B 5\nThe memory limit would be exceeded; nothing was allocated.\n"
    ".TP\n.B 6\nThe output cannot be written, stdout included.\n"
    ".TP\n.B 7\nThe time limit was reached: the best state so far is written.\n"
    ".TP\n.B 130\nSIGINT, SIGTERM or SIGHUP interrupted the run, after the best state so far was "
    "written.\n";

/// `text` as roff reads it: a backslash escapes, a hyphen breaks lines unless it is a minus, and a
/// dot or an apostrophe at the beginning of a line is a request.
std::string roff(std::string_view text) {
  std::string out;
  bool begins = true;
  for (const char c : text) {
    if (begins && (c == '.' || c == '\'')) out += "\\&";
    begins = c == '\n';
    switch (c) {
      case '\\':
        out += "\\e";
        break;
      case '-':
        out += "\\-";
        break;
      case '\'':
        out += "\\(aq";
        break;
      case '`':
        out += "\\(ga";
        break;
      case '^':
        out += "\\(ha";
        break;
      case '~':
        out += "\\(ti";
        break;
      default:
        out += c;
    }
  }
  return out;
}

/// One paragraph with a hanging tag: the option as it is typed, then its help.
std::string entry(const std::string& names, const BoundOption& option) {
  std::string out = ".TP\n\\fB" + roff(names) + "\\fR";
  if (!option.spec.placeholder.empty() && option.spec.kind != OptionKind::flag)
    out += " \\fI" + roff(option.spec.placeholder) + "\\fR";
  out += "\n" + roff(help_text(option.spec)) + "\n";
  if (option.spec.kind == OptionKind::flag) return out;
  const std::string usual = text_of(option.get());
  return usual.empty() ? out : out + "The default is " + roff(usual) + ".\n";
}

std::string option_entry(const BoundOption& option) {
  const std::string& brief = option.spec.short_name;
  return entry((brief.empty() ? "" : "-" + brief + ", ") + "--" + option.spec.name, option);
}

/// The verb's call in one line: "sheaf solve IN [OPTION...]".
std::string synopsis(const Verb& verb) {
  std::string out = ".B sheaf " + roff(verb.name) + "\n";
  for (const BoundOption& place : verb.places) out += ".I " + roff(place.spec.name) + "\n";
  for (const BoundOption& place : verb.more_places)
    out += ".RI [ " + roff(place.spec.name) + " ]\n";
  return out + ".RI [ OPTION ...]\n";
}

std::string section(const Verb& verb) {
  std::string out = ".SS " + roff(verb.name) + "\n" + synopsis(verb);
  out += ".PP\nPurpose: " + roff(verb.purpose) + ".\n";
  for (const BoundOption& place : verb.places) out += entry(place.spec.name, place);
  for (const BoundOption& place : verb.more_places) out += entry(place.spec.name, place);
  for (const BoundOption& option : verb.options)
    if (option.spec.reach != OptionReach::library) out += option_entry(option);
  if (!verb.examples.empty()) out += ".PP\n.nf\n" + roff(verb.examples) + "\n.fi\n";
  return out;
}

/// `page` without its empty lines, which roff would take for vertical space of its own.
std::string without_empty_lines(const std::string& page) {
  std::istringstream lines(page);
  std::string out;
  for (std::string line; std::getline(lines, line);) out += (line.empty() ? ".sp" : line) + "\n";
  return out;
}

}  // namespace

std::string man_page(const std::vector<Verb>& verbs) {
  std::string out(kBeginning);
  for (const Verb& verb : verbs) out += section(verb);
  return without_empty_lines(out + std::string(kEnd));
}

}  // namespace sheaf
