// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "options/refinement.h"

#include <algorithm>
#include <array>
#include <bit>
#include <map>
#include <numeric>
#include <set>
#include <string_view>
#include <utility>

#include "options/refinement_items.h"
#include "options/words.h"
#include "scene/rigs.h"
#include "scene/source_files.h"

namespace sheaf {
namespace {

using Part = RefinementItem::Part;

/// How few an item names: all, a pattern, one; and within these a lens, a kind of its parameters, a
/// single one.
int narrowness(const RefinementItem& item, bool pattern) {
  const int reach = item.who.empty() ? 0 : pattern ? 10 : 20;
  const bool whole =
      item.part == Part::lens || item.part == Part::image || item.part == Part::sensor;
  return reach + (whole ? 0 : item.part == Part::parameter ? 2 : 1);
}

/// An item and what it is about in this problem.
struct Resolved {
  const RefinementItem* item;
  int narrowness = 0;
  bool points = false;
  std::vector<std::uint32_t> images;                            ///< poses
  std::vector<std::uint32_t> sensors;                           ///< of rigs
  std::vector<std::pair<std::uint32_t, std::uint16_t>> lenses;  ///< parameters of lenses
};

using BitsOfModels = std::array<std::uint16_t, kCameraModels>;

BitsOfModels bits_of_models(const RefinementItem& item) {
  BitsOfModels out;
  for (std::size_t m = 0; m < kCameraModels; ++m)
    out[m] = parameters_of(item, static_cast<CameraModel>(m));
  return out;
}

std::size_t model_number(const Problem& problem, std::size_t lens) {
  return static_cast<std::size_t>(problem.cameras[lens].model);
}

std::vector<std::uint32_t> all(std::size_t count) {
  std::vector<std::uint32_t> out(count);
  std::iota(out.begin(), out.end(), 0u);
  return out;
}

std::vector<std::uint32_t> lenses_of(const std::vector<std::uint32_t>& images,
                                     const Problem& problem) {
  std::set<std::uint32_t> lenses;
  for (const std::uint32_t j : images) lenses.insert(problem.image_camera[j]);
  return {lenses.begin(), lenses.end()};
}

Error absent_parameter(const RefinementItem& item, const Problem& problem,
                       const std::vector<std::uint32_t>& lenses) {
  std::set<std::string> known;
  for (const std::uint32_t c : lenses) {
    const CameraModel model = problem.cameras[c].model;
    known.insert(std::string(to_string(model)) + " has " + listed(parameter_names(model)));
  }
  std::string models;
  for (const std::string& model : known) models += "; " + model;
  return refusal_of(item, "no camera that is meant has this parameter" + models);
}

Result<Resolved> resolve_sensors(const RefinementItem& item, const Problem& problem) {
  Resolved out;
  out.item = &item;
  Result<Named> found = Named();
  if (item.who.empty()) {
    for (std::uint32_t s = 0; s < problem.rigs.num_sensors(); ++s)
      if (problem.rigs.is_reference[s] == 0) found.value().indices.push_back(s);
  } else {
    found = sensors_named(item, problem);
  }
  if (!found.ok()) return found.error();
  out.narrowness = narrowness(item, found.value().pattern);
  out.sensors = std::move(found.value().indices);
  return out;
}

Result<Resolved> resolve(const RefinementItem& item, const Problem& problem) {
  if (item.part == Part::sensor) return resolve_sensors(item, problem);
  Resolved out;
  out.item = &item;
  Result<Named> found = Named();
  const bool by_image = item.part == Part::poses || item.part == Part::image;
  if (item.who.empty()) {
    found.value().indices = all(by_image ? problem.num_images() : problem.cameras.size());
  } else {
    found = by_image ? images_named(item, problem) : lenses_named(item, problem);
  }
  if (!found.ok()) return found.error();
  const Named& named = found.value();
  out.narrowness = narrowness(item, named.pattern);
  out.points = item.part == Part::points;
  if (by_image) out.images = named.indices;
  if (out.points || item.part == Part::poses) return out;
  const auto lenses = by_image ? lenses_of(named.indices, problem) : named.indices;
  const BitsOfModels bits = bits_of_models(item);
  unsigned any = 0;
  for (const std::uint32_t c : lenses) {
    out.lenses.emplace_back(c, bits[model_number(problem, c)]);
    any |= out.lenses.back().second;
  }
  if (any == 0 && item.part == Part::parameter) return absent_parameter(item, problem, lenses);
  return out;
}

/// Who has decided over the points, a pose or a parameter so far.
class Decisions {
 public:
  Decisions(const Problem& problem, const std::vector<Resolved>& resolved)
      : resolved_(resolved), images_(problem.num_images()) {
    sensors_ = 1 + images_ + kMaxCameraParameters * problem.cameras.size();
    last_.assign(sensors_ + problem.rigs.num_sensors(), 0);
  }
  static constexpr std::size_t kPoints = 0;
  static std::size_t pose(std::uint32_t image) { return 1 + image; }
  std::size_t parameter(std::uint32_t lens, int k) const {
    return 1 + images_ + kMaxCameraParameters * lens + static_cast<std::size_t>(k);
  }

  std::size_t sensor(std::uint32_t s) const { return sensors_ + s; }

  /// Later calls are narrower, or as narrow.
  void decide(std::size_t what, std::uint32_t by) {
    const std::uint32_t before = std::exchange(last_[what], by + 1);
    if (before == 0 || !contradiction_.empty()) return;
    const Resolved &a = resolved_[before - 1], &b = resolved_[by];
    if (a.narrowness != b.narrowness || a.item->refine == b.item->refine) return;
    contradiction_ = "--fix " + (b.item->refine ? a : b).item->text + " and --refine " +
                     (b.item->refine ? b : a).item->text + " contradict each other";
  }
  /// The first, or "".
  const std::string& contradiction() const { return contradiction_; }

 private:
  const std::vector<Resolved>& resolved_;
  std::size_t images_, sensors_;
  std::vector<std::uint32_t> last_;  ///< 1 + index into resolved_; 0: nobody
  std::string contradiction_;
};

Refinement by_default(const Problem& problem) {
  RefinementItem lens;
  lens.part = Part::lens;
  const BitsOfModels lenses = bits_of_models(lens);
  Refinement out;
  out.poses.assign(problem.num_images(), true);
  out.named.assign(problem.num_images(), false);
  for (const std::uint8_t reference : problem.rigs.is_reference)
    out.sensors.push_back(reference == 0);
  for (std::size_t c = 0; c < problem.cameras.size(); ++c) {
    const std::size_t m = model_number(problem, c);
    out.lenses.push_back(static_cast<std::uint16_t>(lenses[m] & ~usually_held(problem, c)));
  }
  return out;
}

void apply(const Resolved& resolved, std::uint32_t number, Decisions& decisions, Refinement& out) {
  const bool refine = resolved.item->refine;
  if (resolved.points) {
    decisions.decide(Decisions::kPoints, number);
    out.points = refine;
  }
  for (const std::uint32_t j : resolved.images) {
    decisions.decide(Decisions::pose(j), number);
    out.poses[j] = refine;
    out.named[j] = !resolved.item->who.empty();
  }
  for (const std::uint32_t s : resolved.sensors) {
    decisions.decide(decisions.sensor(s), number);
    out.sensors[s] = refine;
  }
  for (const auto& [c, bits] : resolved.lenses) {
    for (unsigned left = bits; left != 0; left &= left - 1)
      decisions.decide(decisions.parameter(c, std::countr_zero(left)), number);
    const unsigned were = out.lenses[c];
    out.lenses[c] = static_cast<std::uint16_t>(refine ? were | bits : were & ~unsigned{bits});
  }
}

/// Broader ones first; what names as few in the order that they were given in.
Result<std::vector<Resolved>> resolve_all(const std::vector<RefinementItem>& items,
                                          const Problem& problem) {
  std::vector<Resolved> out;
  for (const RefinementItem& item : items) {
    Result<Resolved> resolved = resolve(item, problem);
    if (!resolved.ok()) return resolved.error();
    out.push_back(std::move(resolved).value());
  }
  std::stable_sort(out.begin(), out.end(), [](const Resolved& a, const Resolved& b) {
    return a.narrowness < b.narrowness;
  });
  return out;
}

Result<std::vector<RefinementItem>> parse_all(const RefinementArguments& a) {
  std::vector<RefinementItem> items;
  for (const bool refine : {false, true})
    for (const std::string& text : refine ? a.refine : a.fix) {
      Result<RefinementItem> item = parse_item(text, refine);
      if (!item.ok())
        return Error(ErrorCode::usage,
                     (refine ? "--refine: " : "--fix: ") + std::string(item.error().what()));
      items.push_back(std::move(item).value());
    }
  return items;
}

/// Poses of single images and frames into the list of what is held.
void hold_images(const Refinement& refinement, const Problem& problem, Fixed& out) {
  const Rigs& rigs = problem.rigs;
  const std::vector<std::uint8_t> trivial = trivial_frames(rigs);
  enum : char { kUntouched, kHeld, kMoves };
  std::vector<char> frames(rigs.num_frames(), kUntouched);
  for (std::uint32_t j = 0; j < problem.num_images(); ++j) {
    const bool held = refinement.poses[j] == 0;
    if (!in_rig(rigs, j) || trivial[rigs.image_frame[j]] != 0) {
      if (held && !out.poses) out.pose_ids.push_back(j);
      continue;
    }
    if (held && refinement.named[j] != 0) out.pose_ids.push_back(j);
    char& frame = frames[rigs.image_frame[j]];
    if (frame != kMoves) frame = held ? kHeld : kMoves;
  }
  if (out.poses) return;
  for (std::uint32_t f = 0; f < frames.size(); ++f)
    if (frames[f] == kHeld) out.frame_ids.push_back(f);
}

OptionSpec item_spec(const char* name, const std::string& help, bool refine) {
  return {.name = name,
          .placeholder = "LIST",
          .help = help,
          .wrong = [refine](const std::string& text) {
            const Result<RefinementItem> item = parse_item(text, refine);
            return item.ok() ? std::string() : std::string(item.error().what());
          }};
}

}  // namespace

OptionTable<RefinementArguments> refinement_fields(const std::string& of_fix) {
  using F = FieldsOf<RefinementArguments>;
  return {
      F::list(&RefinementArguments::fix,
              item_spec("fix",
                        of_fix + ": a comma-separated list of points, poses, intrinsics, f, k "
                                 "(distortion), pp (principal "
                                 "point), sensor_from_rig or a parameter's name (fx, k1, ...); of "
                                 "named ones as "
                                 "pose=WHO, camera=WHO, image=WHO (both), f=WHO, ...; WHO is a "
                                 "camera's or image's id, an image's name, or a pattern as "
                                 "'left/*'",
                        false)),
      F::list(&RefinementArguments::refine,
              item_spec("refine",
                        "likewise what moves besides, or of what --fix holds; by default all but "
                        "pp. What names fewer wins: --fix poses --refine pose=new.jpg",
                        true)),
  };
}

Result<Refinement> refinement_of(const RefinementArguments& arguments, const Problem& problem) {
  Refinement out = by_default(problem);
  if (!arguments.given()) return out;
  const Result<std::vector<RefinementItem>> items = parse_all(arguments);
  if (!items.ok()) return items.error();
  const Result<std::vector<Resolved>> resolved = resolve_all(items.value(), problem);
  if (!resolved.ok()) return resolved.error();
  Decisions decisions(problem, resolved.value());
  for (std::uint32_t i = 0; i < resolved.value().size(); ++i)
    apply(resolved.value()[i], i, decisions, out);
  if (!decisions.contradiction().empty()) return Error(ErrorCode::usage, decisions.contradiction());
  return out;
}

Fixed fixed_of(const Refinement& refinement, const Problem& problem) {
  const auto moves = [](char moving) { return moving != 0; };
  Fixed out;
  out.points = !refinement.points;
  out.poses = std::none_of(refinement.poses.begin(), refinement.poses.end(), moves);
  hold_images(refinement, problem, out);
  for (std::uint32_t s = 0; s < problem.rigs.num_sensors(); ++s)
    if (!moves(refinement.sensors[s]) && problem.rigs.is_reference[s] == 0)
      out.sensor_ids.push_back(s);
  const auto free = std::count(problem.rigs.is_reference.begin(), problem.rigs.is_reference.end(),
                               std::uint8_t{0});
  out.sensors = free > 0 && static_cast<std::ptrdiff_t>(out.sensor_ids.size()) == free;
  if (out.sensors) out.sensor_ids.clear();
  for (const std::uint16_t free : refinement.lenses)
    out.parameters.push_back(static_cast<ParameterSet>(~unsigned{free}));
  return out;
}

std::string held_text(const Refinement& refinement, const Problem& problem) {
  std::vector<std::string> parts;
  if (!refinement.points) parts.emplace_back("points");
  const auto held = std::count(refinement.poses.begin(), refinement.poses.end(), char{0});
  if (held > 0)
    parts.push_back("poses of " + std::to_string(held) + " of " +
                    std::to_string(problem.num_images()) + " images");
  std::size_t sensors = 0, free_sensors = 0;
  for (std::size_t s = 0; s < problem.rigs.num_sensors(); ++s) {
    if (problem.rigs.is_reference[s] != 0) continue;
    ++sensors;
    free_sensors += refinement.sensors[s] != 0 ? 1 : 0;
  }
  if (free_sensors < sensors)
    parts.push_back("sensor_from_rig of " + std::to_string(sensors - free_sensors) + " of " +
                    std::to_string(sensors) + " sensors");
  std::map<std::string, std::size_t> lenses;
  for (std::size_t c = 0; c < problem.cameras.size(); ++c) {
    if (image_size(problem.cameras[c].model) != 0) continue;  // nothing of it ever moves
    std::vector<std::string_view> names = parameter_names(problem.cameras[c].model);
    const std::size_t count = names.size();
    std::size_t k = 0;
    std::erase_if(names, [&](std::string_view) { return (refinement.lenses[c] >> k++ & 1) != 0; });
    if (names.size() == count) {
      ++lenses["all"];
    } else if (!names.empty()) {
      ++lenses[listed(names)];
    }
  }
  for (const auto& [names, count] : lenses)
    parts.push_back(names + " of " + std::to_string(count) + " of " +
                    std::to_string(problem.cameras.size()) + " lenses");
  std::string out;
  for (const std::string& part : parts) out += (out.empty() ? "" : "; ") + part;
  return out;
}

}  // namespace sheaf
