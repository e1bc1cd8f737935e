// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "run_record.h"

#include <sys/resource.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <sstream>

namespace peer {
namespace {

double wall_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

double cpu_s() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

/// From /proc: getrusage's figure starts at that of the program which launched this one.
long peak_bytes() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (line.rfind("VmHWM:", 0) == 0) return std::atol(line.c_str() + 6) * 1024L;
  return 0;
}

std::set<std::string> split(const std::string& text, char separator) {
  std::set<std::string> out;
  std::istringstream pieces(text);
  for (std::string piece; std::getline(pieces, piece, separator);) out.insert(piece);
  return out;
}

}  // namespace

bool parse_arguments(int argc, char** argv, Arguments& a) {
  bool good = true;
  for (int i = 1; i < argc; ++i) {
    const std::string name = argv[i];
    if (name == "--test") {
      a.test = true;
    } else if (name.rfind("--", 0) != 0 && a.input.empty()) {
      a.input = name;
    } else if (i + 1 == argc) {
      good = false;
    } else {
      const char* value = argv[++i];
      if (name == "--config")
        a.config = value;
      else if (name == "--fix")
        a.fix = split(value, ',');
      else if (name == "--tolerance")
        a.tolerance = std::atof(value);
      else if (name == "--out")
        a.output = value;
      else if (name == "--threads")
        a.threads = std::atoi(value);
      else if (name == "--max-iterations")
        a.max_iterations = std::atoi(value);
      else if (name == "--time-limit")
        a.time_limit_s = std::atof(value);
      else if (name == "--cost-target")
        a.cost_target = std::atof(value);
      else
        good = false;
    }
  }
  good = good && (a.test || !a.input.empty()) && a.threads > 0;
  if (!good)
    std::fprintf(stderr,
                 "usage: %s IN.txt --config NAME [--fix LIST] [--threads N] [--max-iterations K]\n"
                 "         [--time-limit SECONDS] [--tolerance T] [--cost-target COST]\n"
                 "         [--out FINAL.txt]\n"
                 "       %s --test\n",
                 argv[0], argv[0]);
  return good;
}

bool can_hold(const char* peer, const Arguments& a, const std::set<std::string>& able) {
  for (const std::string& word : a.fix)
    if (able.count(word) == 0) {
      std::fprintf(stderr, "%s here cannot hold %s\n", peer, word.c_str());
      return false;
    }
  return true;
}

Config::Config(const std::string& text) {
  // "lambda=1e-4" holds a '-' of its own: a piece that starts with a digit belongs to the last.
  std::istringstream pieces(text);
  for (std::string piece; std::getline(pieces, piece, '-');) {
    const bool exponent = !words_.empty() && words_.back().back() == 'e' &&
                          words_.back().find('=') != std::string::npos;
    if (exponent)
      words_.back() += "-" + piece;
    else if (!piece.empty())
      words_.push_back(piece);
  }
}

bool Config::has(const std::string& word) {
  known_.insert(word);
  for (const auto& w : words_)
    if (w == word) return true;
  return false;
}

double Config::value(const std::string& word, double otherwise) {
  for (const auto& w : words_)
    if (w.rfind(word + "=", 0) == 0) {
      known_.insert(w);
      return std::atof(w.c_str() + word.size() + 1);
    }
  return otherwise;
}

std::string Config::unknown() const {
  for (const auto& w : words_)
    if (!known_.count(w)) return w;
  return "";
}

void RunRecord::start() {
  start_s_ = wall_s();
  cpu_start_s_ = cpu_s();
}

double RunRecord::now() const { return wall_s() - start_s_ - paused_s_; }
void RunRecord::pause() { pause_begin_s_ = wall_s(); }
void RunRecord::resume() { paused_s_ += wall_s() - pause_begin_s_; }

void RunRecord::add(double cost, bool accepted) { add_at(now(), cost, accepted); }

void RunRecord::add_at(double time_s, double cost, bool accepted) {
  if (accepted && !trace_.empty()) {
    decrease_before_ = decrease_;
    decrease_ = cost > 0 ? (held_ - cost) / cost : 0;
    if (with_best_) decrease_ = std::abs(decrease_);
  }
  // What was tried and refused is nobody's state.
  if (accepted || trace_.empty()) held_ = cost;
  const bool better = !with_best_ || trace_.empty() || held_ < trace_.back().second;
  trace_.emplace_back(time_s, better ? held_ : trace_.back().second);
}

void RunRecord::add_with_tries(double cost, const std::vector<double>& refused_s) {
  const double end_s = now();
  double time_s = trace_.empty() ? end_s : trace_.back().first;
  for (const double seconds : refused_s) add_at(time_s += seconds, cost, false);
  add_at(end_s, cost, true);
}

void RunRecord::finish() {
  total_s_ = now();
  cpu_s_ = cpu_s() - cpu_start_s_ - paused_s_;
}

bool RunRecord::over(const Arguments& a) const {
  const bool still = decrease_ <= a.tolerance && decrease_before_ <= a.tolerance;
  return (still && (!in_float_ || a.tolerance >= 1e-6)) || now() >= a.time_limit_s ||
         (!trace_.empty() && trace_.back().second <= a.cost_target);
}

std::string RunRecord::json(const std::string& solver, const Arguments& a) const {
  std::ostringstream out;
  out.precision(17);
  const auto steps = trace_.empty() ? 0 : trace_.size() - 1;
  const double stepping_s = steps ? trace_.back().first - trace_.front().first : 0;
  out << "{\"solver\": \"" << solver << "\", \"config\": \"" << a.config
      << "\", \"threads\": " << a.threads << ", \"setup_s\": " << setup_s_ << ", \"trace\": [";
  for (std::size_t i = 0; i < trace_.size(); ++i)
    out << (i ? ", " : "") << "[" << trace_[i].first << ", " << trace_[i].second << "]";
  out << "], \"seconds_per_iteration\": " << (steps ? stepping_s / static_cast<double>(steps) : 0)
      << ", \"total_s\": " << total_s_
      << ", \"cpu_percent\": " << (total_s_ > 0 ? 100 * cpu_s_ / total_s_ : 0)
      << ", \"cost_in\": \"" << (in_float_ ? "float" : "double")
      << "\", \"peak_bytes\": " << peak_bytes() << ", \"iterations\": " << steps
      << ", \"final_cost\": " << (trace_.empty() ? 0.0 : trace_.back().second) << "}\n";
  return out.str();
}

}  // namespace peer
