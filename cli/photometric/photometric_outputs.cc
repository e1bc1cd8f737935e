// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "photometric/photometric_outputs.h"

#include <filesystem>

#include "io/folder_files.h"
#include "report/photometric_pictures.h"
#include "sheaf/solve.h"
#include "verb.h"

namespace sheaf {

std::vector<BoundOption> options_of(PhotometricOutputArguments& arguments) {
  using F = FieldsOf<PhotometricOutputArguments>;
  return bound<PhotometricOutputArguments>(
      {F::text(&PhotometricOutputArguments::out,
               {.name = "output",
                .placeholder = "FOLDER",
                .help = "folder for the refined state in the same format, with brightness.txt, "
                        "visibility.txt and sigma.txt",
                .short_name = "o"}),
       F::text(&PhotometricOutputArguments::ply,
               {.name = "ply",
                .placeholder = "FILE",
                .help = "also write start (grey) and result (in the images' colours), with "
                        "cameras, as one PLY"}),
       F::text(&PhotometricOutputArguments::pictures,
               {.name = "pictures",
                .placeholder = "FOLDER",
                .help = "folder for PNGs: the worst and the middle patches before and after, and a "
                        "map of residuals for each image"}),
       F::text(&PhotometricOutputArguments::log, log_of_steps())},
      arguments);
}

PhotometricOutputs::PhotometricOutputs(const PhotometricOutputArguments& arguments,
                                       const std::vector<NamedOutput>& others,
                                       const std::vector<std::string>& inputs)
    : arguments_(arguments) {
  std::vector<NamedOutput> all = {
      {.option = "-o", .path = arguments_.out, .folder = true},
      {.option = "--pictures", .path = arguments_.pictures, .folder = true},
      {"--ply", arguments_.ply},
      {"--log", arguments_.log}};
  all.insert(all.end(), others.begin(), others.end());
  check_outputs(all, inputs);
}

void PhotometricOutputs::remember(const PhotometricProblem& start,
                                  const PhotometricOptions& options) {
  if (!arguments_.ply.empty()) start_ = cloud_of(start);
  if (!arguments_.pictures.empty())
    stage_ = stage_of(start, options, examine_photometric(start, options).value());
}

void PhotometricOutputs::write(const PhotometricFolder& folder, const PhotometricDetails& details,
                               const PhotometricOptions& options) {
  const PhotometricProblem& problem = folder.problem;
  if (!arguments_.out.empty()) write_photometric(folder, arguments_.out, &details).value();
  if (start_)
    write_ply(*start_, coloured_cloud_of(folder, details.seen).value(), arguments_.ply).value();
  if (!stage_) return;
  const PatchComparison comparison =
      compare_patches(problem, options, std::move(*stage_), stage_of(problem, options, details))
          .value();
  pictures_ = write_pictures(comparison, problem.images, arguments_.pictures).value();
}

}  // namespace sheaf
