// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "sheaf/survey.h"

namespace sheaf {

/// Where an entry of a survey stands: "gcp_list.txt:12", or the path alone of a file without lines.
template <class Entry>
std::string place_of(const Constraints& c, const Entry& entry) {
  const std::string path = entry.file < c.paths.size() ? c.paths[entry.file] : std::string();
  return entry.line == 0 ? path : path + ":" + std::to_string(entry.line);
}

/// The same as said beside another entry: "line 12" where both are of one file.
template <class Entry, class Other>
std::string place_beside(const Constraints& c, const Entry& entry, const Other& other) {
  if (entry.file != other.file || entry.line == 0) return place_of(c, entry);
  return "line " + std::to_string(entry.line);
}

/// All its files: "geo.txt, gcp_list.txt".
inline std::string paths_of(const Constraints& c) {
  std::string out;
  for (const std::string& path : c.paths) out += (out.empty() ? "" : ", ") + path;
  return out;
}

}  // namespace sheaf
