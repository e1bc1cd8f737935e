// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

#include "end_to_end/command.h"
#include "sheaf/sheaf.h"

namespace sheaf {
namespace {

using testing::TestWithParam;
using Words = std::vector<std::string>;

// Two images, four points, all seen by both: the smallest problem with an answer to look for.
const char* const kTiny =
    "2 4 8\n"
    "0 0 0 0\n1 0 -100 2\n0 1 100 3\n1 1 -1 -4\n0 2 1 100\n1 2 -99 99\n0 3 51 52\n1 3 -48 51\n"
    "0 0 0  0 0 0  1000 0 0\n"
    "0 0 0  -1 0 0  1000 0 0\n"
    "0 0 -10  1 0 -10  0 1 -10  0.5 0.5 -9.5\n";

std::string joined(const Words& words) {
  std::string text;
  for (const std::string& word : words) text += word + " ";
  return text;
}

struct WrongUsage {
  Words arguments;
  Words says;  ///< texts that the message contains
};

void PrintTo(const WrongUsage& usage, std::ostream* out) { *out << joined(usage.arguments); }

class UsageErrors : public TestWithParam<WrongUsage> {};

TEST_P(UsageErrors, ExitWithTwoAndNameWhatIsAccepted) {
  TemporaryFolder folder;
  write_text(folder / "tiny.txt", kTiny);
  const Outcome outcome = run_command(GetParam().arguments, folder.path());
  EXPECT_EQ(outcome.exit_code, 2) << joined(GetParam().arguments);
  EXPECT_EQ(outcome.out, "");
  for (const std::string& text : GetParam().says)
    EXPECT_NE(outcome.err.find(text), std::string::npos) << text << " not in: " << outcome.err;
  EXPECT_EQ(folder.names(), Words{"tiny.txt"});
}

INSTANTIATE_TEST_SUITE_P(
    Command, UsageErrors,
    testing::Values(
        WrongUsage{{},
                   {"solve", "info", "check", "convert", "perturb", "evaluate", "compare",
                    "generate", "demo"}},
        WrongUsage{{"refine"},
                   {"solve", "info", "check", "convert", "perturb", "evaluate", "compare",
                    "generate", "demo"}},
        WrongUsage{{"perturb", "tiny.txt"}, {"OUT"}},
        WrongUsage{{"perturb", "tiny.txt", "o.txt", "--outliers", "1.5"}, {"from 0 to 1"}},
        WrongUsage{{"perturb", "tiny.txt", "o.txt", "--point", "-1"}, {"from 0 up"}},
        WrongUsage{{"perturb", "tiny.txt", "o.txt", "--intrinsics", "1,,2"}, {"F[,K1[,K2]]"}},
        WrongUsage{{"perturb", "tiny.txt", "o.txt", "--protocol", "noise"}, {"rootba"}},
        WrongUsage{{"perturb", "tiny.txt", "o.txt", "--protocol", "ceres", "--center", "1"},
                   {"sigma is that of t"}},
        WrongUsage{{"evaluate", "tiny.txt"}, {"REF"}},
        WrongUsage{{"align", "tiny.txt", "--reference", "tiny.txt"}, {"--output"}},
        WrongUsage{{"align", "tiny.txt", "-o", "o.txt"}, {"--reference"}},
        WrongUsage{{"align", "tiny.txt", "-o", "o.txt", "--reference", "tiny.txt"}, {"three"}},
        WrongUsage{{"compare", "tiny.txt", "--runs", "0"}, {"from 1 up"}},
        WrongUsage{{"compare", "tiny.txt", "--time-to", "0.1,x"}, {"above 0"}},
        WrongUsage{{"compare", "tiny.txt", "--solvers", ",sheaf"}, {"NAME[:CONFIG]"}},
        WrongUsage{{"evaluate", "tiny.txt", "tiny.txt", "--no-align", "--robust"}, {"--no-align"}},
        WrongUsage{{"solve"}, {"IN"}}, WrongUsage{{"convert", "tiny.txt"}, {"OUT"}},
        WrongUsage{{"solve", "tiny.txt", "--los", "huber"}, {"--los"}},
        WrongUsage{{"solve", "tiny.txt", "--cheirality", "ignore"},
                   {"formula", "reject", "hold-out", "ignore"}},
        WrongUsage{{"solve", "tiny.txt", "--solver", "direct"},
                   {"auto", "dense", "sparse", "direct"}},
        WrongUsage{{"solve", "tiny.txt", "--simd", "mmx"},
                   {"best", "scalar", "sse4", "avx2", "avx512", "neon"}},
        WrongUsage{{"solve", "tiny.txt", "--fix", "points,lens"},
                   {"points", "poses", "intrinsics", "focal", "pose=WHO", "camera=WHO", "lens"}},
        WrongUsage{{"solve", "tiny.txt", "--fix", "pose=-1"}, {"pose=-1", "no image", "0 to 1"}},
        WrongUsage{{"solve", "tiny.txt", "--fix", "points,"}, {"points"}},
        WrongUsage{{"solve", "tiny.txt", "--fix", "pose=2"}, {"2"}},
        WrongUsage{{"solve", "tiny.txt", "--fix", "camera=7"}, {"7"}},
        WrongUsage{{"solve", "tiny.txt", "--max-iterations", "-1"}, {"--max-iterations", "-1"}},
        WrongUsage{{"solve", "tiny.txt", "--max-iterations", "2.5"}, {"whole number"}},
        WrongUsage{{"solve", "tiny.txt", "--tolerance", "nan"}, {"--tolerance", "nan"}},
        WrongUsage{{"solve", "tiny.txt", "--tolerance", "-1e-8"}, {"from 0 up"}},
        WrongUsage{{"solve", "tiny.txt", "--time-limit", "0"}, {"seconds above 0"}},
        WrongUsage{{"solve", "tiny.txt", "--initial-damping", "x"}, {"from 0 up"}},
        WrongUsage{{"solve", "tiny.txt", "--trust-region", "cauchy"}, {"--trust-region", "dogleg"}},
        WrongUsage{{"solve", "tiny.txt", "--threads", "many"}, {"--threads", "many"}},
        WrongUsage{{"solve", "tiny.txt", "-o", "a", "--json", "./a"}, {"same file"}},
        WrongUsage{{"generate", "g.txt", "--cameras", "1"}, {"from 2 up"}},
        WrongUsage{{"generate", "g.txt", "--points", "0"}, {"from 1 up"}},
        WrongUsage{{"generate", "g.txt", "--cameras", "3", "--mean-track", "4"}, {"mean track"}},
        WrongUsage{{"generate", "g.txt", "--pixel-noise", "-1"}, {"--pixel-noise"}}));

struct BadInput {
  const char* name;
  std::string content;
};

void PrintTo(const BadInput& input, std::ostream* out) { *out << input.name; }

class UnreadableInputs : public TestWithParam<BadInput> {};

TEST_P(UnreadableInputs, ExitWithThreeAndLeaveNothing) {
  TemporaryFolder in, out;
  write_text(in / "bad.txt", GetParam().content);
  for (const Words& arguments :
       {Words{"solve", in / "bad.txt", "-o", "o.txt", "--json", "o.json", "--ply", "o.ply"},
        Words{"info", in / "bad.txt", "--json", "o.json"},
        Words{"convert", in / "bad.txt", "o.txt.gz", "--json", "o.json"}}) {
    const Outcome outcome = run_command(arguments, out.path());
    EXPECT_EQ(outcome.exit_code, 3) << joined(arguments) << outcome.err;
    EXPECT_EQ(outcome.out, "");
    EXPECT_NE(outcome.err.find("bad.txt"), std::string::npos) << outcome.err;
    EXPECT_NE(outcome.err.find("expected"), std::string::npos) << outcome.err;
    EXPECT_EQ(out.names(), Words{});
  }
}

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  return text.replace(text.find(what), what.size(), by);
}

INSTANTIATE_TEST_SUITE_P(
    Command, UnreadableInputs,
    testing::Values(
        BadInput{"Empty", std::string()}, BadInput{"Prose", std::string("not a problem\n")},
        BadInput{"Truncated", std::string(kTiny).substr(0, 120)},
        BadInput{"OneNumberShort", std::string(kTiny).substr(0, std::string(kTiny).size() - 6)},
        BadInput{"NegativeCount", replaced(kTiny, "2 4 8", "-2 4 8")},
        BadInput{"AbsurdCount", replaced(kTiny, "2 4 8", "2 4 8000000000000000000")},
        BadInput{"ImageOutOfRange", replaced(kTiny, "1 0 -100", "2 0 -100")},
        BadInput{"PointOutOfRange", replaced(kTiny, "0 3 51", "0 4 51")},
        BadInput{"NotANumber", replaced(kTiny, "-99 99", "nan 99")},
        BadInput{"LettersInPoints", replaced(kTiny, "0.5 0.5", "0.5 abc")},
        BadInput{"TruncatedGzip", std::string("\x1f\x8b\x08\x00\x00\x00\x00\x00\x00\x03\x33", 11)},
        BadInput{"TruncatedBzip2", std::string("BZh91AY&SY\x12\x34", 12)},
        BadInput{"Zeros", std::string(4096, '\0')}),
    [](const auto& info) { return info.param.name; });

TEST(ExitCode, MissingInputIsThree) {
  TemporaryFolder folder;
  const Outcome outcome = run_command({"solve", "nowhere.txt", "-o", "o.txt"}, folder.path());
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_NE(outcome.err.find("nowhere.txt"), std::string::npos);
  EXPECT_EQ(folder.names(), Words{});
}

TEST(ExitCode, AFolderAsInputIsThree) {
  TemporaryFolder folder;
  EXPECT_EQ(run_command({"solve", "."}, folder.path()).exit_code, 3);
}

TEST(ExitCode, SolvedIsZeroAndASolvedStartIsZeroAgain) {
  TemporaryFolder folder;
  write_text(folder / "tiny.txt", kTiny);
  const Outcome first = run_command({"solve", "tiny.txt", "-o", "solved.txt"}, folder.path());
  EXPECT_EQ(first.exit_code, 0) << first.err;
  const Outcome again = run_command({"solve", "solved.txt", "--json", "again.json"}, folder.path());
  EXPECT_EQ(again.exit_code, 0) << again.out << again.err;
  const auto json = json_of(folder / "again.json");
  EXPECT_LE(json["final_cost"].get<double>(), json["initial_cost"].get<double>());
}

TEST(ExitCode, NothingFreeOrNoIterationsIsNoFailure) {
  TemporaryFolder folder;
  write_text(folder / "tiny.txt", kTiny);
  const Outcome none =
      run_command({"solve", "tiny.txt", "--max-iterations", "0", "-o", "o.txt"}, folder.path());
  EXPECT_EQ(none.exit_code, 0) << none.err;
  const Outcome info = run_command({"info", "o.txt", "--json", "after.json"}, folder.path());
  EXPECT_EQ(info.exit_code, 0);
  run_command({"info", "tiny.txt", "--json", "before.json"}, folder.path());
  EXPECT_EQ(json_of(folder / "after.json")["cost"], json_of(folder / "before.json")["cost"]);
}

TEST(ExitCode, NoUsableStepIsFourAndWritesNoState) {
  // The only point lies in the plane of the only camera: no residual is finite.
  TemporaryFolder folder;
  write_text(folder / "flat.txt", "1 1 1\n0 0 1 2\n0 0 0 0 0 0 1000 0 0\n1 1 0\n");
  const Outcome outcome =
      run_command({"solve", "flat.txt", "-o", "o.txt", "--json", "o.json"}, folder.path());
  EXPECT_EQ(outcome.exit_code, 4) << outcome.out << outcome.err;
  EXPECT_EQ(folder.names(), (Words{"flat.txt", "o.json"}));
  const auto json = json_of(folder / "o.json");
  EXPECT_EQ(json["termination"]["code"], "no_usable_step");
  EXPECT_FALSE(json["termination"]["words"].get<std::string>().empty());
}

TEST(ExitCode, UnwritableOutputIsSixAndKnownBeforeTheSolve) {
  TemporaryFolder folder;
  write_text(folder / "tiny.txt", kTiny);
  for (const Words& output :
       {Words{"-o", "no/such/folder/o.txt"}, Words{"--json", "no/o.json"}, Words{"--ply", "no/o"},
        Words{"-o", "o.txt", "--json", "no/o.json"}}) {
    Words arguments = {"solve", "tiny.txt"};
    arguments.insert(arguments.end(), output.begin(), output.end());
    const Outcome outcome = run_command(arguments, folder.path());
    EXPECT_EQ(outcome.exit_code, 6) << joined(arguments);
    EXPECT_EQ(outcome.out, "");
    EXPECT_EQ(outcome.err.find("cost"), std::string::npos) << "solved first: " << outcome.err;
    EXPECT_NE(outcome.err.find("no/"), std::string::npos) << outcome.err;
    EXPECT_EQ(folder.names(), Words{"tiny.txt"});
  }
  EXPECT_EQ(run_command({"convert", "tiny.txt", "no/o.txt"}, folder.path()).exit_code, 6);
  EXPECT_EQ(run_command({"generate", "no/o.txt"}, folder.path()).exit_code, 6);
  EXPECT_EQ(run_command({"info", "tiny.txt", "--json", "no/o"}, folder.path()).exit_code, 6);
  EXPECT_EQ(run_command({"demo", "--json", "no/o"}, folder.path()).exit_code, 6);
}

TEST(ExitCode, NothingToSolveIsTwoWhateverTheFormat) {
  TemporaryFolder folder;
  Problem problem;
  Camera camera{CameraModel::simple_pinhole, {800, 320, 240}};
  camera.width_px = 640;
  camera.height_px = 480;
  problem.add_image({}, camera);
  problem.add_image({{1, 0, 0, 0}, {1, 0, 0}}, 0);
  for (const char* name : {"o.txt", "o.out", "o.nvm", "model/", "text/", "reconstruction.json",
                           "sfm_data.json", "o.sfm"}) {
    const std::string format = name == std::string("text/") ? "colmap-text" : "";
    ASSERT_TRUE(write(problem, folder / name, {.format = format}).ok()) << name;
    const Outcome solved = run_command({"solve", name}, folder.path());
    EXPECT_EQ(solved.exit_code, 2) << name << ": " << solved.err;
    EXPECT_NE(solved.err.find("observations"), std::string::npos) << name << ": " << solved.err;
  }
}

TEST(ExitCode, OverTheMemoryLimitIsFiveAndNothingIsWritten) {
  TemporaryFolder folder;
  run_command({"generate", "in.txt", "--cameras", "40", "--points", "3000"}, folder.path());
  const Outcome refused =
      run_command({"solve", "in.txt", "-o", "o.txt", "--memory-limit", "1M"}, folder.path());
  EXPECT_EQ(refused.exit_code, 5);
  EXPECT_NE(refused.err.find("over the limit of 1M"), std::string::npos) << refused.err;
  EXPECT_EQ(folder.names(), Words{"in.txt"});
  EXPECT_EQ(run_command({"solve", "in.txt", "--memory-limit", "1G"}, folder.path()).exit_code, 0);
  run_command({"generate", "images", "--photometric", "--points", "100"}, folder.path());
  const auto limited = [&](const char* limit) {
    return run_command({"photometric", "images", "-o", "refined", "--memory-limit", limit},
                       folder.path());
  };
  const Outcome images = limited("1M");
  EXPECT_EQ(images.exit_code, 5);
  EXPECT_NE(images.err.find("over the limit"), std::string::npos) << images.err;
  EXPECT_EQ(folder.names(), (Words{"images", "in.txt"}));
  EXPECT_EQ(limited("1G").exit_code, 0);
}

TEST(ExitCode, AFolderWithoutPermissionIsSix) {
  if (geteuid() == 0) GTEST_SKIP() << "root may write everywhere";
  TemporaryFolder folder;
  write_text(folder / "tiny.txt", kTiny);
  std::filesystem::create_directory(folder / "locked");
  chmod((folder / "locked").c_str(), 0500);
  EXPECT_EQ(run_command({"solve", "tiny.txt", "-o", "locked/o.txt"}, folder.path()).exit_code, 6);
}

TEST(ExitCode, AFailedRunLeavesAnEarlierOutputAsItWas) {
  TemporaryFolder folder;
  write_text(folder / "bad.txt", "3 4\n");
  write_text(folder / "o.txt", "precious");
  EXPECT_EQ(run_command({"solve", "bad.txt", "-o", "o.txt"}, folder.path()).exit_code, 3);
  EXPECT_EQ(contents_of(folder / "o.txt"), "precious");
  EXPECT_EQ(folder.names(), (Words{"bad.txt", "o.txt"}));
}

}  // namespace
}  // namespace sheaf
