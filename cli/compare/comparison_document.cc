// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "compare/comparison_document.h"

#include <fmt/format.h>

#include <algorithm>

#include "errors_document.h"

namespace sheaf {
namespace {

std::string label_of(const SolverRun& run) {
  return run.config.empty() ? run.solver : run.solver + ":" + run.config;
}

// Three figures that count; "-" for nothing.
std::string seconds_text(std::optional<double> seconds) {
  return seconds ? fmt::format("{:.3g}", *seconds) : "-";
}

std::string steps_text(int count, double seconds) {
  return count > 0 ? fmt::format("{} x {:.3g}", count, seconds) : "0";
}

using Row = std::vector<std::string>;

Row heading(const ComparisonRecord& record, bool errors) {
  Row row = {"solver"};
  for (const double tau : record.taus) row.push_back(fmt::format("to {:g}", tau));
  for (const char* name :
       {"accepted", "rejected", "total s", "CPU %", "peak MB", "final cost", "chi2"})
    row.push_back(name);
  if (errors)
    for (const char* name : {"rot rad", "trans", "centre", "point"}) row.push_back(name);
  return row;
}

Row line(const ComparisonRecord& record, const SolverRun& run) {
  Row row = {label_of(run)};
  if (!run.ran()) {
    row.push_back(run.failed);
    return row;
  }
  for (const double tau : record.taus)
    row.push_back(seconds_text(time_to(run.trace, record.best * (1 + tau))));
  const StepTimes steps = step_times(run.trace);
  row.push_back(steps_text(steps.accepted, steps.accepted_s));
  row.push_back(steps_text(steps.rejected, steps.rejected_s));
  row.push_back(seconds_text(run.total_s));
  row.push_back(fmt::format("{:.0f}", run.cpu_percent));
  row.push_back(fmt::format("{:.0f}", 1e-6 * static_cast<double>(run.peak_bytes)));
  row.push_back(fmt::format("{:.10g}{}", run.final_cost_independent, run.agrees() ? "" : " (!)"));
  row.push_back(fmt::format("{:.10g}", 2 * run.final_cost_independent));
  if (run.errors)
    for (const ErrorStatistics* e :
         {&run.errors->rotation_error_rad, &run.errors->translation_error,
          &run.errors->center_error, &run.errors->point_error})
      row.push_back(fmt::format("{:.3g}", e->mean));
  return row;
}

// The first column to the left, the others to the right; what is said of a run that failed may be
// as long as it is.
std::string aligned(const std::vector<Row>& rows) {
  std::vector<std::size_t> widths(rows[0].size(), 0);
  for (const Row& row : rows)
    for (std::size_t k = 0; k < row.size(); ++k)
      if (k == 0 || row.size() > 2) widths[k] = std::max(widths[k], row[k].size());
  std::string out;
  for (const Row& row : rows) {
    for (std::size_t k = 0; k < row.size(); ++k) {
      if (k == 0 || row.size() == 2)
        out += fmt::format("{:<{}}", row[k], widths[k]);
      else
        out += fmt::format("  {:>{}}", row[k], widths[k]);
      if (row.size() == 2 && k == 0) out += "  ";
    }
    out += "\n";
  }
  return out;
}

}  // namespace

std::string comparison_text(const ComparisonRecord& record) {
  const std::vector<std::size_t> shown = median_runs(record.runs);
  const bool errors = std::any_of(record.runs.begin(), record.runs.end(),
                                  [](const SolverRun& run) { return run.errors.has_value(); });
  const bool doubtful = std::any_of(record.runs.begin(), record.runs.end(),
                                    [](const auto& run) { return run.ran() && !run.agrees(); });
  const bool disturbed =
      record.threads == 1 && std::any_of(shown.begin(), shown.end(), [&](std::size_t i) {
        return record.runs[i].ran() && record.runs[i].cpu_percent < 90;
      });
  std::vector<Row> rows = {heading(record, errors)};
  for (const std::size_t i : shown) rows.push_back(line(record, record.runs[i]));
  std::string out = aligned(rows);
  out +=
      "'to TAU': seconds until the cost is within TAU of the best, set-up included; '-': never.\n"
      "accepted, rejected: steps x mean seconds. Costs: 1/2 sum |r|^2 of what the solver wrote, "
      "evaluated here; chi2 = sum |r|^2.\n";
  if (errors) out += "rot, trans, centre, point: mean errors against the reference.\n";
  if (disturbed)
    out +=
        "CPU below 90 % with one thread: other programs took the processor, these times are too "
        "long.\n";
  if (doubtful) out += "(!) the solver's own final cost differs by more than 1e-9.\n";
  return out;
}

std::string steps_table(const ComparisonRecord& record) {
  std::vector<const SolverRun*> shown;
  std::size_t longest = 0;
  for (const std::size_t i : median_runs(record.runs))
    if (record.runs[i].ran()) {
      shown.push_back(&record.runs[i]);
      longest = std::max(longest, shown.back()->trace.size());
    }
  std::vector<Row> rows = {{"step"}};
  for (const SolverRun* run : shown) rows[0].push_back(label_of(*run));
  for (std::size_t k = 0; k < longest; ++k) {
    Row row = {std::to_string(k)};
    for (const SolverRun* run : shown) {
      const CostTrace& trace = run->trace;
      if (k >= trace.size()) {
        row.push_back("");
      } else if (k == 0) {
        row.push_back(fmt::format("{:.10g}", 2 * trace[0].second));
      } else {
        const double seconds = trace[k].first - trace[k - 1].first;
        const bool accepted = trace[k].second != trace[k - 1].second;
        row.push_back(accepted ? fmt::format("{:.3g} s {:.10g}", seconds, 2 * trace[k].second)
                               : fmt::format("{:.3g} s rejected", seconds));
      }
    }
    rows.push_back(row);
  }
  return aligned(rows) + "Seconds of each step, chi2 = sum |r|^2 held after it.\n";
}

Json runs_json(const ComparisonRecord& record) {
  const std::vector<std::size_t> shown = median_runs(record.runs);
  Json out = Json::array();
  for (std::size_t i = 0; i < record.runs.size(); ++i) {
    const SolverRun& run = record.runs[i];
    const StepTimes steps = step_times(run.trace);
    const auto if_ran = [&](Json value) { return run.ran() ? value : Json(); };
    Json trace = Json::array(), times = Json::array();
    for (const auto& [seconds, cost] : run.trace) trace.push_back({seconds, number(cost)});
    for (const double tau : record.taus) {
      const auto seconds = time_to(run.trace, record.best * (1 + tau));
      times.push_back(Json::array({tau, seconds ? Json(*seconds) : Json()}));
    }
    out.push_back({{"solver", run.solver},
                   {"config", run.config},
                   {"threads", record.threads},
                   {"turn", run.turn},
                   {"median", std::find(shown.begin(), shown.end(), i) != shown.end()},
                   {"failed", run.ran() ? Json() : Json(run.failed)},
                   {"trace", trace},
                   {"time_to", times},
                   {"accepted", steps.accepted},
                   {"rejected", steps.rejected},
                   {"seconds_per_iteration", if_ran(number(steps.step_s))},
                   {"seconds_per_accepted", steps.accepted > 0 ? number(steps.accepted_s) : Json()},
                   {"seconds_per_rejected", steps.rejected > 0 ? number(steps.rejected_s) : Json()},
                   {"setup_s", if_ran(number(run.setup_s))},
                   {"total_s", if_ran(number(run.total_s))},
                   {"cpu_percent", if_ran(number(run.cpu_percent))},
                   {"peak_bytes", if_ran(run.peak_bytes)},
                   {"final_cost", if_ran(number(run.final_cost))},
                   {"final_cost_independent", if_ran(number(run.final_cost_independent))},
                   {"chi2_independent", if_ran(number(2 * run.final_cost_independent))},
                   {"agrees", if_ran(run.agrees())},
                   {"errors", run.errors ? errors_json(*run.errors) : Json()}});
  }
  return out;
}

}  // namespace sheaf
