// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <string>

#include "exit_code.h"
#include "interrupt.h"
#include "options/photometric_options.h"
#include "photometric/photometric_document.h"
#include "photometric/photometric_outputs.h"
#include "progress.h"
#include "sheaf/sheaf.h"
#include "step_log.h"
#include "summary_text.h"
#include "terminal.h"
#include "timer.h"
#include "verb.h"

namespace sheaf {
namespace {

struct Arguments {
  CommonOptions common;
  PhotometricArguments photometric;
  PhotometricOutputArguments outputs;
  std::string in;
};

std::string summary_text(const PhotometricSummary& summary, const PhotometricDetails& details) {
  const Summary& s = summary.solve;
  std::string out;
  out += fmt::format("patches     {} of {} seen at the start, {} of these left at the end\n",
                     summary.patches_visible, summary.patches_total, summary.patches_left);
  out += fmt::format("cost        {:.9e} -> {:.9e}\n", s.initial_cost, s.final_cost);
  if (s.loss != LossKind::none && !s.rounds.empty())
    out += fmt::format("loss        {}, scale {:.4g} grey levels\n", to_string(s.loss),
                       s.rounds.back().scale_px);
  out += fmt::format("rms         {:.5g} -> {:.5g} grey levels\n", summary.initial_rms_grey,
                     summary.final_rms_grey);
  out += fmt::format("median      {:.5g} -> {:.5g} grey levels\n", summary.initial_median_grey,
                     summary.final_median_grey);
  out += fmt::format("inliers     {:.1f}% -> {:.1f}% of the pixels within 10 grey levels\n",
                     100 * summary.initial_inlier_share, 100 * summary.final_inlier_share);
  out += fmt::format("sigma       a pixel {:.3g} grey levels, {} {:.3g} (median)\n",
                     details.sigma_grey, details.of_inverse_depth ? "an inverse depth" : "a point",
                     median_sigma(details));
  if (summary.measurements > 0)
    out += fmt::format("anchor      {} measured positions, rms {:.5g} -> {:.5g} px\n",
                       summary.measurements, summary.initial_rms_px, summary.final_rms_px);
  out += fmt::format("iterations  {}\n", s.iterations.empty() ? 0 : s.iterations.size() - 1);
  out += checkpoints_text(s);
  out += fmt::format("stopped     {}\n", s.words);
  out +=
      fmt::format("memory      {:.0f} MB forecast\n", 1e-6 * static_cast<double>(s.forecast_bytes));
  out += fmt::format("time        set-up {:.3f} s, solve {:.3f} s; {}, {} thread{}\n", s.setup_s,
                     s.solve_s, s.simd, s.threads, s.threads == 1 ? "" : "s");
  return out;
}

// An image that shows no patch, nor holds one that another image shows, tells nothing and is told
// nothing of.
std::vector<std::string> images_without_patches(const PhotometricFolder& folder,
                                                const PhotometricDetails& details) {
  const PhotometricProblem& problem = folder.problem;
  std::vector<bool> shows(problem.images.size(), false);
  for (const PatchSight& sight : details.seen) {
    shows[sight.image] = true;
    if (problem.has_hosts()) shows[problem.host[sight.point]] = true;
  }
  std::vector<std::string> out;
  for (std::size_t i = 0; i < shows.size(); ++i)
    if (!shows[i])
      out.push_back(i < folder.files.size()
                        ? fmt::format("{} ({})", i, folder.files[i].filename().string())
                        : fmt::format("{}", i));
  return out;
}

// A checkpoint that is gone on from may be the one that is written.
PhotometricOutputs outputs_for(const Arguments& arguments) {
  const PhotometricOptions& options = arguments.photometric.options;
  return PhotometricOutputs(
      arguments.outputs, {{"--json", arguments.common.json}, {"--checkpoint", options.checkpoint}},
      {arguments.in, arguments.photometric.read.images.string(),
       options.resume != options.checkpoint ? options.resume : ""});
}

void say(const std::string& in, const PhotometricFolder& folder, const PhotometricSummary& summary,
         const PhotometricDetails& details) {
  print_out("{}: {} images, {} points\n", in, folder.problem.images.size(),
            folder.problem.num_points());
  for (const std::string& note : folder.notes) print_out("note        {}\n", note);
  for (const std::string& image : images_without_patches(folder, details))
    print_out("note        no patch is seen in image {}: nothing holds its pose\n", image);
  print_text(summary_text(summary, details));
}

int run(Arguments& arguments) {
  const Timer total;
  Interrupt interrupt(arguments.common.quiet);
  PhotometricOptions options = arguments.photometric.options;
  PhotometricOutputs outputs = outputs_for(arguments);
  interrupt.limit(options.time_limit_s);
  PhotometricFolder folder = read_photometric(arguments.in, arguments.photometric.read).value();
  std::optional<PoseErrors> before, after;
  if (!folder.given_poses.empty()) before = pose_errors(folder);
  PhotometricProblem& problem = folder.problem;
  Progress progress(arguments.common.quiet,
                    {options.max_iterations, options.tolerance, interrupt.left_s()});
  StepLog log(arguments.outputs.log);
  options.threads = arguments.common.threads;
  options.stop = interrupt.token();
  options.on_iteration = [&](const Iteration& iteration) {
    progress.report(iteration);
    log.step(iteration);
    return true;
  };
  outputs.remember(problem, options);
  interrupt.begin_solve();
  progress.begin();
  options.time_limit_s = interrupt.left_s();
  const PhotometricSummary summary = refine_photometric(problem, options).value();
  interrupt.begin_write();
  progress.end();
  if (before) after = pose_errors(folder);
  const Timer writing;
  if (!summary.solve.rounds.empty()) options.loss.scale_px = summary.solve.rounds.back().scale_px;
  const PhotometricDetails details = examine_photometric(problem, options).value();
  if (summary.solve.usable()) outputs.write(folder, details, options);
  const double write_s = writing.seconds();
  say(arguments.in, folder, summary, details);
  if (before)
    print_out("poses       {:.4g} -> {:.4g} rad, centres {:.4g} -> {:.4g} from those given\n",
              before->rotation_rad, after->rotation_rad, before->center, after->center);
  for (std::size_t i = 0; i < problem.brightness.size(); ++i)
    print_out("image {:<5} a {:.4f}, b {:.3f}\n", i, problem.brightness[i].a,
              problem.brightness[i].b);
  if (!outputs.pictures().empty())
    print_out("pictures    {} in {}\n", outputs.pictures().size(), arguments.outputs.pictures);
  if (!arguments.common.json.empty() || outputs.wants_page()) {
    const PhotometricRecord record{
        arguments.in,       folder.format, options_json(options_of(arguments.photometric)),
        outputs.pictures(), folder.read_s, write_s,
        total.seconds(),    before,        after};
    const Json document = photometric_json(record, summary, details, problem);
    if (!arguments.common.json.empty()) write_json(document, arguments.common.json);
    outputs.write_page(folder, details,
                       document.dump(-1, ' ', false, Json::error_handler_t::replace),
                       std::filesystem::path(arguments.in).filename().string());
  }
  log.end(summary.solve);
  return exit_code_of(summary.solve.termination);
}

}  // namespace

Verb photometric_verb() {
  using F = FieldsOf<Arguments>;
  auto a = std::make_shared<Arguments>();
  Verb verb{"photometric", "refine poses and points from the pixels of images",
            "Example:\n  sheaf photometric scene -o refined --pictures pictures --ply refined.ply\n"
            "\nRGB-D images, depths as measured, from coarse to fine:\n"
            "  sheaf photometric rgbd --intrinsics 525,525,319.5,239.5 --fix points --levels 4 -o "
            "refined\n"
            "\nA COLMAP model with its images:\n"
            "  sheaf photometric sparse/0 --images images -o refined\n"
            "\nA scene to try it on:\n  sheaf generate scene --photometric"};
  verb.places = bound<Arguments>(
      {F::text(&Arguments::in,
               {.name = "IN",
                .placeholder = "FOLDER",
                .help = "folder of images with poses and points, of RGB-D images with poses, or of "
                        "a COLMAP model of pinholes (told by its files: docs/photometric.md)"})},
      *a);
  verb.options =
      joined({options_of(a->outputs), own(options_of(a->photometric)), options_of(a->common)});
  verb.run = [a] { return run(*a); };
  return verb;
}

}  // namespace sheaf
