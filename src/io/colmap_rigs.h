// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "io/colmap.h"
#include "io/colmap_form.h"
#include "scene/source_files.h"

namespace sheaf {

class ColmapDraft;

/// What a sensor is, by the numbers of COLMAP's binary files; its text has the names.
enum class SensorType : std::int32_t { invalid = -1, camera = 0, imu = 1 };

/// sensor_from_rig of a rig's sensor, as the file states it: qw qx qy qz tx ty tz.
struct RigSensor {
  SensorType type = SensorType::camera;
  std::uint32_t id = 0;  ///< among the sensors of its type: of a camera, the camera's
  std::optional<std::array<double, 7>> pose{};  ///< of the reference: nothing
};

struct RigRecord {
  std::uint32_t id = 0;
  std::vector<RigSensor> sensors{};  ///< the first is the rig's reference
  std::uint64_t place = 0;           ///< line or byte
};

/// What one sensor measured in a frame; of a camera, an image.
struct FrameDatum {
  SensorType type = SensorType::camera;
  std::uint32_t sensor = 0;
  std::uint64_t id = 0;
  bool operator==(const FrameDatum&) const = default;
};

/// A moment at which a rig took its images.
struct FrameRecord {
  std::uint32_t id = 0, rig = 0;
  std::array<double, 7> pose{};  ///< rig_from_world, as stated
  std::vector<FrameDatum> data{};
  std::uint64_t place = 0;  ///< line or byte
};

/// The two files that came with COLMAP 3.12.
struct ColmapRigs {
  std::vector<RigRecord> rigs{};
  std::vector<FrameRecord> frames{};
  bool empty() const { return rigs.empty() && frames.empty(); }
};
Result<ColmapRigs> parse_rigs(const ColmapFiles& files);
/// Those of a model that was read; none where it was no COLMAP model.
ColmapRigs parse_rigs(const SourceFiles& source);

/// Gives the draft's images the poses that their frames and sensors say, and its problem rigs,
/// where some frame is more than one image by its rig's reference camera (else there is nothing to
/// tell images from those of no rig). Errors: unreadable_input, as COLMAP refuses: ids that occur
/// twice or nowhere, images in no frame or in two, a sensor without a pose whose images are there.
std::optional<Error> place_rigs(const ColmapFiles& files, const ColmapRigs& rigs,
                                ColmapDraft& draft);

/// The records of a problem: those of the files that it was read from, with the poses of now and
/// what its arrays have no place for, and new ones for what these do not know. Nothing at all for a
/// problem that knows of no rigs. Errors: usage, for sensors with several lenses and lenses with
/// several sensors in a rig.
Result<ColmapRigs> rigs_of(const ColmapForm& form, const ColmapRigs& source);

/// Whether each frame with images is one image by the reference camera of its rig. Problems have no
/// rigs for those: nothing tells their images from images of no rig.
bool are_trivial(const ColmapRigs& rigs);

std::string rigs_binary(const ColmapRigs& rigs);
std::string frames_binary(const ColmapRigs& rigs);
/// `source` is what was read, or empty; `before` its records. Lines that say the same are written
/// as they stood.
std::string rigs_text(const ColmapRigs& rigs, const std::string& source, const ColmapRigs& before);
std::string frames_text(const ColmapRigs& rigs, const std::string& source,
                        const ColmapRigs& before);

}  // namespace sheaf
