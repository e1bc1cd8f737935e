// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "solve/structure.h"

#include "scene/source_files.h"
#include "solve/checkpoint_fields.h"

namespace sheaf {
namespace {

template <class Archive>
void add_structure(Archive& a, const Problem& p) {
  a(p.image_camera, p.observation_image, p.observation_point);
  a(static_cast<std::uint64_t>(p.num_points()), p.observation_sigma.empty());
  a(static_cast<std::uint64_t>(p.cameras.size()));
  for (const Camera& camera : p.cameras) a(camera.model);
  const SourceFiles* source = p.metadata ? p.metadata->source.get() : nullptr;
  if (source != nullptr) a(source->unknown_parameters);
  const Rigs& rigs = p.rigs;
  a(rigs.count, rigs.sensor_rig, rigs.is_reference, rigs.frame_rig, rigs.image_frame,
    rigs.image_sensor);
  a(p.terms);
}

}  // namespace

Structure::Structure(const Problem& problem) {
  ArchiveWriter a;
  add_structure(a, problem);
  bytes_ = a.bytes();
}

bool Structure::is_of(const Problem& problem) const {
  ArchiveComparison a(bytes_);
  add_structure(a, problem);
  return a.same();
}

}  // namespace sheaf
