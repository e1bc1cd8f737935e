// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "bindings.h"
#include "scene/source_files.h"

namespace sheaf {
namespace {

/// Of the bytes below; other numbers are refused.
constexpr std::uint32_t kVersion = 1;

/// Puts numbers, texts and lists of them behind one another, as this machine has them.
class Packer {
 public:
  static constexpr bool kReads = false;
  template <class... Fields>
  void operator()(const Fields&... fields) {
    (put(fields), ...);
  }
  std::string take() { return std::move(bytes_); }

 private:
  template <class Field>
  void put(const Field& field) {
    static_assert(std::is_trivially_copyable_v<Field>);
    bytes_.append(reinterpret_cast<const char*>(&field), sizeof(Field));
  }
  void put(const std::string& text) {
    put(static_cast<std::uint64_t>(text.size()));
    bytes_.append(text);
  }
  template <class Element>
  void put(const std::vector<Element>& list) {
    put(static_cast<std::uint64_t>(list.size()));
    if constexpr (std::is_trivially_copyable_v<Element>) {
      bytes_.append(reinterpret_cast<const char*>(list.data()), sizeof(Element) * list.size());
    } else {
      for (const Element& element : list) put(element);
    }
  }
  template <class First, class Second>
  void put(const std::pair<First, Second>& pair) {
    put(pair.first);
    put(pair.second);
  }
  void put(const std::filesystem::path& path) { put(path.string()); }
  void put(const GaussianPrior& prior);
  void put(const GaussianPrior::Block& block);

  std::string bytes_;
};

/// Takes them out again. Throws Error (unreadable_input) where the bytes end too early.
class Unpacker {
 public:
  static constexpr bool kReads = true;
  explicit Unpacker(std::string_view bytes) : left_(bytes) {}
  template <class... Fields>
  void operator()(Fields&... fields) {
    (take(fields), ...);
  }
  bool at_end() const { return left_.empty(); }

 private:
  void raw(void* to, std::uint64_t size) {
    if (size > left_.size())
      throw Error(ErrorCode::unreadable_input, "a pickled problem that ends too early");
    std::memcpy(to, left_.data(), size);
    left_.remove_prefix(size);
  }
  template <class Field>
  void take(Field& field) {
    static_assert(std::is_trivially_copyable_v<Field>);
    raw(&field, sizeof(Field));
  }
  std::uint64_t count(std::size_t each) {
    std::uint64_t out = 0;
    take(out);
    if (out > left_.size() / each)
      throw Error(ErrorCode::unreadable_input, "a pickled problem that ends too early");
    return out;
  }
  void take(std::string& text) {
    text.resize(count(1));
    raw(text.data(), text.size());
  }
  template <class Element>
  void take(std::vector<Element>& list) {
    if constexpr (std::is_trivially_copyable_v<Element>) {
      list.resize(count(sizeof(Element)));
      if (!list.empty()) raw(static_cast<void*>(list.data()), sizeof(Element) * list.size());
    } else {
      list.resize(count(1));
      for (Element& element : list) take(element);
    }
  }
  template <class First, class Second>
  void take(std::pair<First, Second>& pair) {
    take(pair.first);
    take(pair.second);
  }
  void take(std::filesystem::path& path) {
    std::string text;
    take(text);
    path = text;
  }
  void take(GaussianPrior& prior);
  void take(GaussianPrior::Block& block);

  std::string_view left_;
};

template <class Archive, class Prior>
void pass_prior(Archive& archive, Prior& prior) {
  archive(prior.blocks, prior.square_root, prior.mean, prior.loss);
}

template <class Archive, class Block>
void pass_block(Archive& archive, Block& block) {
  archive(block.kind, block.index, block.state);
}

void Packer::put(const GaussianPrior& prior) { pass_prior(*this, prior); }
void Packer::put(const GaussianPrior::Block& block) { pass_block(*this, block); }
void Unpacker::take(GaussianPrior& prior) { pass_prior(*this, prior); }
void Unpacker::take(GaussianPrior::Block& block) { pass_block(*this, block); }

template <class Archive, class P>
void pass_problem(Archive& archive, P& p) {
  auto& rigs = p.rigs;
  auto& terms = p.terms;
  archive(p.poses, p.image_camera, p.cameras, p.points, p.observation_image, p.observation_point,
          p.observation_xy, p.observation_sigma, p.bal_angle_axis);
  archive(rigs.count, rigs.sensor_from_rig, rigs.sensor_rig, rigs.is_reference, rigs.rig_from_world,
          rigs.frame_rig, rigs.image_frame, rigs.image_sensor);
  archive(terms.centres, terms.rotations, terms.gravities, terms.relative_poses, terms.parameters,
          terms.points, terms.distances, terms.gaussians, terms.bounds, terms.kept_points);
}

template <class Archive, class M>
void pass_metadata(Archive& archive, M& m) {
  archive(m.camera_ids, m.image_ids, m.image_names, m.point_ids, m.point_colours, m.point_errors_px,
          m.observation_feature, m.feature_begin, m.feature_xy, m.stated_rotations, m.rig_ids,
          m.frame_ids, m.sensor_ids, m.stale_poses, m.state_hash);
}

template <class Archive, class S>
void pass_source(Archive& archive, S& s) {
  archive(s.format, s.unknown_parameters, s.camera_names, s.feature_scales, s.root_members,
          s.image_members, s.camera_members, s.pose_ids, s.unplaced_views, s.normalised_xy,
          s.beside);
  archive(s.cameras, s.images, s.points, s.rigs, s.frames, s.listed_images, s.nvm_distortion,
          s.nvm_measured, s.centres, s.libmv_space);
}

void pack_source(Packer& pack, const SourceFiles* source) {
  pack(source != nullptr);
  if (source == nullptr) return;
  pass_source(pack, *source);
  pack(static_cast<std::uint64_t>(source->stated_poses.size()));
  for (const auto& [id, pose] : source->stated_poses) pack(id, pose);
}

std::shared_ptr<const SourceFiles> unpack_source(Unpacker& unpack) {
  bool there = false;
  unpack(there);
  if (!there) return nullptr;
  auto out = std::make_shared<SourceFiles>();
  pass_source(unpack, *out);
  std::uint64_t poses = 0;
  unpack(poses);
  for (std::uint64_t k = 0; k < poses; ++k) {
    std::uint32_t id = 0;
    StatedPose pose;
    unpack(id, pose);
    out->stated_poses.emplace(id, pose);
  }
  return out;
}

nb::bytes pack_problem(const ProblemHandle& held) {
  const ReadUse use(held, Validity::any);
  const Problem& p = use.problem();
  std::string bytes;
  {
    const nb::gil_scoped_release released;
    Packer pack;
    pack(kVersion);
    pass_problem(pack, p);
    pack(p.metadata != nullptr);
    if (p.metadata != nullptr) {
      pass_metadata(pack, *p.metadata);
      pack_source(pack, p.metadata->source.get());
    }
    pack(held->format, held->notes);
    bytes = pack.take();
  }
  return nb::bytes(bytes.data(), bytes.size());
}

void unpack_problem(HeldProblem* self, const nb::bytes& state) {
  Unpacker unpack(std::string_view(state.c_str(), state.size()));
  std::uint32_t version = 0;
  unpack(version);
  if (version != kVersion)
    throw Error(ErrorCode::unreadable_input, "a problem pickled in form " +
                                                 std::to_string(version) + ", expected form " +
                                                 std::to_string(kVersion));
  Problem p;
  pass_problem(unpack, p);
  bool has_metadata = false;
  unpack(has_metadata);
  if (has_metadata) {
    auto metadata = std::make_shared<SceneMetadata>();
    pass_metadata(unpack, *metadata);
    metadata->source = unpack_source(unpack);
    p.metadata = std::move(metadata);
  }
  std::string format;
  std::vector<std::string> notes;
  unpack(format, notes);
  if (!unpack.at_end())
    throw Error(ErrorCode::unreadable_input, "a pickled problem with bytes behind its end");
  validate(p).value();
  new (self) HeldProblem();
  self->problem = std::move(p);
  self->format = std::move(format);
  self->notes = std::move(notes);
}

}  // namespace

void bind_pickling(ProblemClass& problem) {
  problem.def("__getstate__", &pack_problem).def("__setstate__", &unpack_problem);
}

}  // namespace sheaf
