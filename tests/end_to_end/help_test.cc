// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "end_to_end/command.h"

namespace sheaf {
namespace {

const std::set<std::string> kCommon = {"--help", "--json", "--threads", "--quiet"};
const std::set<std::string> kScene = {"--cameras",     "--points",         "--mean-track",
                                      "--pixel-noise", "--rotation-noise", "--center-noise",
                                      "--point-noise", "--focal-noise",    "--seed"};

std::set<std::string> options_of(const std::string& verb) {
  std::set<std::string> options = kCommon;
  if (verb == "generate" || verb == "demo") options.insert(kScene.begin(), kScene.end());
  if (verb == "generate")
    options.insert({"--truth",
                    "--like",
                    "--family",
                    "--outliers",
                    "--drift",
                    "--photometric",
                    "--wavelength",
                    "--relief",
                    "--grey-noise",
                    "--brightness",
                    "--vignette",
                    "--occluder",
                    "--start",
                    "--measured",
                    "--camera",
                    "--shared",
                    "--lenses",
                    "--field-of-view",
                    "--rigs",
                    "--rig-sensors",
                    "--frames",
                    "--missing",
                    "--single-images",
                    "--sensor-rotation-noise",
                    "--sensor-translation-noise"});
  if (verb == "photometric")
    options.insert({"--output",
                    "--ply",
                    "--solver",
                    "--checkpoint",
                    "--checkpoint-every",
                    "--resume",
                    "--pictures",
                    "--log",
                    "--memory-limit",
                    "--intrinsics",
                    "--interpolation",
                    "--brightness",
                    "--loss",
                    "--loss-on",
                    "--leaving",
                    "--fix",
                    "--points",
                    "--warp",
                    "--pattern",
                    "--levels",
                    "--rounds",
                    "--min-zncc",
                    "--max-iterations",
                    "--tolerance",
                    "--motion",
                    "--time-limit",
                    "--initial-damping",
                    "--images",
                    "--depth-scale",
                    "--every",
                    "--cell",
                    "--min-slope",
                    "--max-points",
                    "--depth-tolerance",
                    "--disturb-rotation",
                    "--disturb-center",
                    "--seed",
                    "--anchor",
                    "--anchor-loss",
                    "--report",
                    "--rows"});
  if (verb == "demo") options.insert("--ply");
  if (verb == "split") options.insert("--pieces");
  if (verb == "join") options.insert("--output");
  if (verb == "compare")
    options.insert({"--solvers", "--peers", "--reference", "--max-iterations", "--time-limit",
                    "--time-to", "--runs", "--plot", "--fix", "--refine", "--own-lenses", "--steps",
                    "--tolerance"});
  if (verb == "info" || verb == "convert" || verb == "solve") options.insert("--rigs");
  if (verb == "check" || verb == "solve" || verb == "align") options.insert("--constraints");
  if (verb == "solve" || verb == "align") options.insert("--residuals");
  if (verb == "covariance")
    options.insert({"--gauge", "--sigma", "--loss", "--conditional", "--observations", "--points",
                    "--memory-limit", "--csv", "--fix", "--refine", "--rigs", "--constraints",
                    "--poses", "--pairs", "--solver", "--time-limit"});
  if (verb == "covariance" || verb == "calibrate")
    options.insert({"--projection", "--projection-figure", "--distance", "--grid"});
  if (verb == "calibrate")
    options.insert({"--board", "--spacing", "--size", "--camera", "--focal", "--loss", "--output"});
  if (verb == "solve") options.insert({"--sigmas", "--log", "--report", "--images"});
  if (verb == "report")
    options.insert({"--output", "--summary", "--images", "--title", "--no-sigmas"});
  if (verb == "view")
    options.insert({"--summary", "--images", "--title", "--no-sigmas", "--no-open"});
  if (verb == "info") options.insert("--pattern");
  if (verb == "convert")
    options.insert({"--format", "--max-error", "--drop-behind", "--drop-repeated", "--min-angle",
                    "--min-track"});
  if (verb == "align")
    options.insert({"--output", "--reference", "--to", "--rigid", "--least-squares", "--format"});
  if (verb == "evaluate") options.insert({"--no-align", "--robust", "--csv"});
  if (verb == "perturb")
    options.insert({"--rotation", "--translation", "--center", "--point", "--intrinsics", "--pixel",
                    "--outliers", "--outlier-size", "--seed", "--protocol", "--normalize",
                    "--min-depth", "--sensor-rotation", "--sensor-translation"});
  if (verb == "solve")
    options.insert({"--output",
                    "--ply",
                    "--max-iterations",
                    "--tolerance",
                    "--time-limit",
                    "--loss",
                    "--cheirality",
                    "--points",
                    "--fix",
                    "--refine",
                    "--solver",
                    "--memory-limit",
                    "--trust-region",
                    "--initial-damping",
                    "--inner-iterations",
                    "--recoveries",
                    "--simd",
                    "--precision",
                    "--checkpoint",
                    "--checkpoint-every",
                    "--resume"});
  return options;
}

// Options begin a line of the help, after short names.
std::set<std::string> options_in(const std::string& help) {
  std::set<std::string> options;
  const std::regex line(R"(\n\s+(?:-\w,)?(--[a-z0-9-]+))");
  for (std::sregex_iterator match(help.begin(), help.end(), line), end; match != end; ++match)
    options.insert((*match)[1]);
  return options;
}

std::vector<std::string> example_in(const std::string& help) {
  const std::size_t at = help.find("Example:\n");
  if (at == std::string::npos) return {};
  std::istringstream line(help.substr(at + 9, help.find('\n', at + 9) - at - 9));
  std::vector<std::string> words;
  for (std::string word; line >> word;) words.push_back(word);
  return words;
}

class Help : public testing::TestWithParam<const char*> {};

TEST_P(Help, NamesEveryOptionAndOnlyThose) {
  TemporaryFolder folder;
  const Outcome outcome = run_command({GetParam(), "--help"}, folder.path());
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_EQ(outcome.err, "");
  EXPECT_EQ(options_in(outcome.out), options_of(GetParam()));
}

TEST_P(Help, ExampleRuns) {
  TemporaryFolder folder;
  ASSERT_EQ(run_command({"generate", "problem.txt", "--points", "300"}, folder.path()).exit_code,
            0);
  std::filesystem::copy_file("tests/data/board_corners.vnl", folder / "corners.vnl");
  if (std::string(GetParam()) == "photometric") {
    ASSERT_EQ(run_command({"generate", "scene", "--photometric", "--points", "200"}, folder.path())
                  .exit_code,
              0);
  }
  std::vector<std::string> words =
      example_in(run_command({GetParam(), "--help"}, folder.path()).out);
  ASSERT_GE(words.size(), 2u);
  EXPECT_EQ(words[0], "sheaf");
  EXPECT_EQ(words[1], GetParam());
  words.erase(words.begin());
  const Outcome outcome = run_command(words, folder.path());
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_GE(folder.names().size(), 2u) << "the example writes a file";
}

INSTANTIATE_TEST_SUITE_P(Verbs, Help,
                         testing::Values("solve", "info", "check", "convert", "perturb", "evaluate",
                                         "align", "covariance", "calibrate", "photometric",
                                         "report", "generate", "demo", "split"),
                         [](const auto& info) { return std::string(info.param); });

TEST(Command, HelpNamesTheVerbsAndVersionTheVersion) {
  TemporaryFolder folder;
  const Outcome help = run_command({"--help"}, folder.path());
  EXPECT_EQ(help.exit_code, 0);
  for (const char* verb : {"solve", "info", "check", "convert", "perturb", "evaluate", "align",
                           "covariance", "calibrate", "compare", "photometric", "report", "view",
                           "generate", "demo", "split", "join"})
    EXPECT_NE(help.out.find(std::string("\n  ") + verb), std::string::npos) << verb;
  const Outcome version = run_command({"--version"}, folder.path());
  EXPECT_EQ(version.exit_code, 0);
  EXPECT_TRUE(std::regex_match(version.out, std::regex(R"(sheaf \d+\.\d+\.\d+\n)")));
}

TEST(Command, ManualPageHasEveryVerbWithItsOptions) {
  TemporaryFolder folder;
  const Outcome page = run_command({"--man"}, folder.path());
  ASSERT_EQ(page.exit_code, 0) << page.err;
  EXPECT_EQ(page.out.rfind(".TH SHEAF 1 ", 0), 0u);
  for (const std::string verb : {"solve", "info", "check", "convert", "perturb", "evaluate",
                                 "align", "covariance", "calibrate", "compare", "photometric",
                                 "report", "view", "generate", "demo", "split", "join"}) {
    const std::size_t begin = page.out.find("\n.SS " + verb + "\n");
    ASSERT_NE(begin, std::string::npos) << verb;
    const std::string section = page.out.substr(begin, page.out.find("\n.S", begin + 1) - begin);
    std::set<std::string> named = {"--help"};
    const std::regex tag(R"(\n\.TP\n\\fB(?:\\-\w, )?((?:\\-|\w)+)\\fR)");
    for (std::sregex_iterator match(section.begin(), section.end(), tag), end; match != end;
         ++match) {
      const std::string option = std::regex_replace((*match)[1].str(), std::regex(R"(\\-)"), "-");
      if (option[0] == '-') named.insert(option);
    }
    EXPECT_EQ(named, options_of(verb)) << verb;
  }
}

// groff reads the page as man(1) does, and warns of requests and escapes that are none.
TEST(Command, ManualPageIsGoodRoff) {
  if (std::system("command -v groff >/dev/null") != 0) GTEST_SKIP() << "groff is not here";
  TemporaryFolder folder;
  std::ofstream(folder / "sheaf.1") << run_command({"--man"}, folder.path()).out;
  const std::string groff = "groff -man -Tascii -ww -z " + (folder / "sheaf.1") + " 2>&1";
  const std::string into = folder / "warnings";
  EXPECT_EQ(std::system((groff + " >" + into).c_str()), 0);
  std::ifstream warnings(into);
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(warnings), {}), "");
}

}  // namespace
}  // namespace sheaf
