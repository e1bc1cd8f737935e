// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
//
// sheaf-mpi: `solve` of a scene in pieces, by as many ranks as mpirun starts. The first rank alone
// speaks; what all ranks find wrong is said once and is the exit code, what one rank alone cannot
// do ends all of them.
#include <fcntl.h>
#include <fmt/format.h>
#include <petscsys.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "command_line.h"
#include "distributed/distributed_system.h"
#include "distributed/petsc_check.h"
#include "exit_code.h"
#include "interrupt.h"
#include "json_document.h"
#include "options/solve_options.h"
#include "outputs.h"
#include "piece_folder.h"
#include "platform/memory.h"
#include "progress.h"
#include "solve/loss_rounds.h"
#include "summary_text.h"
#include "terminal.h"
#include "timer.h"
#include "verb.h"

namespace sheaf {
namespace {

struct Arguments {
  CommonOptions common;
  SolveArguments solve;
  std::string in, out, petsc;
};

bool names_one(const std::vector<std::string>& words) {
  return std::any_of(words.begin(), words.end(),
                     [](const std::string& word) { return word.find('=') != word.npos; });
}

DistributedOptions options_for(const Arguments& a) {
  DistributedOptions out{a.solve.options, {}};
  out.solve.threads = a.common.threads > 0 ? a.common.threads : 1;
  const RefinementArguments& refinement = a.solve.refinement;
  if (!refinement.given()) return out;
  if (names_one(refinement.fix) || names_one(refinement.refine))
    throw Error(ErrorCode::usage, "--fix and --refine hold or free all of a kind on several "
                                  "machines, not single images or lenses");
  out.fixed = [refinement](const Problem& problem) -> Result<Fixed> {
    const Result<Refinement> told = refinement_of(refinement, problem);
    if (!told.ok()) return told.error();
    return fixed_of(told.value(), problem);
  };
  return out;
}

/// What concerns files that are not a piece's own is the first rank's to do: ranks that look at one
/// folder at once get into each other's way. What it finds wrong all throw, so that nobody waits for
/// a rank that has left.
template <class Task>
void on_first_rank(const Task& task) {
  int rank = 0, code = -1;
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  std::string failed;
  if (rank == 0) {
    try {
      task();
    } catch (const Error& error) {
      failed = error.what();
      code = static_cast<int>(error.code());
    }
  }
  MPI_Bcast(&code, 1, MPI_INT, 0, PETSC_COMM_WORLD);
  if (code < 0) return;
  int size = static_cast<int>(failed.size());
  MPI_Bcast(&size, 1, MPI_INT, 0, PETSC_COMM_WORLD);
  failed.resize(static_cast<std::size_t>(size));
  MPI_Bcast(failed.data(), size, MPI_CHAR, 0, PETSC_COMM_WORLD);
  throw Error(static_cast<ErrorCode>(code), failed);
}

std::uint32_t agreed_pieces(const std::string& folder) {
  int ranks = 1;
  MPI_Comm_size(PETSC_COMM_WORLD, &ranks);
  unsigned pieces = 0;
  on_first_rank([&] { pieces = count_pieces(folder).value(); });
  MPI_Bcast(&pieces, 1, MPI_UNSIGNED, 0, PETSC_COMM_WORLD);
  if (static_cast<unsigned>(ranks) > pieces)
    throw Error(ErrorCode::usage, fmt::format("found {} ranks for {} pieces, expected no more "
                                              "ranks than pieces",
                                              ranks, pieces));
  return pieces;
}

/// What stops a run is asked of all ranks, so that all stop at the same step.
struct AgreedStop {
  const Ranks& ranks;
  StopToken token;
  double limit_s;
  const Stopwatch& clock;
  bool stopped = false, late = false;

  bool operator()() {
    stopped = ranks.any(token.stop_requested());
    late = ranks.any(clock.seconds() >= limit_s);
    return stopped || late;
  }
};

Summary solve_pieces(DistributedSystem& system, const Ranks& ranks, SolveOptions options,
                     const Interrupt& interrupt, Progress& progress) {
  const Stopwatch clock;
  AgreedStop stop{ranks, interrupt.token(), interrupt.left_s(), clock};
  options.stop = {};
  options.time_limit_s = std::numeric_limits<double>::infinity();
  if (options.initial_damping == 0) options.initial_damping = default_damping(system.images());
  options.on_iteration = [&](const Iteration& iteration) {
    progress.report(iteration);
    return !stop();
  };
  Summary summary;
  summary.threads = options.threads;
  summary.solver = "iterative-implicit";
  minimize_in_rounds(system, options, clock, summary);
  if (stop.late && !stop.stopped) {
    summary.termination = Termination::time_limit;
    summary.words = "the time limit was reached; the best state so far is kept";
  }
  const auto count = static_cast<double>(system.observations());
  summary.initial_rms_px = std::sqrt(2 * summary.initial_plain_cost / count);
  summary.final_rms_px = std::sqrt(2 * summary.final_plain_cost / count);
  return summary;
}

struct Costs {
  double total_s = 0, set_up_s = 0, solve_s = 0;
};

Json record_of(const Arguments& a, const DistributedSystem& system, const Ranks& ranks,
               const Summary& summary, const Costs& costs) {
  const auto whole = [&](double mine) { return ranks.max(mine); };
  const double peak = whole(static_cast<double>(peak_resident_bytes())),
               held = whole(static_cast<double>(system.bytes())),
               ghosts = whole(static_cast<double>(system.exchange().remote_ghosts())),
               sent = whole(static_cast<double>(system.exchange().bytes_sent()));
  return {{"version", SHEAF_VERSION},
          {"input", {{"path", a.in}}},
          {"ranks", ranks.count()},
          {"pieces", ranks.pieces()},
          {"problem",
           {{"images", system.images()},
            {"points", system.points()},
            {"observations", system.observations()}}},
          {"options", options_json(options_of(const_cast<Arguments&>(a).solve))},
          {"points", {{"reason", system.point_choice().reason}}},
          {"termination", to_string(summary.termination)},
          {"words", summary.words},
          {"initial_cost", summary.initial_cost},
          {"final_cost", summary.final_cost},
          {"rms_px", {{"before", summary.initial_rms_px}, {"after", summary.final_rms_px}}},
          {"iterations", iterations_json(summary)},
          {"most_of_a_rank",
           {{"remote_ghosts", ghosts},
            {"bytes_sent", sent},
            {"held_bytes", held},
            {"peak_bytes", peak}}},
          {"time",
           {{"set_up_s", costs.set_up_s},
            {"solve_s", costs.solve_s},
            {"total_s", costs.total_s}}}};
}

int run(const Arguments& a) {
  const Timer total;
  Interrupt interrupt(a.common.quiet);
  on_first_rank(
      [&] { check_outputs({{"-o", a.out, false, true}, {"--json", a.common.json}}, {}); });
  interrupt.limit(a.solve.options.time_limit_s);
  const DistributedOptions options = options_for(a);
  if (!a.petsc.empty()) petsc_check(PetscOptionsInsertString(nullptr, a.petsc.c_str()));
  const Ranks ranks(PETSC_COMM_WORLD, agreed_pieces(a.in));
  const bool speaks = ranks.rank() == 0;
  const Kernels& kernels = *choose_kernels(options.solve.simd).value();
  Threads threads(options.solve.threads);
  auto system = DistributedSystem::make(ranks, a.in, options, kernels, threads).value();
  Costs costs;
  costs.set_up_s = total.seconds();
  Progress progress(a.common.quiet || !speaks,
                    {options.solve.max_iterations, options.solve.tolerance, interrupt.left_s()},
                    system->observations());
  interrupt.begin_solve();
  progress.begin();
  const Timer solving;
  const Summary summary = solve_pieces(*system, ranks, options.solve, interrupt, progress);
  costs.solve_s = solving.seconds();
  progress.end();
  interrupt.begin_write();
  if (!a.out.empty() && summary.usable()) {
    on_first_rank([&] { make_piece_folder(a.out); });
    system->store(a.out).value();
    if (speaks) remove_other_pieces(a.out, ranks.pieces());
  }
  costs.total_s = total.seconds();
  const Json record = record_of(a, *system, ranks, summary, costs);
  print_out("{}: {} images, {} points, {} observations in {} pieces, {} ranks of {} threads\n", a.in,
            system->images(), system->points(), system->observations(), ranks.pieces(),
            ranks.count(), options.solve.threads);
  print_out("cost        {:.9e} -> {:.9e}, rms {:.4g} -> {:.4g} px\n", summary.initial_cost,
            summary.final_cost, summary.initial_rms_px, summary.final_rms_px);
  print_out("ended       {}: {}\n", to_string(summary.termination), summary.words);
  print_out("time        set-up {:.2f} s, solve {:.2f} s, {} steps\n", costs.set_up_s,
            costs.solve_s, steps_of(summary));
  if (!a.out.empty() && summary.usable()) print_out("wrote       {}\n", a.out);
  if (speaks && !a.common.json.empty()) write_json(record, a.common.json);
  return exit_code_of(summary.termination);
}

/// What one rank alone cannot do: the others are waiting for it.
int run_or_end_all(const Arguments& a, int errors) {
  try {
    return run(a);
  } catch (const Error&) {
    throw;
  } catch (const std::exception& error) {
    int rank = 0;
    MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
    const std::string text = fmt::format("sheaf-mpi: rank {}: {}\n", rank, error.what());
    (void)!::write(errors, text.data(), text.size());
    MPI_Abort(PETSC_COMM_WORLD, 5);
    return 5;
  }
}

int error_stream = STDERR_FILENO;

Verb solve_pieces_verb() {
  using F = FieldsOf<Arguments>;
  auto a = std::make_shared<Arguments>();
  Verb verb{"solve", "refine a scene that `sheaf split` has cut into pieces",
            "Example:\n  mpirun -n 2 sheaf-mpi solve pieces/ -o refined-pieces/\n"};
  verb.places = bound<Arguments>({F::text(&Arguments::in, {.name = "PIECES",
                                                           .placeholder = "FOLDER",
                                                           .help = "folder of the pieces"})},
                                 *a);
  verb.options =
      joined({bound<Arguments>(
                  {F::text(&Arguments::out, {.name = "output",
                                             .placeholder = "FOLDER",
                                             .help = "write the pieces with the refined state; "
                                                     "`sheaf join` puts them into the scene",
                                             .short_name = "o"}),
                   F::text(&Arguments::petsc, {.name = "petsc",
                                               .placeholder = "OPTIONS",
                                               .help = "for PETSc, as in \"-ksp_monitor "
                                                       "-log_view\""})},
                  *a),
              own(options_of(a->solve)), options_of(a->common)});
  verb.run = [a] { return run_or_end_all(*a, error_stream); };
  return verb;
}

std::vector<Verb> mpi_verbs() { return {solve_pieces_verb()}; }

}  // namespace
}  // namespace sheaf

int main(int argc, char** argv) {
  if (PetscInitializeNoArguments() != 0) return 1;
  PetscPopSignalHandler();
  int rank = 0;
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  if (rank != 0) {
    sheaf::error_stream = ::dup(STDERR_FILENO);
    const int nowhere = ::open("/dev/null", O_WRONLY);
    ::dup2(nowhere, STDOUT_FILENO);
    ::dup2(nowhere, STDERR_FILENO);
    ::close(nowhere);
  }
  const int code = sheaf::run_command_line(argc, argv, sheaf::mpi_verbs);
  PetscFinalize();
  return code;
}
