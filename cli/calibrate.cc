// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "covariance_document.h"
#include "exit_code.h"
#include "interrupt.h"
#include "json_document.h"
#include "options/loss_option.h"
#include "outputs.h"
#include "progress.h"
#include "projection_option.h"
#include "sheaf/sheaf.h"
#include "summary_text.h"
#include "terminal.h"
#include "timer.h"
#include "verb.h"

namespace sheaf {
namespace {

struct Arguments {
  CommonOptions common;
  ProjectionArguments projection;
  Loss loss;
  std::string in, out, board, size, camera = "OPENCV";
  double spacing = 0, focal = 0;
};

std::pair<std::uint32_t, std::uint32_t> two_of(const char* option, const std::string& text) {
  if (const auto sides = sides_of(text)) return *sides;
  throw Error(ErrorCode::usage, fmt::format("{}: found '{}', expected two whole numbers such as "
                                            "14x9",
                                            option, text));
}

Board board_of(const Arguments& arguments) {
  const auto [columns, rows] = two_of("--board", arguments.board);
  return {columns, rows, arguments.spacing};
}

Camera lens_of(const Arguments& arguments) {
  const std::optional<CameraModel> model = camera_model_named(arguments.camera);
  if (!model)
    throw Error(ErrorCode::usage,
                "--camera: found '" + arguments.camera + "', expected a model of docs/cameras.md");
  Camera out;
  out.model = *model;
  out.parameters = {arguments.focal};
  const auto [width, height] = two_of("--size", arguments.size);
  out.width_px = width;
  out.height_px = height;
  return out;
}

/// Distortion held in the first solve, as homographies know nothing of it; then all is free.
Summary refine(Problem& problem, const Arguments& arguments, const Interrupt& interrupt,
               Progress& progress) {
  SolveOptions options;
  options.fixed.points = true;
  options.threads = arguments.common.threads;
  options.loss = arguments.loss;
  options.stop = interrupt.token();
  options.max_iterations = 200;
  options.tolerance = 1e-12;
  options.on_iteration = [&](const Iteration& iteration) {
    progress.report(iteration);
    return true;
  };
  ParameterSet distortion = 0;
  const Camera& lens = problem.cameras[0];
  const auto names = parameter_names(lens.model);
  for (std::size_t k = 0; k < names.size(); ++k)
    if (!names[k].starts_with("f")) distortion = static_cast<ParameterSet>(distortion | 1U << k);
  options.fixed.parameters = {distortion};
  const Problem start = problem;
  Summary summary = try_solve(problem, options).value();
  if (!summary.usable()) problem = start;
  options.fixed.parameters = {0};
  return try_solve(problem, options).value();
}

struct Outcome {
  Timer total;
  double read_s = 0;
  std::vector<std::string> left_out;
  Summary summary;
  Covariance covariance;
  std::vector<LensProjection> projected;
};

Json document_of(const Arguments& arguments, const Problem& problem,
                 const CovarianceOptions& options, const Outcome& found) {
  const auto [columns, rows] = two_of("--board", arguments.board);
  Json document = covariance_json(problem, options, found.covariance);
  document["version"] = SHEAF_VERSION;
  document["input"] = {{"path", arguments.in}};
  document["board"] = {{"columns", columns}, {"rows", rows}, {"spacing", arguments.spacing}};
  document["views"] = problem.num_images();
  document["left_out"] = found.left_out;
  document["cost"] = number(found.summary.final_cost);
  document["rms_px"] = number(evaluate(problem).rms_px);
  document["iterations"] = found.summary.iterations.size();
  document["projection"] = projection_json(found.projected);
  document["time"] = {{"read_s", found.read_s},
                      {"covariance_s", found.covariance.seconds},
                      {"total_s", found.total.seconds()}};
  return document;
}

int run(const Arguments& arguments) {
  Interrupt interrupt(arguments.common.quiet);
  check_outputs({{"-o", arguments.out, true},
                 {"--json", arguments.common.json},
                 {"--projection", arguments.projection.csv},
                 {"--projection-figure", arguments.projection.figure}},
                {arguments.in});
  const Board board = board_of(arguments);
  Outcome found;
  const std::vector<BoardView> views = read_board_corners(arguments.in, board).value();
  found.read_s = found.total.seconds();
  Problem problem = calibration_of(board, views, lens_of(arguments), &found.left_out).value();
  check_holds(problem, arguments.out);
  Progress progress(arguments.common.quiet);
  interrupt.begin_solve();
  found.summary = refine(problem, arguments, interrupt, progress);
  progress.end();
  CovarianceOptions options;
  options.fixed.points = true;
  options.fixed.parameters = {0};
  options.lens_motions = true;
  options.threads = arguments.common.threads;
  if (arguments.loss.kind != LossKind::none)
    options.loss = {arguments.loss.kind, found.summary.rounds.back().scale_px};
  options.stop = interrupt.token();
  found.covariance = covariance(problem, options).value();
  interrupt.begin_write();
  const bool whole = found.covariance.ending == CovarianceEnding::whole;
  if (whole) found.projected = projections(arguments.projection, problem, found.covariance);
  print_out("{}: {}\n", arguments.in, counts_text(problem));
  for (const std::string& view : found.left_out)
    print_out("left out    view {}: too few corners, or in a line\n", view);
  print_text(summary_text(found.summary, 0));
  if (whole) {
    print_text(covariance_text(problem, options, found.covariance));
    print_text(projection_text(found.projected));
  } else {
    print_out("note        no sigmas, and nothing written of them: the run was cut short\n");
  }
  if (!arguments.out.empty() && found.summary.usable()) {
    write(problem, arguments.out).value();
    print_out("wrote       {}\n", arguments.out);
  }
  if (!whole) return kExitInterrupted;
  write_projections(arguments.projection, problem, found.projected);
  if (!arguments.common.json.empty())
    write_json(document_of(arguments, problem, options, found), arguments.common.json);
  return exit_code_of(found.summary.termination);
}

}  // namespace

Verb calibrate_verb() {
  using F = FieldsOf<Arguments>;
  auto a = std::make_shared<Arguments>();
  Verb verb{"calibrate", "find a lens from views of a flat board, and how well it is known",
            "Example:\n  sheaf calibrate corners.vnl --board 6x5 --spacing 0.14 --size 1600x1200 "
            "-o lens/\n"
            "\nA wide lens, and where on the image it is known how well, far away and at 2 m:\n"
            "  sheaf calibrate corners.vnl --board 6x5 --spacing 0.14 --size 1600x1200 \\\n"
            "    --camera OPENCV_FISHEYE --projection sigmas.csv --projection-figure sigmas.svg "
            "--distance 2"};
  verb.places = bound<Arguments>(
      {F::text(&Arguments::in,
               {.name = "CORNERS",
                .placeholder = "FILE",
                .help = "lines of image, x, y and perhaps the level of the pyramid that a corner "
                        "was found at, by rows of the board; - is a corner that was not found"})},
      *a);
  verb.options = joined(
      {bound<Arguments>(
           {F::text(
                &Arguments::board,
                {.name = "board", .placeholder = "COLUMNSxROWS", .help = "corners of the board"}),
            F::real(&Arguments::spacing, {.name = "spacing",
                                          .placeholder = "S",
                                          .range = above(0),
                                          .help = "of the board's corners, in the unit that poses "
                                                  "are to have"}),
            F::text(&Arguments::size,
                    {.name = "size", .placeholder = "WIDTHxHEIGHT", .help = "of the images (px)"}),
            F::text(&Arguments::camera, {.name = "camera",
                                         .placeholder = "MODEL",
                                         .help = "the lens's model (docs/cameras.md)"}),
            F::real(&Arguments::focal, {.name = "focal",
                                        .placeholder = "F",
                                        .unit = "px",
                                        .range = from(0),
                                        .help = "of the start; 0: tried"}),
            loss_field<Arguments>(&Arguments::loss, {"pixels", true, false},
                                  {.name = "loss", .help = "of corners that may be wrong"}),
            F::text(&Arguments::out, {.name = "output",
                                      .placeholder = "OUT",
                                      .help = "write lens, board and poses as a model; folder/",
                                      .short_name = "o"})},
           *a),
       options_of(a->projection), options_of(a->common)});
  verb.run = [a] { return run(*a); };
  return verb;
}

}  // namespace sheaf
