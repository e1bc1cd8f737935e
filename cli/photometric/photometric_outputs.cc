// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "photometric/photometric_outputs.h"

#include <filesystem>

#include "io/folder_files.h"
#include "page/photometric_section.h"
#include "page/report.h"
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
       F::text(&PhotometricOutputArguments::report,
               {.name = "report",
                .placeholder = "FILE",
                .help = "show start and result as one page of HTML (docs/report.md)"}),
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
      {"--log", arguments_.log},
      {"--report", arguments_.report}};
  all.insert(all.end(), others.begin(), others.end());
  check_outputs(all, inputs);
}

void PhotometricOutputs::remember(const PhotometricProblem& start,
                                  const PhotometricOptions& options) {
  if (!arguments_.ply.empty()) start_ = cloud_of(start);
  if (wants_page()) cloud_ = cloud_of(start);
  if (!arguments_.pictures.empty() || wants_page())
    stage_ = stage_of(start, options, examine_photometric(start, options).value());
}

void PhotometricOutputs::write(const PhotometricFolder& folder, const PhotometricDetails& details,
                               const PhotometricOptions& options) {
  const PhotometricProblem& problem = folder.problem;
  if (!arguments_.out.empty()) write_photometric(folder, arguments_.out, &details).value();
  if (start_)
    write_ply(*start_, coloured_cloud_of(folder, details.seen).value(), arguments_.ply).value();
  if (!stage_) return;
  comparison_ =
      compare_patches(problem, options, std::move(*stage_), stage_of(problem, options, details))
          .value();
  if (!arguments_.pictures.empty())
    pictures_ = write_pictures(*comparison_, problem.images, arguments_.pictures).value();
}

void PhotometricOutputs::write_page(const PhotometricFolder& folder,
                                    const PhotometricDetails& details, const std::string& summary,
                                    const std::string& title) const {
  if (!comparison_ || !cloud_) return;
  const PhotometricPart part{&*comparison_, &folder.problem.images, &folder.problem.brightness};
  ReportOptions options;
  options.title = title;
  options.summary = summary;
  options.photometric = &part;
  write_report(&*cloud_, coloured_cloud_of(folder, details.seen).value(), arguments_.report,
               options)
      .value();
}

}  // namespace sheaf
