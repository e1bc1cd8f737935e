// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <filesystem>
#include <string>
#include <vector>

#include "end_to_end/command.h"
#include "sheaf/io.h"

namespace sheaf {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

// Peers that are shell scripts: what a peer says and does is then known to the last digit.
class CompareCommand : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_EQ(run({"generate", "in.txt", "--points", "300", "--truth", "truth.txt"}).exit_code, 0);
    fs::create_directory(folder_.path() / "peers");
    start_cost_ = evaluate(read(folder_ / "in.txt").value()).cost;
  }
  Outcome run(const std::vector<std::string>& arguments) {
    return run_command(arguments, folder_.path());
  }
  // The last two of its arguments are --out FILE, the first is the problem.
  void add_peer(const std::string& name, const std::string& script) {
    const std::string path = folder_ / ("peers/peer-" + name);
    write_text(path, "#!/bin/sh\nfor out; do :; done\n" + script + "\n");
    fs::permissions(path, fs::perms::owner_all);
  }
  // One that leaves the start as it is, after a rejected step of 0.5 s and two of 0.25 s.
  void add_honest_peer(const std::string& name, double final_cost) {
    const std::string cost = json(final_cost).dump(), more = json(2 * final_cost).dump();
    add_peer(name,
             "cp \"$1\" \"$out\"\necho '{\"solver\": \"x\", \"setup_s\": 0.1, \"trace\": [[0.1, " +
                 more + "], [0.6, " + more + "], [0.85, " + json(1.5 * final_cost).dump() +
                 "], [1.1, " + cost +
                 "]], \"total_s\": 1.2, \"cpu_percent\": 150, \"peak_bytes\": 7000000, "
                 "\"final_cost\": " +
                 cost + "}'");
  }
  const json& run_of(const json& document, const std::string& solver) {
    for (const json& one : document["runs"])
      if (one["solver"] == solver) return one;
    static const json none;
    ADD_FAILURE() << "no run of " << solver;
    return none;
  }
  TemporaryFolder folder_;
  double start_cost_ = 0;
};

TEST_F(CompareCommand, RunsSheafInSeveralModes) {
  const Outcome outcome =
      run({"compare", "in.txt", "--solvers", "sheaf,sheaf:sparse,sheaf:dense+initial-damping=0.01",
           "--threads", "2", "--json", "c.json", "--plot", "c.svg", "--reference", "truth.txt"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const json document = json_of(folder_ / "c.json");
  ASSERT_EQ(document["runs"].size(), 3u);
  for (const json& one : document["runs"]) {
    EXPECT_TRUE(one["failed"].is_null()) << one["failed"];
    EXPECT_EQ(one["threads"], 2);
    EXPECT_EQ(one["agrees"], true);
    EXPECT_LT(one["final_cost_independent"], 1e-2 * start_cost_);
    EXPECT_NEAR(one["chi2_independent"].get<double>(),
                2 * one["final_cost_independent"].get<double>(), 1e-9);
    EXPECT_GT(one["trace"].size(), 3u);
    EXPECT_EQ(one["trace"].size() - 1,
              one["accepted"].get<std::size_t>() + one["rejected"].get<std::size_t>());
    EXPECT_GT(one["peak_bytes"], 1000000);
    EXPECT_GT(one["cpu_percent"], 0);
    EXPECT_LT(one["errors"]["point_error"]["median"], 0.05);
  }
  EXPECT_EQ(document["runs"][1]["config"], "sparse");
  EXPECT_EQ(document["missing"], json::array());
  const std::string svg = contents_of(folder_ / "c.svg");
  EXPECT_EQ(svg.rfind("<svg", 0), 0u);
  EXPECT_NE(svg.find("sheaf sparse"), std::string::npos);
  EXPECT_NE(outcome.out.find("chi2"), std::string::npos);
}

TEST_F(CompareCommand, HasTheDocumentedRowForAPeer) {
  add_honest_peer("abacus-9", start_cost_);
  // "abacus" stands for every program whose name begins so.
  const Outcome outcome = run({"compare", "in.txt", "--solvers", "sheaf,abacus:words-of-it",
                               "--peers", "peers", "--json", "c.json", "--threads", "1"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const json document = json_of(folder_ / "c.json");
  const json& peer = run_of(document, "abacus-9");
  EXPECT_EQ(peer["config"], "words-of-it");
  EXPECT_EQ(peer["accepted"], 2);
  EXPECT_EQ(peer["rejected"], 1);
  EXPECT_NEAR(peer["seconds_per_accepted"].get<double>(), 0.25, 1e-12);
  EXPECT_NEAR(peer["seconds_per_rejected"].get<double>(), 0.5, 1e-12);
  EXPECT_NEAR(peer["seconds_per_iteration"].get<double>(), 1.0 / 3, 1e-12);
  EXPECT_EQ(peer["cpu_percent"], 150);
  EXPECT_NEAR(peer["final_cost_independent"].get<double>(), start_cost_, 1e-10 * start_cost_);
  EXPECT_EQ(peer["agrees"], true);
  for (const json& pair : peer["time_to"]) EXPECT_TRUE(pair[1].is_null()) << "it never got there";
  EXPECT_EQ(document["best_cost"], run_of(document, "sheaf")["final_cost_independent"]);
  EXPECT_NE(outcome.out.find("2 x 0.25"), std::string::npos) << outcome.out;
}

TEST_F(CompareCommand, WhatGoesWrongIsARowAndNotTheEnd) {
  add_peer("crash", "kill -SEGV $$");
  add_peer("hang", "sleep 1000 & sleep 1000");
  add_peer("garbage", "cp \"$1\" \"$out\"\necho 'all went well'");
  add_peer("refuses", "echo 'this lens is not for me' >&2\nexit 3");
  add_peer("nothing",
           "echo '{\"setup_s\": 0, \"total_s\": 1, \"trace\": [[0, 1]], \"cpu_percent\": "
           "1, \"peak_bytes\": 1, \"final_cost\": 1}'");
  add_honest_peer("liar", 0.5 * start_cost_);
  const auto begin = std::chrono::steady_clock::now();
  const Outcome outcome =
      run({"compare", "in.txt", "--solvers", "crash,hang,garbage,refuses,nothing,liar,sheaf",
           "--peers", "peers", "--json", "c.json", "--time-limit", "0.2"});
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(40));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const json document = json_of(folder_ / "c.json");
  const auto failure = [&](const std::string& name) {
    const json& words = run_of(document, name)["failed"];
    return words.is_string() ? words.get<std::string>() : "";
  };
  EXPECT_NE(failure("crash").find("crashed"), std::string::npos);
  EXPECT_NE(failure("hang").find("did not end in time"), std::string::npos);
  EXPECT_NE(failure("garbage").find("JSON"), std::string::npos);
  EXPECT_EQ(failure("refuses"), "exit code 3: this lens is not for me");
  EXPECT_NE(failure("nothing").find("cannot be read"), std::string::npos);
  EXPECT_EQ(failure("liar"), "");
  EXPECT_EQ(run_of(document, "liar")["agrees"], false);
  EXPECT_NE(outcome.out.find("(!)"), std::string::npos) << outcome.out;
  EXPECT_EQ(failure("sheaf"), "");
  EXPECT_TRUE(run_of(document, "crash")["total_s"].is_null());
  // A claim alone is no best cost.
  EXPECT_EQ(document["best_cost"], run_of(document, "sheaf")["final_cost_independent"]);
}

TEST_F(CompareCommand, HoldsWhatIsFixedAndShowsTheSteps) {
  add_honest_peer("still", start_cost_);
  // The truth as its answer: the points are not where they were.
  add_peer("mover", "cp '" + (folder_ / "truth.txt") +
                        "' \"$out\"\necho '{\"setup_s\": 0, \"total_s\": 1, \"trace\": [[0, 1]], "
                        "\"cpu_percent\": 1, \"peak_bytes\": 1, \"final_cost\": 1}'");
  const Outcome outcome =
      run({"compare", "in.txt", "--solvers", "sheaf,sheaf:dense,still,mover", "--peers", "peers",
           "--fix", "points,intrinsics", "--tolerance", "1e-5", "--steps", "--json", "c.json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const json document = json_of(folder_ / "c.json");
  EXPECT_EQ(document["options"]["fix"], "points,intrinsics");
  EXPECT_EQ(document["options"]["tolerance"], 1e-5);
  EXPECT_EQ(run_of(document, "mover")["failed"], "it moved points, which it was to hold");
  EXPECT_TRUE(run_of(document, "still")["failed"].is_null());
  const json& apart = document["runs"][0];
  const json& together = document["runs"][1];
  EXPECT_NEAR(apart["final_cost_independent"].get<double>(),
              together["final_cost_independent"].get<double>(), 1e-6 * start_cost_);
  EXPECT_LT(apart["trace"].size(), 12u) << "a loose tolerance ends early";
  EXPECT_NE(outcome.out.find("rejected\n"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("Seconds of each step"), std::string::npos);
  EXPECT_EQ(run({"compare", "in.txt", "--fix", "nonsense"}).exit_code, 2);
}

/// A COLMAP model is compared as it is, with the lens that its images share.
TEST_F(CompareCommand, AModelKeepsItsSharedLens) {
  ASSERT_EQ(run({"generate", "model", "--camera", "SIMPLE_RADIAL", "--shared", "--points", "300"})
                .exit_code,
            0);
  const double cost = evaluate(read(folder_ / "model").value()).cost;
  const auto copies = [&](const std::string& name, double start) {
    add_peer(name,
             "cp -r \"$1\" \"$out\"\necho '{\"setup_s\": 0, \"total_s\": 1, \"trace\": [[0, " +
                 json(start).dump() +
                 "]], \"cpu_percent\": 1, \"peak_bytes\": 1, \"final_cost\": " +
                 json(start).dump() + "}'");
  };
  copies("colmap-9", cost);
  copies("colmap-other", 2 * cost);
  add_honest_peer("abacus", cost);
  const Outcome outcome = run({"compare", "model", "--solvers", "sheaf,colmap,abacus", "--peers",
                               "peers", "--json", "c.json", "--fix", "pose=image-000003.png"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const json document = json_of(folder_ / "c.json");
  EXPECT_EQ(document["problem"]["cameras"], 1);
  const json& own = run_of(document, "sheaf");
  EXPECT_TRUE(own["failed"].is_null()) << own["failed"];
  EXPECT_EQ(own["agrees"], true);
  EXPECT_LT(own["final_cost_independent"], 0.1 * cost);
  EXPECT_NEAR(run_of(document, "colmap-9")["final_cost_independent"].get<double>(), cost,
              1e-12 * cost);
  const auto failure = [&](const char* name) {
    const json& words = run_of(document, name)["failed"];
    return words.is_string() ? words.get<std::string>() : "";
  };
  EXPECT_NE(failure("colmap-other").find("it solves another problem"), std::string::npos);
  EXPECT_NE(failure("abacus").find("--own-lenses"), std::string::npos);
  EXPECT_EQ(run({"compare", "model", "--solvers", "sheaf", "--fix", "pose=nobody"}).exit_code, 2);
}

TEST_F(CompareCommand, NamesWhatIsMissingAndHowToInstallIt) {
  const Outcome outcome = run({"compare", "in.txt", "--solvers", "sheaf,ceres,g2o,gtsam,magic",
                               "--peers", "peers", "--json", "c.json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const json document = json_of(folder_ / "c.json");
  // Peers may be installed beside the command that is tested.
  const auto mentioned = [&](const std::string& name) {
    for (const json& one : document["missing"])
      if (one["solver"] == name) return !one["how"].get<std::string>().empty();
    for (const json& one : document["runs"])
      if (one["solver"].get<std::string>().rfind(name, 0) == 0) return true;
    return false;
  };
  for (const char* name : {"sheaf", "ceres", "g2o", "gtsam", "magic"})
    EXPECT_TRUE(mentioned(name)) << name;
  EXPECT_NE(outcome.out.find("not here: magic"), std::string::npos);
}

TEST_F(CompareCommand, SeveralRunsAreInterleavedAndTheMedianIsShown) {
  add_honest_peer("one", start_cost_);
  ASSERT_EQ(run({"compare", "in.txt", "--solvers", "sheaf,one", "--peers", "peers", "--runs", "3",
                 "--json", "c.json"})
                .exit_code,
            0);
  const json runs = json_of(folder_ / "c.json")["runs"];
  ASSERT_EQ(runs.size(), 6u);
  std::vector<std::string> order;
  int medians = 0;
  for (const json& one : runs) {
    order.push_back(one["solver"]);
    medians += one["median"].get<bool>();
  }
  EXPECT_EQ(order, (std::vector<std::string>{"sheaf", "one", "one", "sheaf", "sheaf", "one"}));
  EXPECT_EQ(medians, 2);
}

TEST_F(CompareCommand, HandsPeersPlainTextAndTheSameLimits) {
  ASSERT_EQ(run({"convert", "in.txt", "in.txt.bz2"}).exit_code, 0);
  add_peer("echo",
           "cp \"$1\" \"$out\"\nhead -c 2 \"$1\" >&2\necho \" $* $OMP_NUM_THREADS\" >&2\nexit 9");
  ASSERT_EQ(run({"compare", "in.txt.bz2", "--solvers", "sheaf,echo:w", "--peers", "peers",
                 "--threads", "3", "--max-iterations", "7", "--time-limit", "11", "--tolerance",
                 "1e-07", "--fix", "k2,pose=3", "--json", "c.json"})
                .exit_code,
            0);
  const std::string said = run_of(json_of(folder_ / "c.json"), "echo")["failed"];
  EXPECT_EQ(said.rfind("exit code 9: 16", 0), 0u) << said;
  for (const char* words : {"--config w", "--threads 3", "--max-iterations 7", "--time-limit 11",
                            "--tolerance 1e-07", "--fix k2,pose=3"})
    EXPECT_NE(said.find(words), std::string::npos) << said;
  EXPECT_EQ(said.substr(said.size() - 2), " 3");
}

TEST_F(CompareCommand, AnInterruptEndsTheRunUnderWayAndKeepsTheOthers) {
  add_peer("hang", "echo $$ > started\nsleep 1000");
  RunningCommand command(
      {"compare", "in.txt", "--solvers", "sheaf,hang", "--peers", "peers", "--json", "c.json"},
      folder_.path());
  ASSERT_TRUE(command.wait_for_stderr("sheaf:auto"));
  command.send(SIGINT);
  const Outcome outcome = command.wait();
  EXPECT_EQ(outcome.exit_code, 130);
  EXPECT_EQ(json_of(folder_ / "c.json")["runs"].size(), 1u);
}

TEST_F(CompareCommand, RefusesAReferenceOfAnotherScene) {
  ASSERT_EQ(run({"generate", "other.txt", "--points", "301"}).exit_code, 0);
  EXPECT_EQ(run({"compare", "in.txt", "--solvers", "sheaf", "--reference", "other.txt"}).exit_code,
            2);
  EXPECT_EQ(run({"compare", "in.txt", "--solvers", "sheaf:"}).exit_code, 0);
  EXPECT_EQ(run({"compare", "in.txt", "--solvers", ":x"}).exit_code, 2);
}

}  // namespace
}  // namespace sheaf
