// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "io/byte_source.h"
#include "io/colmap_parts.h"
#include "io/colmap_rigs.h"

namespace sheaf {
namespace {

namespace fs = std::filesystem;

Error unreadable(const std::string& message) { return Error(ErrorCode::unreadable_input, message); }

std::optional<Error> load(const fs::path& path, std::string& bytes, bool may_be_empty = false) {
  Result<RawBytes> raw = RawBytes::open_regular(path);
  if (!raw.ok()) return raw.error();
  bytes.resize(*raw.value().size());
  const Result<std::size_t> n = raw.value().read(bytes.data(), bytes.size());
  if (!n.ok()) return n.error();
  bytes.resize(n.value());
  if (!bytes.empty() || may_be_empty) return {};
  return unreadable(path.string() + ": found an empty file, expected a part of a COLMAP model");
}

bool is_there(const fs::path& path) {
  std::error_code ignored;
  return fs::exists(path, ignored);
}

std::optional<Error> check_features(const ColmapFiles& files, const ColmapDraft& draft) {
  const auto unmatched = draft.unmatched();
  if (!unmatched) return {};
  const std::string where =
      files.text ? ":" + std::to_string(unmatched->place)
                 : ": byte " + std::to_string(unmatched->place + 24 * unmatched->feature);
  return unreadable(files.name("images") + where + ": " + unmatched->refusal);
}

}  // namespace

Result<ColmapFiles> load_colmap(const fs::path& folder) {
  ColmapFiles files;
  files.text = !is_there(folder / "cameras.bin") && is_there(folder / "cameras.txt");
  files.folder = (folder / "").string();
  if (!is_there(files.name("cameras"))) {
    std::string hint;
    for (const char* inner : {"sparse/0", "sparse", "0"})
      if (hint.empty() &&
          (is_there(folder / inner / "cameras.bin") || is_there(folder / inner / "cameras.txt")))
        hint = std::string("; there is one in ") + (folder / inner).string();
    return unreadable(folder.string() +
                      ": found a folder without cameras.bin or cameras.txt, expected a file or the "
                      "folder of a COLMAP model" +
                      hint);
  }
  if (auto e = load(files.name("cameras"), files.cameras)) return *e;
  if (auto e = load(files.name("images"), files.images)) return *e;
  // Of a model that has poses alone, COLMAP's own recipe makes an empty text of points.
  if (auto e = load(files.name("points3D"), files.points, files.text)) return *e;
  const bool rigs = is_there(files.name("rigs")), frames = is_there(files.name("frames"));
  if (rigs != frames)
    return unreadable(files.name(rigs ? "rigs" : "frames") + ": found without " +
                      files.name(rigs ? "frames" : "rigs") + ", expected both or neither");
  for (const auto& [stem, bytes] : {std::pair{"rigs", &files.rigs}, {"frames", &files.frames}})
    if (rigs)
      if (auto e = load(files.name(stem), *bytes, files.text)) return *e;
  for (const std::string* part :
       {&files.cameras, &files.images, &files.points, &files.rigs, &files.frames})
    files.bytes += part->size();
  return files;
}

Result<Problem> parse_colmap(const ColmapFiles& files) {
  ColmapDraft draft;
  const auto cameras = files.text ? read_cameras_text : read_cameras_binary;
  const auto images = files.text ? read_images_text : read_images_binary;
  const auto points = files.text ? read_points_text : read_points_binary;
  if (auto e = cameras(files.cameras, files.name("cameras"), draft)) return *e;
  if (auto e = images(files.images, files.name("images"), draft)) return *e;
  if (auto e = points(files.points, files.name("points3D"), draft)) return *e;
  if (auto e = check_features(files, draft)) return *e;
  const Result<ColmapRigs> rigs = parse_rigs(files);
  if (!rigs.ok()) return rigs.error();
  if (auto e = place_rigs(files, rigs.value(), draft)) return *e;
  SourceFiles source;
  source.format = files.text ? "colmap-text" : "colmap";
  source.rigs = files.rigs;
  source.frames = files.frames;
  if (files.text) {
    source.cameras = files.cameras;
    source.images = files.images;
    source.points = files.points;
  }
  return draft.take(std::move(source));
}

}  // namespace sheaf
