// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "bal_file.h"

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>

namespace peer {

bool read_bal(const std::string& path, BalFile& file) {
  std::ifstream in(path, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  const char* at = text.c_str();
  bool good = !text.empty();
  auto number = [&] {
    char* end = nullptr;
    const double value = std::strtod(at, &end);
    good = good && end != at;
    at = end;
    return value;
  };
  const double cameras = number(), points = number(), observations = number();
  good = good && cameras >= 0 && points >= 0 && observations >= 0 &&
         cameras + points + observations < static_cast<double>(text.size());
  if (good) {
    file.observations.resize(static_cast<std::size_t>(observations));
    for (auto& o : file.observations) {
      o.camera = static_cast<int>(number());
      o.point = static_cast<int>(number());
      o.u = number();
      o.v = number();
      good = good && o.camera >= 0 && o.camera < cameras && o.point >= 0 && o.point < points;
    }
    file.cameras.resize(static_cast<std::size_t>(cameras) * camera_size);
    for (double& value : file.cameras) value = number();
    file.points.resize(static_cast<std::size_t>(points) * 3);
    for (double& value : file.points) value = number();
  }
  if (!good) std::fprintf(stderr, "%s: not a complete BAL file\n", path.c_str());
  return good;
}

bool write_bal(const std::string& path, const BalFile& file) {
  std::FILE* out = std::fopen(path.c_str(), "w");
  if (!out) {
    std::fprintf(stderr, "%s: cannot be written\n", path.c_str());
    return false;
  }
  std::fprintf(out, "%d %d %zu\n", file.camera_count(), file.point_count(),
               file.observations.size());
  for (const auto& o : file.observations)
    std::fprintf(out, "%d %d %.17g %.17g\n", o.camera, o.point, o.u, o.v);
  for (double value : file.cameras) std::fprintf(out, "%.17g\n", value);
  for (double value : file.points) std::fprintf(out, "%.17g\n", value);
  return std::fclose(out) == 0;
}

}  // namespace peer
