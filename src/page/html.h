// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace sheaf {

/// Pieces of the page. What is called html here is markup that is put in as it stands; all else is
/// text, and escaped.

/// A chart under its title; the note says how it is to be read.
std::string figure(const std::string& title, const std::string& note_html,
                   const std::string& body_html, const std::string& classes = "");

/// A section: what its charts show in one sentence in the margin, the evidence beside it. Nothing
/// where there is no evidence.
std::string section(const std::string& id, const std::string& title, const std::string& margin_html,
                    const std::string& body_html);

/// A row of a list of facts.
std::string fact(const std::string& name, const std::string& value_html);

/// What a small heading of a part says, and what is below it means.
std::string part_heading(const std::string& title, const std::string& note_html);

/// A table that may be wider than its place.
std::string scrolling(const std::string& label, const std::string& table_html);

/// Text within quotation marks of a script: control characters, marks that would end the script
/// and bytes that are no UTF-8 are escaped or become U+FFFD. With the marks.
std::string script_text(const std::string& text);

/// A number in a script: as many digits as asked for, null where it is not finite.
std::string script_number(double x, int significant = 6);

}  // namespace sheaf
