// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "page/run_record.h"

#include <cmath>

#include "chart/number_text.h"
#include "io/json_lines.h"

namespace sheaf {
namespace {

using Kind = JsonValue::Kind;

/// A member behind members; null where one of them is not there.
const JsonValue* find(const JsonValue& value, std::initializer_list<const char*> names) {
  const JsonValue* at = &value;
  for (const char* name : names) {
    if (at == nullptr || at->kind != Kind::object) return nullptr;
    at = at->find(name);
  }
  return at;
}

double number(const JsonValue& value, std::initializer_list<const char*> names) {
  const JsonValue* at = find(value, names);
  return at != nullptr && at->kind == Kind::number ? at->number : NAN;
}

std::string text(const JsonValue& value, std::initializer_list<const char*> names) {
  const JsonValue* at = find(value, names);
  return at != nullptr && at->kind == Kind::text ? at->text : "";
}

bool truth(const JsonValue& value, const char* name, bool otherwise) {
  const JsonValue* at = value.find(name);
  return at != nullptr && at->kind == Kind::boolean ? at->boolean : otherwise;
}

const std::vector<JsonValue>& list(const JsonValue& value,
                                   std::initializer_list<const char*> names) {
  static const std::vector<JsonValue> kNone;
  const JsonValue* at = find(value, names);
  return at != nullptr && at->kind == Kind::list ? at->items : kNone;
}

std::array<double, 3> three(const JsonValue& value, std::initializer_list<const char*> names) {
  const std::vector<JsonValue>& items = list(value, names);
  std::array<double, 3> out{};
  for (std::size_t k = 0; k < 3 && k < items.size(); ++k)
    if (items[k].kind == Kind::number) out[k] = items[k].number;
  return out;
}

std::string option_text(const JsonValue& value) {
  switch (value.kind) {
    case Kind::null:
      return "none";
    case Kind::boolean:
      return value.boolean ? "yes" : "no";
    case Kind::number:
      return tick_text(value.number);
    case Kind::text:
      return value.text.empty() ? "none" : value.text;
    case Kind::list: {
      std::string out;
      for (const JsonValue& item : value.items)
        out += (out.empty() ? "" : ", ") + option_text(item);
      return out.empty() ? "none" : out;
    }
    case Kind::object:
      break;
  }
  return "";
}

/// 0 where there is none, or none that can be counted.
int count(const JsonValue& value, const char* key) {
  const double found = number(value, {key});
  return found >= 0 && found < 1e9 ? static_cast<int>(found) : 0;
}

RunStep step_of(const JsonValue& value) {
  RunStep step;
  step.index = count(value, "index");
  step.cost = number(value, {"cost"});
  step.trial_cost = number(value, {"trial_cost"});
  step.gradient = number(value, {"gradient_max"});
  step.change = number(value, {"step_norm"});
  step.damping = number(value, {"damping"});
  step.gain = number(value, {"gain_ratio"});
  step.scale_px = number(value, {"scale_px"});
  step.time_s = number(value, {"time_s"});
  step.accepted = truth(value, "accepted", true);
  return step;
}

std::vector<RunSurveyResidual> residuals_of(const JsonValue& survey, const char* which) {
  std::vector<RunSurveyResidual> out;
  for (const JsonValue& value : list(survey, {"residuals", which})) {
    RunSurveyResidual r;
    r.name = text(value, {"name"});
    r.residual = three(value, {"residual"});
    r.sigma = three(value, {"sigma"});
    r.adjusted = three(value, {"adjusted"});
    r.worst_sigmas = number(value, {"worst_sigmas"});
    r.blunder = truth(value, "blunder", false);
    out.push_back(std::move(r));
  }
  return out;
}

std::optional<RunSurvey> survey_of(const JsonValue& run) {
  const JsonValue* value = find(run, {"survey"});
  if (value == nullptr || value->kind != Kind::object) return {};
  const JsonValue* residuals = value->find("residuals");
  if (residuals == nullptr || residuals->kind != Kind::object) return {};
  RunSurvey out;
  const std::string name = text(*value, {"frame", "name"}), kind = text(*value, {"frame", "kind"});
  out.frame = name.empty() ? kind : kind + ", " + name;
  out.world.kind = kind == "geodetic"    ? WorldKind::geodetic
                   : kind == "projected" ? WorldKind::projected
                                         : WorldKind::local;
  out.world.origin = three(*value, {"frame", "origin"});
  for (const JsonValue& words : list(*value, {"words"})) out.words.push_back(words.text);
  out.positions = residuals_of(*value, "positions");
  out.control = residuals_of(*value, "control");
  out.check = residuals_of(*value, "check");
  out.positions_rmse = three(*value, {"residuals", "positions_rmse"});
  out.control_rmse = three(*value, {"residuals", "control_rmse"});
  out.check_rmse = three(*value, {"residuals", "check_rmse"});
  return out;
}

void read_work(const JsonValue& json, RunRecord& run) {
  run.solver = text(json, {"solver", "name"});
  run.reason = text(json, {"solver", "reason"});
  run.precision = text(json, {"precision"});
  run.simd = text(json, {"simd"});
  const double threads = number(json, {"threads"});
  run.threads = threads >= 0 && threads < 1e9 ? static_cast<int>(threads) : 0;
  run.forecast_bytes = number(json, {"memory", "forecast_bytes"});
  run.peak_bytes = number(json, {"memory", "peak_bytes"});
  run.read_s = number(json, {"time", "read_s"});
  run.setup_s = number(json, {"time", "setup_s"});
  run.solve_s = number(json, {"time", "solve_s"});
  run.write_s = number(json, {"time", "write_s"});
  run.total_s = number(json, {"time", "total_s"});
}

}  // namespace

Result<RunRecord> read_run(const std::string& json, const std::string& name) {
  const Result<JsonValue> parsed = parse_json(json, name);
  if (!parsed.ok()) return parsed.error();
  const JsonValue& value = parsed.value();
  const JsonValue* iterations = find(value, {"iterations"});
  if (find(value, {"termination", "code"}) == nullptr || iterations == nullptr)
    return Error(ErrorCode::unreadable_input,
                 name +
                     ": found no \"termination\" and \"iterations\", expected the JSON of "
                     "'sheaf solve --json'");
  RunRecord run;
  if (find(value, {"rms_grey"}) != nullptr) run.unit = "grey levels";
  run.version = text(value, {"version"});
  run.command = text(value, {"command"});
  run.path = text(value, {"input", "path"});
  run.format = text(value, {"input", "format"});
  run.sha256 = text(value, {"input", "sha256"});
  run.bytes = number(value, {"input", "bytes"});
  if (const JsonValue* options = find(value, {"options"}))
    for (const JsonMember& member : options->members)
      run.options.emplace_back(member.name, option_text(member.value));
  read_work(value, run);
  run.initial_cost = number(value, {"initial_cost"});
  run.final_cost = number(value, {"final_cost"});
  run.loss = text(value, {"loss", "name"});
  run.loss_scale_px = number(value, {"loss", "scale_px"});
  run.code = text(value, {"termination", "code"});
  run.words = text(value, {"termination", "words"});
  for (const JsonValue& step : iterations->items) run.steps.push_back(step_of(step));
  run.recoveries = static_cast<int>(list(value, {"recoveries"}).size());
  run.survey = survey_of(value);
  return run;
}

}  // namespace sheaf
