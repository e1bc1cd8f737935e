// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <map>

#include "geometry/camera_model.h"
#include "io/colmap_rigs.h"
#include "io/format.h"
#include "scene/camera_frame.h"
#include "scene/source_files.h"
#include "sheaf/io.h"

namespace sheaf {
namespace {

using Sentences = std::vector<std::string>;

bool shares_lenses(const Problem& problem) { return problem.cameras.size() < problem.num_images(); }

bool states_sizes(const Problem& problem) {
  return std::any_of(problem.cameras.begin(), problem.cameras.end(),
                     [](const Camera& c) { return c.width_px > 0; });
}

/// Features that nothing observes.
std::size_t idle_features(const Problem& problem) {
  if (!problem.metadata || problem.metadata->feature_begin.empty()) return 0;
  return problem.metadata->feature_begin.back() - problem.num_observations();
}

void add_lens_losses(const FormatHolds& holds, const Problem& problem, Sentences& out) {
  if (!holds.shared_lenses && shares_lenses(problem))
    out.push_back("lenses that images share (" + std::to_string(problem.cameras.size()) + " for " +
                  std::to_string(problem.num_images()) + " images) are written for each image");
  if (!holds.sizes && states_sizes(problem)) out.push_back("the size of the images is not written");
  if (!holds.principal_points && !has_only_bal_cameras(problem))
    out.push_back("measurements count from the principal point, which is not written itself");
}

/// Images that no rig took, of a problem in which some were.
std::size_t images_of_no_rig(const Rigs& rigs) {
  return static_cast<std::size_t>(
      std::count(rigs.image_frame.begin(), rigs.image_frame.end(), Rigs::kNone));
}

void add_rig_losses(bool colmap, const Problem& problem, Sentences& out) {
  const SourceFiles* source = problem.metadata ? problem.metadata->source.get() : nullptr;
  const ColmapRigs had = source ? parse_rigs(*source) : ColmapRigs();
  if (!colmap) {
    if (!had.empty() || !problem.rigs.empty()) out.push_back("rigs and frames are not written");
    return;
  }
  if (problem.rigs.empty() && !are_trivial(had))
    out.push_back("rigs and frames are not written: the problem has none any more");
  if (const std::size_t count = images_of_no_rig(problem.rigs); count > 0)
    out.push_back(std::to_string(count) +
                  " images of no rig are written as frames of their own, as COLMAP wants each "
                  "image in a frame: of the rig that has their camera, or of one for each camera");
}

/// COLMAP reads a name in its text form up to the first blank; Sheaf reads on to the line's end.
void add_cut_names(const Problem& problem, Sentences& out) {
  if (problem.metadata == nullptr) return;
  const std::vector<std::string>& names = problem.metadata->image_names;
  const auto cut = std::count_if(names.begin(), names.end(), [](const std::string& name) {
    return name.find_first_of(" \t") != name.npos;
  });
  if (cut > 0)
    out.push_back(std::to_string(cut) +
                  " image names have blanks, at which COLMAP cuts a name in its text form: its "
                  "binary form (--format colmap) keeps them");
}

/// Of models that COLMAP does not have.
void add_unnumbered_lenses(bool text, const Problem& problem, Sentences& out) {
  std::map<CameraModel, std::size_t> counts;
  for (const Camera& camera : problem.cameras)
    if (camera.model != CameraModel::bal && colmap_id(camera.model) < 0) ++counts[camera.model];
  for (const auto& [model, count] : counts) {
    const std::string lenses =
        std::to_string(count) + " lenses are " + std::string(to_string(model));
    if (text)
      out.push_back(lenses + ", a model that COLMAP itself does not have and does not read");
    else if (model == CameraModel::ucm)
      out.push_back(lenses + ", which COLMAP has as EUCM with beta = 1: they are written so");
    else if (model == CameraModel::radial_k3)
      out.push_back(lenses +
                    ", which COLMAP has as FULL_OPENCV with fx = fy and p1, p2, k4, k5, k6 "
                    "= 0: they are written so");
  }
}

void add_term_losses(const Problem& problem, Sentences& out) {
  if (!problem.observation_sigma.empty()) out.push_back("sigmas of observations are not written");
  const Terms& terms = problem.terms;
  const std::size_t priors =
      terms.centres.size() + terms.points.size() + terms.distances.size() + terms.gaussians.size();
  if (priors > 0)
    out.push_back(std::to_string(priors) +
                  " priors (of centres, points, distances and Gaussians) are not written");
}

}  // namespace

Sentences lost_in(const std::string& format, const Problem& problem) {
  Sentences out;
  const SceneMetadata* m = problem.metadata.get();
  const bool colmap = format.starts_with("colmap");
  add_rig_losses(colmap, problem, out);
  add_term_losses(problem, out);
  if (colmap && m && m->source && m->source->listed_images > problem.num_images())
    out.push_back("images that were never placed are not written");
  if (format == "colmap-text") add_cut_names(problem, out);
  if (colmap) add_unnumbered_lenses(format == "colmap-text", problem, out);
  const FileFormat* known = format_named(format);
  if (colmap || known == nullptr) return out;
  const FormatHolds& holds = known->holds;
  if (format == "ply") {
    out.push_back("only points, colours and the cameras' places are written, in single precision");
    return out;
  }
  if (!holds.observations)
    out.push_back("observations are not written, and points in single precision");
  if (!holds.doubles) out.push_back("numbers are written in single precision");
  add_lens_losses(holds, problem, out);
  const std::size_t idle = idle_features(problem);
  if (idle > 0 && !holds.idle_features)
    out.push_back(std::to_string(idle) + " features that observe no point are not written");
  const bool ids = m && ((!m->point_ids.empty() && !holds.point_ids) ||
                         (!m->camera_ids.empty() && !holds.camera_ids));
  const auto list = [&](bool there, const char* what) {
    if (there) out.push_back(std::string(what) + " not written");
  };
  list(m && !m->image_names.empty() && !holds.names, "image names are");
  list(ids, "ids are");
  list(m && !m->point_colours.empty() && !holds.colours, "colours are");
  return out;
}

}  // namespace sheaf
