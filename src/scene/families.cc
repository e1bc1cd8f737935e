// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <string>

#include "sheaf/scene.h"

namespace sheaf {
namespace {

struct Published {
  const char* place;
  std::uint32_t images, points, observations;
};

// Sizes of the problems of "Bundle Adjustment in the Large".
constexpr Published kPublished[] = {
    {"ladybug", 49, 7776, 31843},       {"ladybug", 138, 19878, 85217},
    {"ladybug", 372, 47423, 204472},    {"ladybug", 539, 65220, 277273},
    {"ladybug", 810, 88814, 393775},    {"ladybug", 1197, 126327, 563734},
    {"ladybug", 1723, 156502, 678718},  {"trafalgar", 21, 11315, 36455},
    {"trafalgar", 161, 48126, 182072},  {"trafalgar", 257, 65132, 225911},
    {"dubrovnik", 16, 22106, 83718},    {"dubrovnik", 88, 64298, 383937},
    {"dubrovnik", 253, 163691, 899155}, {"dubrovnik", 356, 226730, 1255268},
    {"venice", 245, 198739, 1091386},   {"venice", 1102, 780462, 4052340},
    {"venice", 1544, 942409, 4750193},  {"venice", 1778, 993923, 5001946},
    {"final", 93, 61203, 287451},       {"final", 1936, 649673, 5213733},
    {"final", 4585, 1324582, 9125125},  {"final", 13682, 4456117, 28987644}};

std::string name_of(const Published& p) {
  return std::string(p.place) + "-" + std::to_string(p.images);
}

}  // namespace

std::vector<std::string> scene_names() {
  std::vector<std::string> names;
  for (const Published& p : kPublished) names.push_back(name_of(p));
  return names;
}

Result<FamilyOptions> scene_like(const std::string& name) {
  std::string known;
  for (const Published& p : kPublished) {
    known += (known.empty() ? "" : ", ") + name_of(p);
    if (name != name_of(p)) continue;
    const std::string place = p.place;
    FamilyOptions options;
    options.family = place == "ladybug" ? SceneFamily::street : SceneFamily::collection;
    options.images = p.images;
    options.points = p.points;
    options.observations = p.observations;
    if (place == "trafalgar") options.focal_px = 3000;
    return options;
  }
  return Error(ErrorCode::usage, "no published problem is called '" + name + "'; known: " + known);
}

}  // namespace sheaf
