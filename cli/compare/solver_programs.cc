// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "compare/solver_programs.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <map>
#include <sstream>

#include "sheaf/error.h"

#if defined(__APPLE__)
#include <mach-o/dyld.h>
#endif

namespace sheaf {
namespace {

namespace fs = std::filesystem;
using Programs = std::map<std::string, fs::path>;

const char kPrefix[] = "peer-";

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> out;
  std::istringstream stream(text);
  for (std::string item; std::getline(stream, item, separator);) out.push_back(item);
  return out;
}

// The first folder that has a name wins. peer-evaluate is the bench's own.
void add_programs(const fs::path& folder, Programs& programs) {
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename();
    if (name.rfind(kPrefix, 0) != 0 || name == "peer-evaluate") continue;
    if (!entry.is_regular_file(error) || access(entry.path().c_str(), X_OK) != 0) continue;
    programs.emplace(name.substr(sizeof kPrefix - 1), fs::absolute(entry.path(), error));
  }
}

Programs find_programs(const std::string& folders) {
  Programs programs;
  for (const std::string& folder : split(folders, ':'))
    if (!folder.empty()) add_programs(folder, programs);
  const fs::path here = own_program().parent_path();
  add_programs(here / ".." / "libexec" / "sheaf", programs);
  add_programs(here / "bench" / "peers", programs);
  return programs;
}

// What a peer does best with at this size, as far as bench/ has measured it.
std::string usual_config(const std::string& name, const Problem& problem, const Fixed& fixed) {
  const std::size_t images = problem.num_images();
  if (name.rfind("ceres", 0) == 0)
    return fixed.points     ? "sparse_normal-analytic"
           : images <= 150  ? "dense_schur-analytic"
           : images <= 2000 ? "sparse_schur-analytic"
                            : "iterative_implicit-analytic";
  if (name.rfind("g2o", 0) == 0) return "eigen-lambda=1e-2";
  if (name.rfind("colmap", 0) == 0) return images <= 50 ? "dense" : "sparse";
  if (name.rfind("gtsam", 0) == 0) return "cholesky-metis-ceres";
  if (name.rfind("rootba", 0) == 0) return "schur-double";
  if (name.rfind("pba", 0) == 0) return "float";
  return name == "sheaf" ? "auto" : "";
}

std::string how_to_install(const std::string& name) {
  const std::string build =
      "build Sheaf with -DSHEAF_BUILD_BENCH=ON and install it, or name the adapter's folder with "
      "--peers (bench/README.md)";
  if (name == "ceres") return "apt install libceres-dev; then " + build;
  if (name == "g2o")
    return "build and install https://github.com/RainerKuemmerle/g2o; then " + build;
  if (name == "gtsam") return "pip install gtsam; then " + build;
  if (name == "colmap") return "pip install pycolmap; then " + build;
  return fmt::format("no program peer-{} was found: see bench/README.md for how peers are built",
                     name);
}

void add_solver(const std::string& name, const std::string& config, const Programs& programs,
                const Problem& problem, const Fixed& fixed, SolverList& out) {
  const auto add = [&](const std::string& full, const fs::path& program) {
    out.found.push_back(
        {full, config.empty() ? usual_config(full, problem, fixed) : config, program});
  };
  if (name == "sheaf") return add(name, own_program());
  if (const auto exact = programs.find(name); exact != programs.end())
    return add(name, exact->second);
  const std::size_t before = out.found.size();
  for (const auto& [full, program] : programs)
    if (full.rfind(name + "-", 0) == 0) add(full, program);
  if (out.found.size() == before) out.missing.push_back({name, how_to_install(name)});
}

}  // namespace

fs::path own_program() {
#if defined(__APPLE__)
  char name[4096];
  std::uint32_t size = sizeof name;
  if (_NSGetExecutablePath(name, &size) != 0)
    throw Error(ErrorCode::usage, "the name of this program is too long");
  return fs::canonical(name);
#else
  std::error_code error;
  const fs::path path = fs::read_symlink("/proc/self/exe", error);
  if (error) throw Error(ErrorCode::usage, "/proc/self/exe cannot be read: " + error.message());
  return path;
#endif
}

SolverList find_solvers(const std::string& list, const std::string& folders, const Problem& problem,
                        const Fixed& fixed) {
  const Programs programs = find_programs(folders);
  SolverList out;
  if (list.empty()) {
    add_solver("sheaf", "", programs, problem, fixed, out);
    for (const auto& [name, program] : programs)
      add_solver(name, "", programs, problem, fixed, out);
    for (const std::string name : {"ceres", "g2o", "gtsam", "colmap"}) {
      const auto has = [&](const SolverProgram& s) { return s.name.rfind(name, 0) == 0; };
      if (std::none_of(out.found.begin(), out.found.end(), has))
        out.missing.push_back({name, how_to_install(name)});
    }
    return out;
  }
  for (const std::string& item : split(list, ',')) {
    const std::size_t colon = std::min(item.find(':'), item.size());
    const std::string name = item.substr(0, colon);
    if (name.empty())
      throw Error(ErrorCode::usage, "--solvers: expected NAME[:CONFIG],..., not '" + list + "'");
    add_solver(name, colon < item.size() ? item.substr(colon + 1) : "", programs, problem, fixed,
               out);
  }
  return out;
}

std::vector<std::string> solve_words(const std::string& config) {
  std::vector<std::string> out;
  for (const std::string& word : split(config, '+')) {
    const std::size_t equals = word.find('=');
    if (word.empty() || equals == 0)
      throw Error(ErrorCode::usage,
                  "sheaf:CONFIG: expected a camera solver or OPTION=VALUE, joined by '+', not '" +
                      config + "'");
    if (equals == std::string::npos) {
      out.insert(out.end(), {"--solver", word});
    } else {
      out.insert(out.end(), {"--" + word.substr(0, equals), word.substr(equals + 1)});
    }
  }
  return out;
}

}  // namespace sheaf
