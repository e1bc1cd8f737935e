// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
//
// Reads every source file of the project and holds it against the rules of docs/design.md: the
// table of floors, no cycles, names, lengths, licence headers, and a library that never prints.

#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <vector>

namespace sheaf {
namespace {

namespace fs = std::filesystem;
const fs::path kRoot = SHEAF_SOURCE_DIR;

struct Home {
  int floor = -1;
  int row = -1;  ///< of the table: siblings share a floor, not a row
};

struct SourceFile {
  std::string path;  ///< relative to the root, with '/'
  std::vector<std::string> lines;
};

std::vector<std::string> read_lines(const fs::path& path) {
  std::ifstream file(path);
  std::vector<std::string> lines;
  for (std::string line; std::getline(file, line);) lines.push_back(line);
  return lines;
}

/// Rows `| 3 | `src/io/`, `include/sheaf/io.h` | ... |` of docs/design.md: place -> home.
std::map<std::string, Home> read_floors() {
  std::map<std::string, Home> homes;
  const std::regex row(R"(^\| (\d+) \| ([^|]*) \|)"), place("`([^`]+)`");
  int index = 0;
  for (const std::string& line : read_lines(kRoot / "docs/design.md")) {
    std::smatch match;
    if (!std::regex_search(line, match, row)) continue;
    const std::string places = match[2];
    for (std::sregex_iterator it(places.begin(), places.end(), place), end; it != end; ++it) {
      homes[(*it)[1]] = {std::stoi(match[1]), index};
    }
    ++index;
  }
  return homes;
}

std::vector<SourceFile> read_sources(const std::vector<std::string>& folders,
                                     const std::set<std::string>& extensions) {
  std::vector<SourceFile> files;
  for (const std::string& folder : folders) {
    if (!fs::exists(kRoot / folder)) continue;
    for (const auto& entry : fs::recursive_directory_iterator(kRoot / folder)) {
      if (!entry.is_regular_file() || !extensions.count(entry.path().extension())) continue;
      const std::string path = fs::relative(entry.path(), kRoot).generic_string();
      files.push_back({path, read_lines(entry.path())});
    }
  }
  std::sort(files.begin(), files.end(), [](auto& a, auto& b) { return a.path < b.path; });
  return files;
}

std::vector<SourceFile> engine_sources() {
  return read_sources({"include", "src", "cli", "python"}, {".h", ".cc"});
}
std::vector<SourceFile> all_sources() {
  return read_sources({"include", "src", "cli", "python", "tests", "bench", "fuzz", "examples"},
                      {".h", ".cc"});
}

/// The home of a file: the entry that names it, else its folder's.
const Home* find_home(const std::map<std::string, Home>& homes, const std::string& path) {
  auto it = homes.find(path);
  if (it == homes.end()) {
    const std::size_t second = path.find('/', path.find('/') + 1);
    const bool in_src = path.starts_with("src/") && second != std::string::npos;
    it = homes.find(path.substr(0, in_src ? second + 1 : path.find('/') + 1));
  }
  return it == homes.end() ? nullptr : &it->second;
}

struct Include {
  int line;
  std::string target;
  bool quoted;
};
std::vector<Include> includes_of(const SourceFile& file) {
  static const std::regex pattern(R"(^\s*#\s*include\s*([<"])([^>"]+)[>"])");
  std::vector<Include> includes;
  for (std::size_t i = 0; i < file.lines.size(); ++i) {
    std::smatch match;
    if (std::regex_search(file.lines[i], match, pattern)) {
      includes.push_back({static_cast<int>(i + 1), match[2], match[1] == "\""});
    }
  }
  return includes;
}

/// The project's file an include means, relative to the root, or "" for one from outside.
std::string resolve(const SourceFile& from, const Include& include) {
  const std::string own_folder = fs::path(from.path).parent_path().generic_string();
  for (const std::string& folder : {std::string("src"), std::string("include"), std::string("cli"),
                                    std::string("tests"), std::string("bench"), own_folder}) {
    const std::string path = folder + "/" + include.target;
    if (fs::is_regular_file(kRoot / path)) return path;
  }
  return "";
}

std::string place(const SourceFile& file, int line) {
  return file.path + ":" + std::to_string(line);
}

TEST(Floors, EveryFolderHasAFloor) {
  const auto homes = read_floors();
  ASSERT_GE(homes.size(), 10u) << "the table of floors in docs/design.md was not understood";
  for (const SourceFile& file : engine_sources()) {
    EXPECT_NE(find_home(homes, file.path), nullptr) << file.path << " is not in the table";
  }
  for (const auto& [path, home] : homes) {
    EXPECT_TRUE(fs::exists(kRoot / path)) << "the table names " << path << ", which is not there";
  }
}

TEST(Floors, IncludesGoDownOrStayAtHome) {
  const auto homes = read_floors();
  int seen = 0;
  for (const SourceFile& file : engine_sources()) {
    const Home* from = find_home(homes, file.path);
    if (!from) continue;  // reported above
    for (const Include& include : includes_of(file)) {
      const std::string target = resolve(file, include);
      const Home* to = target.empty() ? nullptr : find_home(homes, target);
      if (!to) continue;
      ++seen;
      EXPECT_TRUE(to->row == from->row || to->floor < from->floor)
          << place(file, include.line) << " (floor " << from->floor << ") includes " << target
          << " (floor " << to->floor << ")";
    }
  }
  EXPECT_GT(seen, 20) << "too few includes were found for this test to mean anything";
}

TEST(Floors, QuotedIncludesAreOurs) {
  for (const SourceFile& file : all_sources()) {
    for (const Include& include : includes_of(file)) {
      // Highway asks for quotes in the files it includes again for each target.
      if (!include.quoted || include.target.starts_with("hwy/")) continue;
      EXPECT_NE(resolve(file, include), "")
          << place(file, include.line) << " includes \"" << include.target << "\": no such file";
    }
  }
}

TEST(Floors, PublicHeadersShowOnlyTheStandardLibrary) {
  const auto headers = read_sources({"include"}, {".h"});
  // The seventeenth is solver.h: solving again and sliding on is another business than solving
  // once.
  EXPECT_LE(headers.size(), 17u);
  for (const SourceFile& file : headers) {
    for (const Include& include : includes_of(file)) {
      const bool standard =
          !include.quoted && include.target.find_first_of("./") == std::string::npos;
      EXPECT_TRUE(standard || include.target.starts_with("sheaf/"))
          << place(file, include.line) << " includes " << include.target;
    }
  }
}

using Graph = std::map<std::string, std::vector<std::string>>;

/// Depth-first search; the path back to the file that closes a cycle, or empty.
std::vector<std::string> find_cycle(const Graph& graph, const std::string& file,
                                    std::map<std::string, int>& state,
                                    std::vector<std::string>& trail) {
  state[file] = 1;
  trail.push_back(file);
  if (const auto edges = graph.find(file); edges != graph.end()) {
    for (const std::string& next : edges->second) {
      if (state[next] == 1) {
        auto start = std::find(trail.begin(), trail.end(), next);
        std::vector<std::string> cycle(start, trail.end());
        cycle.push_back(next);
        return cycle;
      }
      if (state[next] == 0) {
        auto cycle = find_cycle(graph, next, state, trail);
        if (!cycle.empty()) return cycle;
      }
    }
  }
  state[file] = 2;
  trail.pop_back();
  return {};
}

TEST(Floors, NoCyclesBetweenFiles) {
  Graph graph;
  for (const SourceFile& file : all_sources()) {
    for (const Include& include : includes_of(file)) {
      const std::string target = resolve(file, include);
      if (!target.empty()) graph[file.path].push_back(target);
    }
  }
  std::map<std::string, int> state;
  for (const auto& [file, edges] : graph) {
    if (state[file] != 0) continue;
    std::vector<std::string> trail;
    std::string words;
    for (const std::string& step : find_cycle(graph, file, state, trail)) words += "\n  " + step;
    EXPECT_EQ(words, "") << "files include each other in a circle";
  }
}

TEST(Floors, NoForbiddenNames) {
  const std::set<std::string> forbidden{"util",    "utils",   "common", "misc", "helper",
                                        "helpers", "manager", "impl",   "base"};
  for (const SourceFile& file : all_sources()) {
    std::string word;
    for (char c : file.path + ".") {
      if (c != '/' && c != '_' && c != '.' && c != '-') {
        word += c;
        continue;
      }
      EXPECT_FALSE(forbidden.count(word)) << file.path << ": a name that says nothing: " << word;
      word.clear();
    }
  }
}

TEST(Floors, FilesAreShortAndLicensed) {
  for (const SourceFile& file : all_sources()) {
    EXPECT_LE(file.lines.size(), 500u) << file.path;
    ASSERT_GE(file.lines.size(), 2u) << file.path;
    EXPECT_TRUE(std::regex_match(file.lines[0],
                                 std::regex(R"(// Copyright \(c\) \d{4}, the Sheaf authors\.)")))
        << file.path << ": " << file.lines[0];
    EXPECT_EQ(file.lines[1], "// SPDX-License-Identifier: BSD-3-Clause") << file.path;
  }
}

/// Bodies at the left margin: from the line that opens at column 0 to its closing brace there.
TEST(Floors, FunctionsAreShort) {
  int seen = 0;
  for (const SourceFile& file : engine_sources()) {
    std::size_t start = 0;
    for (std::size_t i = 0; i < file.lines.size(); ++i) {
      const std::string& line = file.lines[i];
      const bool margin = !line.empty() && (std::isalpha(line[0]) || line[0] == '_');
      if (margin && !line.starts_with("template")) start = i;
      if (line != "}") continue;  // a namespace or a struct closes otherwise
      ++seen;
      EXPECT_LE(i - start + 1, 60u)
          << place(file, static_cast<int>(start + 1)) << " " << file.lines[start];
    }
  }
  EXPECT_GT(seen, 20) << "too few functions were found for this test to mean anything";
}

TEST(Floors, LibraryNeitherPrintsNorExits) {
  const std::regex forbidden(
      R"(std::(cout|cerr|clog)\b|\b(printf|puts|putchar|exit|_exit|quick_exit|abort|terminate)\s*\(|fprintf\(std)");
  for (const SourceFile& file : read_sources({"include", "src"}, {".h", ".cc"})) {
    for (std::size_t i = 0; i < file.lines.size(); ++i) {
      const std::string code = file.lines[i].substr(0, file.lines[i].find("//"));
      EXPECT_FALSE(std::regex_search(code, forbidden))
          << place(file, static_cast<int>(i + 1)) << ": " << code;
    }
  }
}

TEST(Floors, NoBuildForThisMachineOnly) {
  std::vector<SourceFile> recipes = read_sources(
      {"cmake", "cli", "python", "tests", "bench", "fuzz", "examples"}, {".txt", ".cmake"});
  for (const char* name : {"CMakeLists.txt", "CMakePresets.json"}) {
    recipes.push_back({name, read_lines(kRoot / name)});
  }
  ASSERT_GE(recipes.size(), 8u);
  for (const SourceFile& file : recipes) {
    for (const std::string& line : file.lines) {
      const std::string code = line.substr(0, line.find('#'));
      EXPECT_EQ(code.find("-march="), std::string::npos) << file.path << ": " << line;
    }
  }
}

}  // namespace
}  // namespace sheaf
