// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "page/html.h"

#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>

#include "chart/number_text.h"

namespace sheaf {

std::string figure(const std::string& title, const std::string& note_html,
                   const std::string& body_html, const std::string& classes) {
  return "<figure" + (classes.empty() ? "" : " class=\"" + classes + "\"") + "><figcaption><b>" +
         escaped(title) + "</b> <span>" + note_html + "</span></figcaption>" + body_html +
         "</figure>";
}

std::string section(const std::string& id, const std::string& title, const std::string& margin_html,
                    const std::string& body_html) {
  if (body_html.empty()) return "";
  return "<section id=\"" + id + "\"><header><h2>" + escaped(title) + "</h2><p>" + margin_html +
         "</p></header><div class=\"body\">" + body_html + "</div></section>\n";
}

std::string fact(const std::string& name, const std::string& value_html) {
  return "<div><dt>" + escaped(name) + "</dt><dd>" + value_html + "</dd></div>";
}

std::string part_heading(const std::string& title, const std::string& note_html) {
  return "<div class=\"sub\"><h3>" + escaped(title) + "</h3><p>" + note_html + "</p></div>";
}

std::string scrolling(const std::string& label, const std::string& table_html) {
  return "<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"" + escaped(label) +
         "\">" + table_html + "</div>";
}

std::string script_text(const std::string& text) {
  // What `escaped` leaves is UTF-8 without control characters; its marks are undone again.
  const std::string safe = escaped(text);
  std::string out = "\"";
  for (std::size_t i = 0; i < safe.size();) {
    static constexpr std::array<std::array<const char*, 2>, 5> kMarks = {{{"&amp;", "\\u0026"},
                                                                          {"&lt;", "\\u003c"},
                                                                          {"&gt;", "\\u003e"},
                                                                          {"&quot;", "\\u0022"},
                                                                          {"&#39;", "\\u0027"}}};
    bool marked = false;
    for (const auto& [mark, instead] : kMarks)
      if (!marked && safe.compare(i, std::char_traits<char>::length(mark), mark) == 0) {
        out += instead;
        i += std::char_traits<char>::length(mark);
        marked = true;
      }
    if (marked) continue;
    if (safe[i] == '\\') out += '\\';
    out += safe[i++];
  }
  return out + "\"";
}

std::string script_number(double x, int significant) {
  if (!std::isfinite(x)) return "null";
  std::array<char, 40> text;
  const auto end = std::to_chars(text.data(), text.data() + text.size(), x,
                                 std::chars_format::general, significant);
  return {text.data(), end.ptr};
}

}  // namespace sheaf
