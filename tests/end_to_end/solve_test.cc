// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "end_to_end/command.h"
#include "sheaf/io.h"
#include "sheaf/problem.h"

namespace sheaf {
namespace {

using Words = std::vector<std::string>;

class SolveVerb : public testing::Test {
 protected:
  Outcome run(const Words& arguments) { return run_command(arguments, folder_.path()); }
  void generate(const Words& more = {}) {
    Words arguments = {"generate", "in.txt"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Outcome outcome = run(arguments);
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  }
  Problem problem(const std::string& name) { return read(folder_ / name).value(); }
  nlohmann::json json(const std::string& name) { return json_of(folder_ / name); }
  TemporaryFolder folder_;
};

// Where the two differ, as --fix names it.
struct Differences {
  bool points = false, f = false, k1 = false, k2 = false;
  std::vector<bool> pose, camera;
};

Differences between(const Problem& a, const Problem& b) {
  Differences d;
  d.points = a.points != b.points;
  for (std::size_t j = 0; j < a.num_images(); ++j) {
    bool moved = a.poses[j].translation != b.poses[j].translation;
    for (int k = 0; k < 3; ++k) moved |= a.bal_angle_axis[3 * j + k] != b.bal_angle_axis[3 * j + k];
    d.pose.push_back(moved);
    const auto& x = a.cameras[j].parameters;
    const auto& y = b.cameras[j].parameters;
    d.f |= x[0] != y[0];
    d.k1 |= x[1] != y[1];
    d.k2 |= x[2] != y[2];
    d.camera.push_back(x != y);
  }
  return d;
}

TEST_F(SolveVerb, FixHoldsToTheLastBitAndOnlyWhatItNames) {
  generate({"--points", "500", "--cameras", "6"});
  const Problem before = problem("in.txt");
  const auto solved = [&](const std::string& list) {
    const Outcome outcome = run({"solve", "in.txt", "-o", "o.txt", "--fix", list});
    EXPECT_EQ(outcome.exit_code, 0) << list << outcome.err;
    return between(before, problem("o.txt"));
  };
  const std::vector<bool> all(6, true), none(6, false);
  Differences d = solved("points");
  EXPECT_FALSE(d.points);
  EXPECT_EQ(d.pose, all);
  EXPECT_EQ(d.camera, all);
  d = solved("poses");
  EXPECT_TRUE(d.points);
  EXPECT_EQ(d.pose, none);
  EXPECT_EQ(d.camera, all);
  d = solved("intrinsics");
  EXPECT_TRUE(d.points);
  EXPECT_EQ(d.pose, all);
  EXPECT_EQ(d.camera, none);
  d = solved("f");
  EXPECT_TRUE(!d.f && d.k1 && d.k2);
  d = solved("k1");
  EXPECT_TRUE(d.f && !d.k1 && d.k2);
  d = solved("f,k2");
  EXPECT_TRUE(!d.f && d.k1 && !d.k2);
  d = solved("pose=0,pose=3,camera=5");
  EXPECT_EQ(d.pose, (std::vector<bool>{false, true, true, false, true, true}));
  EXPECT_EQ(d.camera, (std::vector<bool>{true, true, true, true, true, false}));
  d = solved("points,intrinsics");
  EXPECT_FALSE(d.points);
  EXPECT_EQ(d.pose, all);
  EXPECT_EQ(d.camera, none);
}

// The iterations without their times.
nlohmann::json trace_of(nlohmann::json document) {
  for (auto& iteration : document["iterations"]) iteration.erase("time_s");
  return document["iterations"];
}

TEST_F(SolveVerb, ThreadsDoNotChangeAByte) {
  generate({"--cameras", "30", "--points", "6000"});
  ASSERT_EQ(run({"solve", "in.txt", "-o", "1.txt", "--json", "1.json", "--threads", "1"}).exit_code,
            0);
  for (const std::string threads : {"2", "5", "16", "0"}) {
    ASSERT_EQ(run({"solve", "in.txt", "-o", threads + ".txt", "--json", threads + ".json",
                   "--threads", threads})
                  .exit_code,
              0);
    EXPECT_TRUE(contents_of(folder_ / (threads + ".txt")) == contents_of(folder_ / "1.txt"))
        << threads << " threads";
    EXPECT_EQ(trace_of(json(threads + ".json")), trace_of(json("1.json")));
  }
}

TEST_F(SolveVerb, InstructionSetsAgree) {
  generate({"--cameras", "20", "--points", "3000"});
  ASSERT_EQ(run({"solve", "in.txt", "-o", "best.txt", "--json", "best.json"}).exit_code, 0);
  const double cost = json("best.json")["final_cost"];
  std::string fused;  // output of a target with fused multiply-add
  for (const std::string simd : {"scalar", "sse4", "avx2", "avx512", "neon"}) {
    const Outcome outcome =
        run({"solve", "in.txt", "-o", simd + ".txt", "--json", simd + ".json", "--simd", simd});
    if (outcome.exit_code == 2) continue;  // not on this machine
    ASSERT_EQ(outcome.exit_code, 0) << simd << outcome.err;
    EXPECT_EQ(json(simd + ".json")["simd"], simd);
    EXPECT_NEAR(json(simd + ".json")["final_cost"].get<double>(), cost, 1e-8 * cost) << simd;
    if (simd != "avx2" && simd != "avx512") continue;
    const std::string text = contents_of(folder_ / (simd + ".txt"));
    if (!fused.empty()) {
      EXPECT_TRUE(text == fused) << "avx2 and avx512 differ";
    }
    fused = text;
  }
}

TEST_F(SolveVerb, CompressedFilesAreReadAndWritten) {
  generate({"--points", "300"});
  ASSERT_EQ(run({"solve", "in.txt", "-o", "plain.txt"}).exit_code, 0);
  for (const std::string ending : {".gz", ".bz2"}) {
    ASSERT_EQ(run({"convert", "in.txt", "in.txt" + ending}).exit_code, 0);
    ASSERT_EQ(run({"solve", "in.txt" + ending, "-o", "o.txt" + ending}).exit_code, 0);
    ASSERT_EQ(run({"convert", "o.txt" + ending, "o.txt"}).exit_code, 0);
    EXPECT_TRUE(contents_of(folder_ / "o.txt") == contents_of(folder_ / "plain.txt")) << ending;
  }
}

TEST_F(SolveVerb, OutputAndPly) {
  generate({"--points", "300"});
  const double before = evaluate(problem("in.txt")).cost;
  ASSERT_EQ(run({"solve", "in.txt", "-o", "out.txt", "--ply", "o.ply"}).exit_code, 0);
  EXPECT_LT(evaluate(problem("out.txt")).cost, before);
  EXPECT_EQ(contents_of(folder_ / "o.ply").substr(0, 4), "ply\n");
  EXPECT_EQ(folder_.names(), (Words{"in.txt", "o.ply", "out.txt"}));
}

TEST_F(SolveVerb, NoiseIsAllThatIsLeft) {
  generate({"--cameras", "20", "--points", "3000", "--pixel-noise", "0.8"});
  ASSERT_EQ(run({"solve", "in.txt", "--json", "s.json"}).exit_code, 0);
  const auto s = json("s.json");
  const double n = 2.0 * s["input"]["observations"].get<double>();
  const double parameters = 9 * 20 + 3 * 3000 - 7;
  EXPECT_NEAR(2 * s["final_cost"].get<double>() / (n - parameters), 0.64, 0.03);
}

// A scene that keeps the solver busy for long: far from its solution, and no tolerance.
class InterruptedSolve : public SolveVerb {
 protected:
  void SetUp() override {
    generate({"--cameras", "200", "--points", "120000", "--point-noise", "0.5", "--center-noise",
              "0.2", "--rotation-noise", "0.05", "--focal-noise", "0.1"});
  }
  const Words endless_ = {"solve",
                          "in.txt",
                          "-o",
                          "o.txt",
                          "--ply",
                          "o.ply",
                          "--json",
                          "o.json",
                          "--tolerance",
                          "0",
                          "--max-iterations",
                          "100000"};
  void expect_best_state_written() {
    EXPECT_EQ(folder_.names(), (Words{"in.txt", "o.json", "o.ply", "o.txt"}));
    const auto s = json("o.json");
    EXPECT_LT(s["final_cost"], s["initial_cost"]);
    EXPECT_EQ(s["iterations"].back()["cost"], s["final_cost"]);
    const double cost = s["final_cost"];
    EXPECT_NEAR(evaluate(problem("o.txt")).cost, cost, 1e-9 * cost);
  }
};

TEST_F(InterruptedSolve, CtrlCWritesTheBestStateAndExitsWith130) {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    RunningCommand command(endless_, folder_.path());
    ASSERT_TRUE(command.wait_for_stderr("change -")) << "no step was accepted";
    command.send(signal);
    const Outcome outcome = command.wait();
    EXPECT_EQ(outcome.exit_code, 130) << outcome.out << outcome.err;
    EXPECT_NE(outcome.err.find("interrupted"), std::string::npos);
    EXPECT_EQ(json("o.json")["termination"]["code"], "stopped");
    expect_best_state_written();
  }
}

TEST_F(InterruptedSolve, TimeLimitWritesTheBestStateAndExitsWithSeven) {
  Words arguments = endless_;
  arguments.insert(arguments.end(), {"--time-limit", "5"});
  const Outcome outcome = run(arguments);
  if (outcome.exit_code == 0) GTEST_SKIP() << "solved within the limit";
  EXPECT_EQ(outcome.exit_code, 7) << outcome.out << outcome.err;
  EXPECT_EQ(json("o.json")["termination"]["code"], "time_limit");
  EXPECT_GT(json("o.json")["time"]["total_s"].get<double>(), 4.9);
}

/// Whose images are nearly all coupled, so that sigmas take some seconds, and one step less.
class InterruptedSigmas : public SolveVerb {
 protected:
  void SetUp() override {
    generate({"--cameras", "400", "--points", "6000", "--mean-track", "160"});
  }
  static double seconds_since(std::chrono::steady_clock::time_point then) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - then).count();
  }
  /// All but sigmas is there, and their want is said.
  void expect_the_rest(const Outcome& outcome, int exit_code) {
    EXPECT_EQ(outcome.exit_code, exit_code) << outcome.out << outcome.err;
    EXPECT_EQ(folder_.names(), (Words{"in.txt", "o.json", "o.txt"}));
    EXPECT_EQ(json("o.json")["sigmas"], "cut short");
    EXPECT_NE(outcome.out.find("no sigmas: the run was cut short"), std::string::npos);
    const double cost = json("o.json")["final_cost"];
    EXPECT_NEAR(evaluate(problem("o.txt")).cost, cost, 1e-9 * cost);
  }
  const Words asked_ = {"solve",  "in.txt",           "-o", "o.txt", "--json", "o.json", "--sigmas",
                        "s.json", "--max-iterations", "1"};
};

TEST_F(InterruptedSigmas, ASignalLeavesTheSolvedModel) {
  for (const int signal : {SIGINT, SIGTERM}) {
    RunningCommand command(asked_, folder_.path());
    ASSERT_TRUE(command.wait_for_stderr("change -")) << "no step was accepted";
    std::this_thread::sleep_for(std::chrono::milliseconds(400));
    const auto sent = std::chrono::steady_clock::now();
    command.send(signal);
    const Outcome outcome = command.wait();
    if (outcome.exit_code == 0) GTEST_SKIP() << "done before the signal";
    EXPECT_LT(seconds_since(sent), 2);  // one, and what the model takes to be written
    expect_the_rest(outcome, 130);
  }
}

TEST_F(InterruptedSigmas, ATimeLimitLeavesTheSolvedModel) {
  ASSERT_EQ(run({"solve", "in.txt", "--max-iterations", "1", "--json", "t.json"}).exit_code, 0);
  const double alone_s = json("t.json")["time"]["total_s"];
  std::filesystem::remove(folder_ / "t.json");
  Words arguments = asked_;
  arguments.insert(arguments.end(), {"--time-limit", std::to_string(alone_s + 0.5)});
  const Outcome outcome = run(arguments);
  if (outcome.exit_code == 0) GTEST_SKIP() << "done within the limit";
  EXPECT_LT(json("o.json")["time"]["total_s"].get<double>(), alone_s + 2.5);
  expect_the_rest(outcome, 7);
}

TEST_F(InterruptedSigmas, TheVerbCovarianceWritesNothing) {
  RunningCommand command({"covariance", "in.txt", "--json", "s.json", "--csv", "s.csv"},
                         folder_.path());
  std::this_thread::sleep_for(std::chrono::milliseconds(700));
  const auto sent = std::chrono::steady_clock::now();
  command.send(SIGTERM);
  EXPECT_EQ(command.wait().exit_code, 130);
  EXPECT_LT(seconds_since(sent), 1);
  const Outcome late = run({"covariance", "in.txt", "--json", "s.json", "--time-limit", "0.4"});
  EXPECT_EQ(late.exit_code, 7) << late.out << late.err;
  EXPECT_NE(late.err.find("nothing is written"), std::string::npos);
  EXPECT_EQ(folder_.names(), Words{"in.txt"});
}

TEST_F(SolveVerb, CtrlCWhileReadingEndsAtOnceAndWritesNothing) {
  ASSERT_EQ(mkfifo((folder_ / "pipe").c_str(), 0600), 0);  // nobody writes: reading never ends
  RunningCommand command({"solve", "pipe", "-o", "o.txt", "--json", "o.json"}, folder_.path());
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  command.send(SIGINT);
  EXPECT_EQ(command.wait().exit_code, 130);
  EXPECT_EQ(folder_.names(), Words{"pipe"});
}

}  // namespace
}  // namespace sheaf
