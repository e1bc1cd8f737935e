// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <nanobind/stl/string.h>

#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "arrays.h"
#include "bindings.h"
#include "fork_safety.h"
#include "keyword_options.h"
#include "options/loss_option.h"
#include "options/solve_options.h"
#include "running.h"
#include "sheaf/solver.h"
#include "solve/checkpoint_fields.h"
#include "summary_object.h"

namespace sheaf {
namespace {

/// Problems are lent by nobody, and a solver that stays writes no checkpoints.
std::vector<BoundOption> own_options(SolveArguments& arguments) {
  return without(options_of(arguments),
                 {"lend-observations", "checkpoint", "checkpoint-every", "resume"});
}

std::string bytes_of(const Fixed& fixed) {
  ArchiveWriter a;
  a(fixed);
  return a.bytes();
}

/// A Solver and what its options were given as: what is held may be said by names and patterns,
/// which each problem has its own of.
class HeldSolver {
 public:
  explicit HeldSolver(const nb::kwargs& keywords) {
    nb::dict left = nb::cast<nb::dict>(keywords.attr("copy")());
    take_options(left, own_options(arguments_));
    check_all_taken(left, "Solver");
    asked_threads_ = arguments_.options.threads;
    arguments_.options.threads = threads_here(asked_threads_);
    arguments_.options.on_iteration = [this](const Iteration& iteration) {
      return run_->report(iteration) && !run_->token().stop_requested();
    };
    solver_.set_options(arguments_.options);
  }

  nb::object solve(const ProblemHandle& held, nb::object callback) {
    const std::unique_lock one(busy_, std::try_to_lock);
    if (!one.owns_lock())
      throw Error(ErrorCode::usage, "the solver is at work: one problem at a time");
    Run run(std::move(callback));
    WriteUse use(held);
    suit(use.problem());
    run_ = &run;
    const Summary* summary = nullptr;
    run.go([&] { summary = &solver_.solve(use.problem()); });
    nb::dict fields = fields_of(*summary);
    fields["survey"] = nb::none();
    return nb::module_::import_("sheaf._summary").attr("Summary")(**fields);
  }

  bool was_kept() const { return solver_.was_kept(); }
  void forget() { solver_.forget(); }

 private:
  /// What is held in this problem, and how many threads there are in this process.
  void suit(const Problem& problem) {
    SolveOptions& options = arguments_.options;
    Fixed fixed;
    if (arguments_.refinement.given())
      fixed = fixed_of(refinement_of(arguments_.refinement, problem).value(), problem);
    const int threads = threads_here(asked_threads_);
    if (threads == options.threads && bytes_of(fixed) == bytes_of(options.fixed)) return;
    options.threads = threads;
    options.fixed = std::move(fixed);
    solver_.set_options(options);
  }

  SolveArguments arguments_;
  int asked_threads_ = 0;
  Solver solver_;
  Run* run_ = nullptr;
  std::mutex busy_;
};

MarginaliseOptions marginalise_options(const nb::kwargs& keywords, const Problem& problem,
                                       const char* function) {
  nb::dict left = nb::cast<nb::dict>(keywords.attr("copy")());
  RefinementArguments refinement;
  const nb::object loss = left.attr("pop")("loss", nb::str("none"));
  take_options(left, bound(refinement_fields("what has no columns"), refinement));
  check_all_taken(left, function);
  MarginaliseOptions out;
  out.loss = parse_loss({"px"}, nb::cast<std::string>(loss)).value();
  if (refinement.given()) out.fixed = fixed_of(refinement_of(refinement, problem).value(), problem);
  return out;
}

nb::dict prior_object(const GaussianPrior& prior) {
  using Kind = GaussianPrior::Block::Kind;
  nb::list blocks;
  std::size_t columns = 0;
  for (const GaussianPrior::Block& block : prior.blocks) {
    const char* kind = block.kind == Kind::pose     ? "pose"
                       : block.kind == Kind::camera ? "camera"
                                                    : "point";
    blocks.append(nb::make_tuple(kind, block.index, array_of(block.state, {block.state.size()})));
    columns += block.kind == Kind::pose ? 6 : block.state.size();
  }
  nb::dict out;
  out["blocks"] = blocks;
  out["square_root"] =
      array_of(prior.square_root, {columns == 0 ? 0 : prior.square_root.size() / columns, columns});
  out["mean"] = array_of(prior.mean, {prior.mean.size()});
  return out;
}

nb::dict marginalise_problem(const ProblemHandle& held, nb::handle images, nb::handle points,
                             const nb::kwargs& keywords) {
  const std::vector<std::uint32_t> of_images = indices_from(images, "images");
  const std::vector<std::uint32_t> of_points = indices_from(points, "points");
  const ReadUse use(held);
  const MarginaliseOptions options = marginalise_options(keywords, use.problem(), "marginalise");
  Result<GaussianPrior> prior{GaussianPrior{}};
  Run().go([&] { prior = marginalise(use.problem(), of_images, of_points, options); });
  return prior_object(prior.value());
}

nb::dict slide_problem(const ProblemHandle& held, nb::handle images, nb::handle points,
                       const nb::kwargs& keywords) {
  const std::vector<std::uint32_t> of_images = indices_from(images, "images");
  const std::vector<std::uint32_t> of_points = indices_from(points, "points");
  WriteUse use(held);
  use.resize("slide");
  const MarginaliseOptions options = marginalise_options(keywords, use.problem(), "slide");
  Result<Slide> to{Slide{}};
  Run().go([&] { to = slide(use.problem(), of_images, of_points, options); });
  nb::dict out;
  out["image"] = array_of(to.value().image);
  out["camera"] = array_of(to.value().camera);
  out["point"] = array_of(to.value().point);
  return out;
}

#define SHEAF_MARGINALISE                                                             \
  "(problem: Problem, images: numpy.typing.ArrayLike, points: numpy.typing.ArrayLike" \
  ", *, loss: str = 'none', fix: collections.abc.Sequence[str] | str = (), "          \
  "refine: collections.abc.Sequence[str] | str = ()) -> "

void bind_marginals(nb::module_& module) {
  module.def("marginalise", &marginalise_problem, nb::arg("problem"), nb::arg("images"),
             nb::arg("points"), nb::arg("options"),
             nb::sig("def marginalise" SHEAF_MARGINALISE "dict[str, typing.Any]"),
             "What images and points that leave the problem say of those that stay, as keywords of "
             "Problem.add_gaussian_prior: blocks, square_root, mean. The problem is not touched. "
             "loss: of the solve, its scale given; fix, refine: as in solve (docs/windows.md).");
  module.def(
      "slide", &slide_problem, nb::arg("problem"), nb::arg("images"), nb::arg("points"),
      nb::arg("options"),
      nb::sig("def slide" SHEAF_MARGINALISE "dict[str, numpy.typing.NDArray[numpy.uint32]]"),
      "Takes images and points out of the problem, in place, and puts what marginalise makes "
      "of them in their place. Returns the new index of each old image, camera and point, "
      "2^32 - 1 of those that are gone.");
}

constexpr const char* kSolverText =
    R"(Solves problems of one structure again and again (docs/windows.md): threads, the arrangement
of observations and memory stay from one solve to the next. Arrays of the problem may have other
numbers each time; an observation with an infinite sigma is switched off.

Options, as docs/options.md has them:)";

}  // namespace

void bind_solver(nb::module_& module) {
  SolveArguments fresh;
  const std::vector<BoundOption> options = own_options(fresh);
  const std::string signature = signature_of("__init__", "self", {}, options, "None");
  const std::string text = kSolverText + help_of(options);
  nb::class_<HeldSolver>(module, "Solver", text.c_str())
      .def(
          "__init__",
          [](HeldSolver* self, const nb::kwargs& keywords) { new (self) HeldSolver(keywords); },
          nb::arg("options"), nb::sig(signature.c_str()))
      .def("solve", &HeldSolver::solve, nb::arg("problem"), nb::kw_only(),
           nb::arg("callback") = nb::none(),
           nb::sig("def solve(self, problem: Problem, *, callback: collections.abc.Callable"
                   "[[Iteration], bool | None] | None = None) -> sheaf._summary.Summary"),
           "Refines the problem in place, to the bits of sheaf.solve; callback as there.")
      .def("forget", &HeldSolver::forget, "Frees what is kept for the next solve.")
      .def_prop_ro("was_kept", &HeldSolver::was_kept, nb::sig("def was_kept(self) -> bool"),
                   "Whether the last solve found its arrangement and its memory kept.");
  bind_marginals(module);
}

}  // namespace sheaf
