// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "lists/lens_tracks.h"

#include <algorithm>

#include "platform/parallel.h"

namespace sheaf {
namespace {

constexpr std::size_t kGroupsPerTask = 1024;

LensPlaces place_parameters(CameraModel model, ParameterSet held, bool shared) {
  LensPlaces out;
  out.model = model;
  out.place.fill(LensPlaces::kHeld);
  int place = shared ? LensPlaces::kRiders : 0;
  for (std::size_t k = 0; k < parameter_count(model); ++k)
    if ((held >> k & 1) == 0) out.place[k] = static_cast<std::int8_t>(place++);
  out.riders = static_cast<std::uint8_t>(shared ? 0 : std::min(place, LensPlaces::kRiders));
  for (int j = 0; j < 2; ++j) {
    const int columns = std::clamp(place - LensPlaces::kRiders - 9 * j, 0, 9);
    out.width[j] = static_cast<std::uint8_t>(columns);
    out.blocks = static_cast<std::uint8_t>(out.blocks + (columns > 0));
  }
  return out;
}

void place_lenses(const Problem& problem, const Fixed& fixed, LensTracks& out) {
  const std::vector<ParameterSet> held = held_parameters(problem, fixed);
  std::vector<std::uint32_t> images(problem.cameras.size(), 0);
  for (std::uint32_t c : problem.image_camera) ++images[c];
  out.image_lens = problem.image_camera;
  out.num_blocks = static_cast<std::uint32_t>(problem.num_images());
  for (std::size_t c = 0; c < problem.cameras.size(); ++c) {
    const ParameterSet of = images[c] > 0 ? held[c] : ParameterSet(0xffff);  // nobody's: no blocks
    LensPlaces lens = place_parameters(problem.cameras[c].model, of, images[c] > 1);
    const auto known = std::find(out.kinds.begin(), out.kinds.end(), lens);
    lens.kind = static_cast<std::uint32_t>(known - out.kinds.begin());
    if (known == out.kinds.end()) {
      out.kinds.push_back(lens);
      out.kinds.back().kind = 0;  // compared without it
    }
    lens.first_block = out.num_blocks;
    out.num_blocks += lens.blocks;
    out.most_blocks = std::max<int>(out.most_blocks, lens.blocks);
    for (std::size_t j = 0; j < 2; ++j)
      out.most_width[j] = std::max(out.most_width[j], lens.width[j]);
    out.most_parameters =
        std::max(out.most_parameters, static_cast<int>(parameter_count(lens.model)));
    out.lenses.push_back(lens);
  }
}

/// The slots of one point, in the order in which its track meets the lenses.
class PointSlots {
 public:
  explicit PointSlots(const LensTracks& tracks) : tracks_(tracks) {}

  void clear() { blocks_.clear(); }
  const std::vector<std::int32_t>& blocks() const { return blocks_; }
  /// The row of the lens's first block, which is new if need be; 0 where it has none.
  std::uint16_t row_of(std::uint32_t lens) {
    const LensPlaces& places = tracks_.lenses[lens];
    if (places.blocks == 0) return 0;
    const auto first = static_cast<std::int32_t>(places.first_block);
    const auto found = std::find(blocks_.begin(), blocks_.end(), first);
    const auto row = static_cast<std::uint16_t>(found - blocks_.begin());
    if (found == blocks_.end())
      for (int j = 0; j < places.blocks; ++j) blocks_.push_back(first + j);
    return row;
  }

 private:
  const LensTracks& tracks_;
  std::vector<std::int32_t> blocks_;
};

/// What all eight entries are, or -1.
template <class T>
std::int32_t uniform(const T* of) {
  for (int l = 1; l < 8; ++l)
    if (of[l] != of[0]) return -1;
  return static_cast<std::int32_t>(of[0]);
}

void look_up_lenses(const Batches& batches, LensTracks& out, std::size_t g) {
  const Batches::Group& group = batches.groups[g];
  for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b) {
    std::uint32_t kinds[8];
    for (std::uint32_t l = 0; l < 8; ++l) {
      out.lens[8 * b + l] = out.image_lens[batches.image[8 * b + l]];
      kinds[l] = out.lenses[out.lens[8 * b + l]].kind;
    }
    out.uniform_lens[b] = uniform(&out.lens[8 * b]);
    out.uniform_kind[b] = uniform(kinds);
  }
}

/// Counts the group's rows of slots; with `fill`, writes them.
std::uint32_t assign_slots(const Batches& batches, LensTracks& out, std::size_t g, bool fill,
                           PointSlots& slots) {
  const Batches::Group& group = batches.groups[g];
  std::uint32_t rows = 0;
  for (std::uint32_t l = 0; l < 8; ++l) {
    slots.clear();
    for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b) {
      const std::uint16_t row = slots.row_of(out.lens[8 * b + l]);
      if (fill) out.slot[8 * b + l] = row;
    }
    rows = std::max(rows, static_cast<std::uint32_t>(slots.blocks().size()));
    if (!fill || l >= group.lanes) continue;
    for (std::size_t s = 0; s < slots.blocks().size(); ++s)
      out.slot_block[8 * (out.first_slot[g] + s) + l] = slots.blocks()[s];
  }
  if (fill)
    for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b)
      out.uniform_slot[b] = uniform(&out.slot[8 * b]);
  return rows;
}

}  // namespace

LensTracks arrange_lenses(const Problem& problem, const Fixed& fixed, const Batches& batches,
                          Threads& threads) {
  LensTracks out;
  place_lenses(problem, fixed, out);
  const std::size_t groups = batches.groups.size();
  out.lens.allocate(8 * batches.num_batches());
  out.uniform_lens.allocate(batches.num_batches());
  out.uniform_kind.allocate(batches.num_batches());
  out.first_slot.assign(groups + 1, 0);
  threads.for_ranges(groups, kGroupsPerTask, [&](std::size_t g, std::size_t end) {
    PointSlots slots(out);
    for (; g < end; ++g) {
      look_up_lenses(batches, out, g);
      if (out.most_blocks > 0) out.first_slot[g + 1] = assign_slots(batches, out, g, false, slots);
    }
  });
  for (std::size_t g = 0; g < groups; ++g) out.first_slot[g + 1] += out.first_slot[g];
  out.slot_block.allocate(8 * out.first_slot.back());
  out.slot_block.fill(-1);
  if (out.most_blocks == 0) return out;
  out.slot.allocate(8 * batches.num_batches());
  out.uniform_slot.allocate(batches.num_batches());
  threads.for_ranges(groups, kGroupsPerTask, [&](std::size_t g, std::size_t end) {
    PointSlots slots(out);
    for (; g < end; ++g) assign_slots(batches, out, g, true, slots);
  });
  return out;
}

}  // namespace sheaf
