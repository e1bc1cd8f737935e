// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "io/colmap_restate.h"

#include <algorithm>
#include <charconv>

#include "io/line_cursor.h"

namespace sheaf {

void put_field(std::string& out, double x) {
  char buffer[40];
  out.append(buffer, std::to_chars(buffer, buffer + sizeof buffer, x).ptr) += ' ';
}
void put_field(std::string& out, std::uint64_t n) { out.append(std::to_string(n)) += ' '; }

void end_line(std::string& out) {
  if (out.ends_with(' ')) out.pop_back();
  out += '\n';
}

std::string state(const RecordLines& records) {
  std::string out = records.header;
  for (std::size_t i = 0; i < records.count; ++i)
    for (int line = 0; line < records.lines; ++line) records.format(i, line, out);
  return out;
}

std::string restate(const RecordLines& records, const std::string& source,
                    const std::vector<std::size_t>& now) {
  std::vector<std::size_t> kept = now;
  std::erase(kept, kGoneRecord);
  if (!std::is_sorted(kept.begin(), kept.end())) return state(records);
  std::string out;
  LineCursor in(source, "");
  std::size_t before = 0;
  while (in.next_line()) {
    const std::string_view text = in.rest();
    if (text.empty() || text.front() == '#' || before == now.size()) {
      out += in.raw_line();
      continue;
    }
    const std::size_t record = now[before];
    for (int line = 0; line < records.lines; ++line) {
      if (line > 0) in.next_line();
      if (record == kGoneRecord) continue;
      if (records.same(record, before, line)) {
        out += in.raw_line();
      } else {
        records.format(record, line, out);
      }
    }
    ++before;
  }
  std::vector<bool> written(records.count, false);
  for (const std::size_t record : kept) written[record] = true;
  for (std::size_t i = 0; i < records.count; ++i) {
    if (written[i]) continue;
    if (!out.empty() && out.back() != '\n') out += '\n';
    for (int line = 0; line < records.lines; ++line) records.format(i, line, out);
  }
  return out;
}

}  // namespace sheaf
