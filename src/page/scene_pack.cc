// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "page/scene_pack.h"

#include <zlib.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>

#include "page/html.h"
#include "platform/base64.h"
#include "platform/parallel.h"

namespace sheaf {
namespace {

/// Errors are coded by their logarithm: from a twentieth of sigma up to 200 sigmas in 255 steps.
constexpr double kLeast = 0.05, kSpan = 4000;

/// Arrays one behind the other, each byte of a number in a plane of its own: they compress better.
class Block {
 public:
  template <class Number>
  void add(const char* name, const char* type, const std::vector<Number>& numbers) {
    if (!index_.empty()) index_ += ',';
    index_ +=
        std::string("[\"") + name + "\",\"" + type + "\"," + std::to_string(numbers.size()) + "]";
    for (std::size_t byte = 0; byte < sizeof(Number); ++byte)
      for (const Number& number : numbers) {
        char bytes[sizeof(Number)];
        std::memcpy(bytes, &number, sizeof(Number));
        bytes_ += bytes[byte];
      }
  }
  const std::string& index() const { return index_; }
  const std::string& bytes() const { return bytes_; }

 private:
  std::string index_, bytes_;
};

Result<std::string> deflated(const std::string& bytes) {
  constexpr int kLevel = 6;
  uLongf size = compressBound(bytes.size());
  std::string out(size, '\0');
  if (compress2(reinterpret_cast<Bytef*>(out.data()), &size,
                reinterpret_cast<const Bytef*>(bytes.data()), bytes.size(), kLevel) != Z_OK)
    return Error(ErrorCode::memory_limit, "the report: no memory to compress the scene");
  out.resize(size);
  return out;
}

/// Points within reach, as many as may be drawn: those that are off, then each of a stride that
/// visits all in an order of which any beginning is a fair sample. Ascending.
std::vector<std::uint32_t> drawn_points(const PageScene& scene, const SceneView& view,
                                        std::size_t most) {
  std::vector<std::uint32_t> near;
  for (std::uint32_t p = 0; p < scene.num_points(); ++p) {
    const Vector3<double> at = view(result_point(scene, p));
    bool within = true;
    for (std::size_t k = 0; k < 3; ++k) within &= std::abs(at[k] - view.centre[k]) <= view.reach;
    if (within) near.push_back(p);
  }
  if (near.size() <= most) return near;
  std::vector<std::uint32_t> off, rest;
  for (const std::uint32_t p : near)
    (scene.after.point_rms[p] > 4 * scene.sigma && off.size() < most / 4 ? off : rest).push_back(p);
  std::size_t stride = std::max<std::size_t>(1, std::size_t(0.61803 * double(rest.size())));
  while (std::gcd(stride, rest.size()) > 1) ++stride;
  for (std::size_t k = 0, at = 0; off.size() < most && k < rest.size();
       ++k, at = (at + stride) % rest.size())
    off.push_back(rest[at]);
  std::sort(off.begin(), off.end());
  return off;
}

/// Bits that stand in the order of a float that is not below 0; what is not finite is the largest.
std::uint32_t ordered_bits(float e) {
  return std::bit_cast<std::uint32_t>(std::isfinite(e) ? e : std::numeric_limits<float>::max());
}

/// Numbers in the order of their keys, those of one key as they stood. Both are 32 bits and share a
/// word, which sorts several times faster than by looking keys up.
template <class Key>
void sort_by_key(std::vector<std::uint64_t>& numbers, const Key& key) {
  std::vector<std::uint64_t> words(numbers.size());
  for (std::size_t k = 0; k < words.size(); ++k)
    words[k] = std::uint64_t{key(numbers[k])} << 32 | std::uint32_t(k);
  std::sort(words.begin(), words.end());
  std::vector<std::uint64_t> sorted(numbers.size());
  for (std::size_t k = 0; k < words.size(); ++k) sorted[k] = numbers[std::uint32_t(words[k])];
  numbers = std::move(sorted);
}

/// Of one image, by point: observations of drawn points; of too many the worst quarter of the share
/// and an even sample of the rest.
std::vector<std::uint64_t> kept_of_image(const PageScene& scene,
                                         const std::vector<std::uint32_t>& place, std::size_t image,
                                         std::size_t share) {
  const Problem& p = scene.result;
  std::vector<std::uint64_t> own;
  for (std::uint64_t k = scene.begin[image]; k < scene.begin[image + 1]; ++k)
    if (place[p.observation_point[scene.order[k]]] != UINT32_MAX) own.push_back(scene.order[k]);
  if (own.size() > share) {
    sort_by_key(own, [&](std::uint64_t o) { return ~ordered_bits(scene.after.length[o]); });
    const std::size_t worst = share / 4;
    const double step = double(own.size() - worst) / double(share - worst);
    for (std::size_t k = worst; k < share; ++k)
      own[k] = own[worst + std::size_t(double(k - worst) * step)];
    own.resize(share);
  }
  sort_by_key(own, [&](std::uint64_t o) { return p.observation_point[o]; });
  return own;
}

/// Image by image; image i's begin at begin[i].
std::vector<std::uint64_t> kept_observations(const PageScene& scene,
                                             const std::vector<std::uint32_t>& place,
                                             std::size_t most, int threads,
                                             std::vector<std::uint64_t>& begin) {
  const std::size_t share =
      scene.order.size() <= most
          ? std::numeric_limits<std::size_t>::max()
          : std::max<std::size_t>(20, most / std::max<std::size_t>(1, scene.num_images()));
  std::vector<std::vector<std::uint64_t>> own(scene.num_images());
  Threads(threads).for_each(own.size(),
                            [&](std::size_t i) { own[i] = kept_of_image(scene, place, i, share); });
  std::vector<std::uint64_t> kept;
  begin.assign(1, 0);
  for (const std::vector<std::uint64_t>& of_image : own) {
    kept.insert(kept.end(), of_image.begin(), of_image.end());
    begin.push_back(kept.size());
  }
  return kept;
}

std::uint8_t coded(double value, double unit) {
  if (!std::isfinite(value)) return 255;
  const double steps = std::log(std::max(value / (kLeast * unit), 1.0)) / std::log(kSpan) * 254;
  return static_cast<std::uint8_t>(std::clamp(std::lround(steps), 0L, 254L));
}

void add_points(const PageScene& scene, const SceneView& view,
                const std::vector<std::uint32_t>& drawn, Block& block) {
  const auto coordinate = [&](const Vector3<double>& at, std::size_t k) {
    const double t = std::clamp((at[k] - view.centre[k]) / view.reach, -1.0, 1.0);
    return static_cast<std::uint16_t>(std::lround((t / 2 + 0.5) * 65535));
  };
  std::vector<std::uint16_t> after(3 * drawn.size()), before(after.size());
  for (std::size_t d = 0; d < drawn.size(); ++d) {
    const Vector3<double> a = view(result_point(scene, drawn[d]));
    const Vector3<double> b = view(start_point(scene, drawn[d]));
    for (std::size_t k = 0; k < 3; ++k) {
      after[k * drawn.size() + d] = coordinate(a, k);
      // As a difference, modulo 2^16: a quarter smaller than as itself.
      before[k * drawn.size() + d] =
          static_cast<std::uint16_t>(coordinate(b, k) - coordinate(a, k));
    }
  }
  block.add("pa", "u16", after);
  if (scene.has_start) block.add("pb", "u16", before);
}

void add_values(const PageScene& scene, const std::vector<std::uint32_t>& drawn,
                const std::vector<double>& sigma, double sigma_unit, Block& block) {
  std::vector<std::uint8_t> after, before, track, known, colours(3 * drawn.size());
  const SceneMetadata* told = scene.result.metadata.get();
  const bool coloured = told != nullptr && !told->point_colours.empty();
  const double unit = scene.sigma > 0 ? scene.sigma : 1;
  for (std::size_t d = 0; d < drawn.size(); ++d) {
    const std::uint32_t p = drawn[d];
    after.push_back(coded(scene.after.point_rms[p], unit));
    if (scene.has_start) before.push_back(coded(scene.before.point_rms[p], unit));
    track.push_back(static_cast<std::uint8_t>(std::min<std::uint32_t>(scene.track[p], 255)));
    if (!sigma.empty()) known.push_back(coded(sigma[p], sigma_unit));
    if (coloured)
      for (std::size_t k = 0; k < 3; ++k) colours[k * drawn.size() + d] = told->point_colours[p][k];
  }
  block.add("ea", "u8", after);
  if (scene.has_start) block.add("eb", "u8", before);
  block.add("tr", "u8", track);
  if (!sigma.empty()) block.add("sg", "u8", known);
  if (coloured) block.add("rgb", "u8", colours);
}

/// A pixel's residual in hundredths, -32768 where there is none.
std::int16_t hundredths(float r) {
  if (!std::isfinite(r)) return std::numeric_limits<std::int16_t>::min();
  return static_cast<std::int16_t>(std::clamp(std::lround(100 * double(r)), -32767L, 32767L));
}

void add_observations(const PageScene& scene, const std::vector<std::uint32_t>& place,
                      const std::vector<std::uint64_t>& kept,
                      const std::vector<std::uint64_t>& begin, Block& block) {
  const Problem& p = scene.result;
  const std::size_t n = kept.size();
  std::vector<std::uint32_t> point(n);
  std::vector<std::int16_t> pixel(2 * n), after(2 * n), before(scene.has_start ? 2 * n : 0);
  std::size_t image = 0;
  for (std::size_t k = 0; k < n; ++k) {
    while (k >= begin[image + 1]) ++image;
    const std::uint64_t o = kept[k];
    const std::uint32_t own = place[p.observation_point[o]];
    // The first of an image as it is, the others as steps.
    point[k] = k == begin[image] ? own : own - place[p.observation_point[kept[k - 1]]];
    const ImageFrame& frame = scene.frames[image];
    for (std::size_t j = 0; j < 2; ++j) {
      const double at = (p.observation_xy[2 * o + j] - frame.middle[j]) / frame.half[j];
      pixel[j * n + k] = static_cast<std::int16_t>(std::lround(std::clamp(at, -1.0, 1.0) * 32767));
    }
    after[k] = hundredths(scene.after.x[o]);
    after[n + k] = hundredths(scene.after.y[o]);
    if (!scene.has_start) continue;
    before[k] = hundredths(scene.before.x[o]);
    before[n + k] = hundredths(scene.before.y[o]);
  }
  block.add("op", "u32", point);
  block.add("ou", "i16", pixel);
  block.add("ra", "i16", after);
  if (scene.has_start) block.add("rb", "i16", before);
}

void add_frusta(const PageScene& scene, const SceneView& view, Block& block) {
  for (const bool start : {false, true}) {
    if (start && !scene.has_start) continue;
    std::vector<float> corners;
    for (std::size_t i = 0; i < scene.num_images(); ++i)
      for (const Vector3<double>& at : frustum(scene, view, i, start))
        for (const double x : at) corners.push_back(static_cast<float>(x));
    block.add(start ? "fb" : "fa", "f32", corners);
  }
}

std::vector<std::uint32_t> steps_of(const std::vector<std::uint32_t>& ascending) {
  std::vector<std::uint32_t> out;
  for (std::size_t i = 0; i < ascending.size(); ++i)
    out.push_back(i == 0 ? ascending[0] : ascending[i] - ascending[i - 1]);
  return out;
}

template <class Values>
std::string list(const Values& values, int significant = 5) {
  std::string out = "[";
  for (const auto& v : values) {
    if (out.size() > 1) out += ',';
    out += script_number(double(v), significant);
  }
  return out + "]";
}

/// The middle of the finite ones; what sigmas are coded and coloured by.
double typical(const std::vector<double>& values) {
  std::vector<float> known;
  for (const double v : values)
    if (std::isfinite(v) && v > 0) known.push_back(static_cast<float>(v));
  const double middle = quantile(known, 0.5);
  return middle > 0 ? middle : 1;
}

}  // namespace

Result<ScenePack> pack_scene(const PageScene& scene, const SceneView& view,
                             const std::vector<double>& point_sigma, const PackLimits& limits,
                             int threads) {
  const std::vector<std::uint32_t> drawn = drawn_points(scene, view, limits.points);
  std::vector<std::uint32_t> place(scene.num_points(), UINT32_MAX);
  for (std::size_t d = 0; d < drawn.size(); ++d) place[drawn[d]] = std::uint32_t(d);
  std::vector<std::uint64_t> begin;
  const std::vector<std::uint64_t> kept =
      kept_observations(scene, place, limits.observations, threads, begin);
  const double sigma_unit = typical(point_sigma);
  Block block;
  add_points(scene, view, drawn, block);
  // The panel calls points by the numbers that the file has.
  if (drawn.size() < scene.num_points()) block.add("of", "u32", steps_of(drawn));
  add_values(scene, drawn, point_sigma, sigma_unit, block);
  add_observations(scene, place, kept, begin, block);
  add_frusta(scene, view, block);
  Result<std::string> small = deflated(block.bytes());
  if (!small.ok()) return small.error();
  ScenePack pack;
  pack.data = base64(small.value());
  pack.points = drawn.size();
  pack.observations = kept.size();
  const std::vector<double> core = {view.core[0][0], view.core[0][1], view.core[0][2],
                                    view.core[1][0], view.core[1][1], view.core[1][2]};
  pack.meta = "\"index\":[" + block.index() + "],\"points\":" + std::to_string(drawn.size()) +
              ",\"images\":" + std::to_string(scene.num_images()) +
              ",\"start\":" + (scene.has_start ? "true" : "false") +
              ",\"reach\":" + script_number(view.reach, 9) +
              ",\"radius\":" + script_number(view.radius) + ",\"centre\":" + list(view.centre, 9) +
              ",\"core\":" + list(core, 9) + ",\"first\":" + list(begin, 12) +
              ",\"sigma\":" + script_number(scene.sigma) +
              ",\"least\":" + script_number(kLeast * (scene.sigma > 0 ? scene.sigma : 1)) +
              ",\"span\":" + script_number(kSpan);
  if (!point_sigma.empty()) pack.meta += ",\"known\":" + script_number(kLeast * sigma_unit);
  return pack;
}

}  // namespace sheaf
