// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "interrupt.h"
#include "json_document.h"
#include "outputs.h"
#include "piece_folder.h"
#include "pieces/split_scene.h"
#include "read_input.h"
#include "sheaf/sheaf.h"
#include "summary_text.h"
#include "terminal.h"
#include "timer.h"
#include "verb.h"

namespace sheaf {
namespace {

struct SplitArguments {
  CommonOptions common;
  std::string in, out;
  int pieces = 8;
};

/// Above these a piece's work, or what it has of others, is worth a word.
constexpr double kUneven = 1.1, kManyGhosts = 1;

struct Ghosts {
  std::uint64_t all = 0, most = 0;
  double per_image = 0;  ///< of the piece that has most for its size
};

Ghosts ghosts_of(const SplitSummary& split) {
  Ghosts out;
  for (const SplitSummary::Piece& piece : split.pieces) {
    out.all += piece.ghosts;
    out.most = std::max(out.most, piece.ghosts);
    out.per_image =
        std::max(out.per_image, static_cast<double>(piece.ghosts) /
                                    static_cast<double>(std::max<std::uint64_t>(1, piece.images)));
  }
  return out;
}

Json pieces_json(const SplitSummary& split) {
  Json out = Json::array();
  for (const SplitSummary::Piece& piece : split.pieces)
    out.push_back({{"images", piece.images},
                   {"ghosts", piece.ghosts},
                   {"points", piece.points},
                   {"observations", piece.observations}});
  return out;
}

void say(const SplitArguments& a, const Problem& problem, const SplitSummary& split) {
  const Ghosts ghosts = ghosts_of(split);
  print_out("{}: {}\n", a.in, counts_text(problem));
  const auto [least, most] =
      std::minmax_element(split.pieces.begin(), split.pieces.end(),
                          [](const auto& x, const auto& y) { return x.images < y.images; });
  print_out("pieces      {}, {} to {} images, the largest has {:.3g} times the mean observations\n",
            split.pieces.size(), least->images, most->images, split.imbalance);
  print_out(
      "ghosts      {}, {} in the piece with most, {:.3g} for each of a piece's own images at "
      "most\n",
      ghosts.all, ghosts.most, ghosts.per_image);
  if (split.imbalance > kUneven)
    print_out("note        pieces are uneven: ranks wait for the largest; fewer pieces even out\n");
  if (ghosts.per_image > kManyGhosts)
    print_out(
        "note        some piece sees more images of others than of its own: larger pieces "
        "have less to tell each other\n");
}

int run(const SplitArguments& a) {
  const Timer total;
  Interrupt interrupt(a.common.quiet);
  check_outputs({{"OUT", a.out, false, true}, {"--json", a.common.json}}, {a.in});
  const InputFile input = read_input(a.in, a.common);
  const Problem& problem = input.problem;
  const Json before = input_json(a.in, input);
  const auto pieces = static_cast<std::uint32_t>(a.pieces);
  const std::vector<std::uint32_t> of_image = partition_images(problem, pieces).value();
  make_piece_folder(a.out);
  interrupt.begin_write();
  const SplitSummary split = split_scene(problem, of_image, pieces, [&](ScenePiece piece) {
                               return write_piece(piece, a.out);
                             }).value();
  remove_other_pieces(a.out, pieces);
  for (const std::string& note : input.notes) print_out("note        {}\n", note);
  say(a, problem, split);
  print_out("wrote       {}\n", a.out);
  if (a.common.json.empty()) return 0;
  write_json({{"version", SHEAF_VERSION},
              {"input", before},
              {"pieces", pieces_json(split)},
              {"imbalance", split.imbalance},
              {"output", {{"path", a.out}}},
              {"time", {{"read_s", input.read_s}, {"total_s", total.seconds()}}}},
             a.common.json);
  return 0;
}

struct JoinArguments {
  CommonOptions common;
  std::string in, pieces, out;
};

int run(const JoinArguments& a) {
  const Timer total;
  Interrupt interrupt(a.common.quiet);
  check_outputs({{"-o", a.out, true}, {"--json", a.common.json}}, {a.in, a.pieces});
  InputFile input = read_input(a.in, a.common);
  Problem& problem = input.problem;
  check_holds(problem, a.out);
  const Evaluation before = evaluate(problem);
  const std::uint32_t count = join_pieces(a.pieces, problem);
  const Evaluation after = evaluate(problem);
  interrupt.begin_write();
  if (!a.out.empty()) write(problem, a.out).value();
  print_out("{}: {}\n", a.in, counts_text(problem));
  for (const std::string& note : input.notes) print_out("note        {}\n", note);
  print_out("cost        {:.9e} -> {:.9e}, rms {:.4g} -> {:.4g} px, by the states of {} pieces\n",
            before.cost, after.cost, before.rms_px, after.rms_px, count);
  if (!a.out.empty()) print_out("wrote       {}\n", a.out);
  if (a.common.json.empty()) return 0;
  write_json({{"version", SHEAF_VERSION},
              {"pieces", count},
              {"initial_cost", before.cost},
              {"final_cost", after.cost},
              {"rms_px", {{"before", before.rms_px}, {"after", after.rms_px}}},
              {"time", {{"read_s", input.read_s}, {"total_s", total.seconds()}}}},
             a.common.json);
  return 0;
}

}  // namespace

Verb split_verb() {
  using F = FieldsOf<SplitArguments>;
  auto a = std::make_shared<SplitArguments>();
  Verb verb{"split", "cut a scene into pieces for several machines",
            "Example:\n  sheaf split problem.txt pieces/ --pieces 4\n"
            "\nWhat sheaf-mpi solve then takes, on up to so many ranks; docs/machines.md\n"};
  verb.places = bound<SplitArguments>(
      {F::text(&SplitArguments::in, problem_in()),
       F::text(&SplitArguments::out,
               {.name = "OUT", .placeholder = "FOLDER", .help = "folder of the pieces"})},
      *a);
  verb.options =
      joined({bound<SplitArguments>(
                  {F::whole(&SplitArguments::pieces,
                            {.name = "pieces",
                             .placeholder = "N",
                             .range = from(1),
                             .help = "how many; they fix the order of sums, so that any number "
                                     "of ranks up to it gives the same bits"})},
                  *a),
              options_of(a->common)});
  verb.run = [a] { return run(*a); };
  return verb;
}

Verb join_verb() {
  using F = FieldsOf<JoinArguments>;
  auto a = std::make_shared<JoinArguments>();
  Verb verb{"join", "put the states of pieces back into the scene that was split",
            "Example:\n  sheaf join problem.txt pieces/ -o problem-refined.txt\n"};
  verb.places = bound<JoinArguments>(
      {F::text(&JoinArguments::in, problem_in()),
       F::text(&JoinArguments::pieces, {.name = "PIECES",
                                        .placeholder = "FOLDER",
                                        .help = "folder of the pieces, of this very scene"})},
      *a);
  verb.options =
      joined({bound<JoinArguments>(
                  {F::text(&JoinArguments::out,
                           {.name = "output",
                            .placeholder = "OUT",
                            .help = std::string("write the refined problem; ") + kProblemOut,
                            .short_name = "o"})},
                  *a),
              options_of(a->common)});
  verb.run = [a] { return run(*a); };
  return verb;
}

}  // namespace sheaf
