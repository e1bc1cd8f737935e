// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "end_to_end/command.h"
#include "sheaf/io.h"
#include "sheaf/problem.h"

namespace sheaf {
namespace {

using nlohmann::json;

// Keys in the first column of the tables of one section of docs/json.md.
std::set<std::string> documented(const std::string& section) {
  std::istringstream document(contents_of(std::string(SHEAF_SOURCE_DIR) + "/docs/json.md"));
  std::set<std::string> keys;
  const std::regex key("`([^`]+)`");
  bool inside = false;
  for (std::string line; std::getline(document, line);) {
    if (line.rfind("## ", 0) == 0) inside = line == "## " + section;
    if (!inside || line.rfind("| `", 0) != 0) continue;
    const std::string cell = line.substr(2, line.find(" |", 2) - 2);
    for (std::sregex_iterator match(cell.begin(), cell.end(), key), end; match != end; ++match)
      keys.insert((*match)[1]);
  }
  return keys;
}

// Keys of the options of a verb, in the second column of the tables of docs/options.md.
std::set<std::string> documented_options(const std::string& verb) {
  std::istringstream document(contents_of(std::string(SHEAF_SOURCE_DIR) + "/docs/options.md"));
  std::set<std::string> keys;
  const std::regex row(R"(\| `--[^`]+` \| `([^`]+)` \|.*)");
  bool inside = false;
  for (std::string line; std::getline(document, line);) {
    if (line.rfind("## ", 0) == 0) inside = line == "## " + verb;
    if (std::smatch match; inside && std::regex_match(line, match, row))
      keys.insert("options." + match[1].str());
  }
  return keys;
}

bool has_keys(const json& value, const std::set<std::string>& keys) {
  std::set<std::string> found;
  for (const auto& [name, ignored] : value.items()) found.insert(name);
  return found == keys;
}

bool is_list(const json& value) { return has_keys(value, {"count", "first"}); }

// Exactly an object of errors, or with other keys beside.
bool is_errors(const json& value, bool and_more = false) {
  const std::set<std::string> keys = {"aligned",
                                      "scale",
                                      "rotation_error_rad",
                                      "translation_error",
                                      "center_error",
                                      "point_error",
                                      "frame_rotation_error_rad",
                                      "frame_center_error",
                                      "sensor_rotation_error_rad",
                                      "sensor_translation_error"};
  if (!and_more && !has_keys(value, keys)) return false;
  for (const std::string& key : keys)
    if (!value.contains(key)) return false;
  for (const char* kind :
       {"rotation_error_rad", "translation_error", "center_error", "point_error"})
    if (!has_keys(value[kind], {"mean", "median", "rms", "max"})) return false;
  return true;
}

void collect(const json& value, const std::string& at, std::set<std::string>& keys) {
  if (value.is_object() && !is_list(value) && !is_errors(value)) {
    for (const auto& [name, inner] : value.items())
      collect(inner, at.empty() ? name : at + "." + name, keys);
  } else if (value.is_array() && !value.empty() && value[0].is_object()) {
    for (const json& inner : value) collect(inner, at + "[]", keys);
  } else {
    keys.insert(at);
  }
}

std::set<std::string> produced(const json& document) {
  std::set<std::string> keys;
  collect(document, "", keys);
  return keys;
}

class JsonTest : public testing::Test {
 protected:
  void SetUp() override {
    const Outcome outcome =
        run({"generate", "in.txt", "--points", "400", "--json", "generate.json"});
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  }
  Outcome run(const std::vector<std::string>& arguments) {
    return run_command(arguments, folder_.path());
  }
  // Every key that is documented is there, and the other way round.
  void expect_documented(const std::string& verb, const std::vector<std::string>& sections) {
    std::set<std::string> keys;
    for (const std::string& section : sections) {
      keys.merge(documented(section));
      keys.merge(documented_options(section));
    }
    EXPECT_GT(keys.size(), 5u);
    EXPECT_EQ(produced(json_of(folder_ / (verb + ".json"))), keys);
  }
  TemporaryFolder folder_;
};

const char* const kShared = "Parts that several verbs share";

TEST_F(JsonTest, SolveHasTheDocumentedKeys) {
  ASSERT_EQ(run({"solve", "in.txt", "--json", "solve.json"}).exit_code, 0);
  expect_documented("solve", {kShared, "solve"});
}

TEST_F(JsonTest, InfoHasTheDocumentedKeys) {
  ASSERT_EQ(run({"info", "in.txt", "--json", "info.json", "--pattern", "p.svg"}).exit_code, 0);
  expect_documented("info", {kShared, "info"});
  EXPECT_EQ(contents_of(folder_ / "p.svg").rfind("<svg ", 0), 0u);
  const Outcome refused = run({"info", "in.txt", "--pattern", "p.PNG"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_NE(refused.err.find("found p.PNG, expected a name that ends in .svg"), std::string::npos)
      << refused.err;
  ASSERT_EQ(run({"info", "in.txt", "--json", "info.json"}).exit_code, 0);
  EXPECT_TRUE(json_of(folder_ / "info.json")["pattern"].is_null());
}

TEST_F(JsonTest, CheckHasTheDocumentedKeys) {
  write_text(folder_ / "lone.txt",
             "1 2 3\n0 0 1 2\n0 1 3 4\n0 0 1 2\n0 0 0 0 0 0 500 0 0\n0 0 5\n0 0 -4\n");
  ASSERT_EQ(run({"check", "lone.txt", "--json", "check.json"}).exit_code, 0);
  expect_documented("check", {kShared, "check"});
}

TEST_F(JsonTest, ConvertHasTheDocumentedKeys) {
  ASSERT_EQ(run({"convert", "in.txt", "o.txt.gz", "--json", "convert.json"}).exit_code, 0);
  expect_documented("convert", {kShared, "convert"});
  const json document = json_of(folder_ / "convert.json");
  EXPECT_EQ(document["output"]["bytes"], std::filesystem::file_size(folder_ / "o.txt.gz"));
}

TEST_F(JsonTest, GenerateHasTheDocumentedKeys) { expect_documented("generate", {"generate"}); }

TEST_F(JsonTest, PhotometricHasTheDocumentedKeys) {
  ASSERT_EQ(run({"generate", "scene", "--photometric", "--points", "200", "--json", "scene.json"})
                .exit_code,
            0);
  expect_documented("scene", {"generate --photometric"});
  ASSERT_EQ(run({"photometric", "scene", "--json", "photometric.json"}).exit_code, 0);
  expect_documented("photometric", {"photometric"});
}

TEST_F(JsonTest, PerturbHasTheDocumentedKeys) {
  ASSERT_EQ(
      run({"perturb", "in.txt", "o.txt", "--json", "perturb.json", "--outliers", "0.1"}).exit_code,
      0);
  expect_documented("perturb", {kShared, "perturb"});
}

TEST_F(JsonTest, EvaluateHasTheDocumentedKeys) {
  ASSERT_EQ(run({"evaluate", "in.txt", "in.txt", "--json", "evaluate.json"}).exit_code, 0);
  expect_documented("evaluate", {"evaluate"});
  EXPECT_TRUE(is_errors(json_of(folder_ / "evaluate.json"), true));
}

TEST_F(JsonTest, AlignHasTheDocumentedKeys) {
  ASSERT_EQ(run({"align", "in.txt", "-o", "o.txt", "--reference", "in.txt", "--json", "align.json"})
                .exit_code,
            0);
  expect_documented("align", {kShared, "align"});
}

TEST_F(JsonTest, CovarianceHasTheDocumentedKeys) {
  ASSERT_EQ(run({"covariance", "in.txt", "--json", "covariance.json"}).exit_code, 0);
  expect_documented("covariance", {kShared, "covariance"});
}

TEST_F(JsonTest, CovarianceHasWhatIsAskedFor) {
  const std::string corners = std::filesystem::absolute("tests/data/board_corners.vnl");
  ASSERT_EQ(run({"calibrate", corners, "--board", "6x5", "--spacing", "0.14", "--size", "1600x1200",
                 "--distance", "2", "--projection", "sigmas.csv", "--projection-figure",
                 "sigmas.svg", "--json", "calibrate.json", "-o", "lens/"})
                .exit_code,
            0);
  const json calibration = json_of(folder_ / "calibrate.json");
  std::set<std::string> keys = documented("covariance");
  keys.merge(documented("calibrate"));
  for (const std::string& key : produced(calibration)) {  // of a list that the page has as a whole
    const std::string list = key.substr(0, key.find("[]"));
    EXPECT_TRUE(keys.contains(key) || keys.contains(list) ||
                keys.lower_bound(list + "[]")->starts_with(list + "[]"))
        << key;
  }
  const json projection = calibration["projection"];
  ASSERT_EQ(projection.size(), 2u);
  EXPECT_TRUE(projection[0]["distance"].is_null());
  EXPECT_EQ(projection[1]["distance"], 2);
  EXPECT_NEAR(projection[0]["sigma_px"]["min"], 0.59, 0.01);
  for (const char* name : {"sigmas.csv", "sigmas-0-far.svg", "sigmas-0-near.svg"})
    EXPECT_TRUE(std::filesystem::exists(folder_ / name)) << name;
  // A calibration that was written says the same again.
  ASSERT_EQ(run({"covariance", "lens", "--fix", "points", "--refine", "pp", "--sigma", "0.283883",
                 "--projection", "again.csv", "--json", "again.json"})
                .exit_code,
            0);
  EXPECT_NEAR(json_of(folder_ / "again.json")["projection"][0]["sigma_px"]["min"], 0.59, 0.03);
  ASSERT_EQ(run({"covariance", "in.txt", "--json", "pairs.json", "--pairs", "0,1"}).exit_code, 0);
  for (const char* key : {"images", "covariance", "distance", "distance_sigma"})
    EXPECT_TRUE(json_of(folder_ / "pairs.json")["pairs"][0].contains(key)) << key;
}

TEST_F(JsonTest, CompareHasTheDocumentedKeys) {
  ASSERT_EQ(run({"compare", "in.txt", "--json", "compare.json", "--solvers", "sheaf,nobody",
                 "--reference", "in.txt"})
                .exit_code,
            0);
  expect_documented("compare", {"compare"});
  EXPECT_TRUE(is_errors(json_of(folder_ / "compare.json")["runs"][0]["errors"]));
}

TEST_F(JsonTest, DemoHasTheDocumentedKeys) {
  ASSERT_EQ(run({"demo", "--points", "400", "--json", "demo.json"}).exit_code, 0);
  expect_documented("demo", {kShared, "solve", "demo"});
  const json errors = json_of(folder_ / "demo.json")["errors"];
  EXPECT_LT(errors["after"]["point_error"]["median"], errors["before"]["point_error"]["median"]);
}

TEST_F(JsonTest, SolveTellsWhatHappened) {
  ASSERT_EQ(run({"solve",
                 "in.txt",
                 "-o",
                 "o.txt",
                 "--json",
                 "s.json",
                 "--fix",
                 "k1,pose=0",
                 "--max-iterations",
                 "7",
                 "--tolerance",
                 "1e-12",
                 "--threads",
                 "2",
                 "--points",
                 "xyz",
                 "--cheirality",
                 "reject",
                 "--solver",
                 "dense",
                 "--precision",
                 "double",
                 "--initial-damping",
                 "0.01",
                 "--trust-region",
                 "dogleg",
                 "--time-limit",
                 "60"})
                .exit_code,
            0);
  const json s = json_of(folder_ / "s.json");
  EXPECT_EQ(documented_options("solve").size(), s["options"].size());
  EXPECT_EQ(s["options"], (json{{"max_iterations", 7},
                                {"tolerance", 1e-12},
                                {"time_limit_s", 60.0},
                                {"loss", "none"},
                                {"cheirality", "reject"},
                                {"points", "xyz"},
                                {"fix", {"k1", "pose=0"}},
                                {"refine", json::array()},
                                {"precision", "double"},
                                {"solver", "dense"},
                                {"memory_limit_bytes", 0},
                                {"trust_region", "dogleg"},
                                {"initial_damping", 0.01},
                                {"inner_iterations", 3},
                                {"recoveries", 3},
                                {"simd", "best"},
                                {"checkpoint", ""},
                                {"checkpoint_every_s", 60.0},
                                {"resume", ""}}));
  EXPECT_EQ(s["input"]["path"], "in.txt");
  EXPECT_EQ(s["input"]["cameras"], 16);
  EXPECT_EQ(s["input"]["poses"], 16);
  EXPECT_EQ(s["input"]["points"], 400);
  EXPECT_EQ(s["input"]["sha256"].get<std::string>().size(), 64u);
  EXPECT_EQ(s["solver"]["name"], "dense");
  EXPECT_EQ(s["threads"], 2);
  const auto& iterations = s["iterations"];
  EXPECT_LE(iterations.size(), 8u);
  EXPECT_EQ(iterations[0]["cost"], s["initial_cost"]);
  EXPECT_EQ(iterations[0]["trial_cost"], s["initial_cost"]);
  EXPECT_EQ(iterations.back()["cost"], s["final_cost"]);
  for (std::size_t i = 0; i < iterations.size(); ++i) {
    EXPECT_EQ(iterations[i]["index"], i);
    if (i > 0) {
      EXPECT_LE(iterations[i]["cost"], iterations[i - 1]["cost"]);
    }
  }
  EXPECT_EQ(iterations[1]["damping"], 0.01);
  EXPECT_EQ(iterations[1]["radius"], nullptr);
  EXPECT_EQ(iterations[1]["reused"], false);
  const double total = s["time"]["total_s"];
  EXPECT_GE(total, s["time"]["solve_s"].get<double>() + s["time"]["setup_s"].get<double>());
}

TEST_F(JsonTest, CostsAgreeWithIndependentCodeAndCarryEveryDigit) {
  ASSERT_EQ(run({"solve", "in.txt", "-o", "o.txt", "--json", "s.json"}).exit_code, 0);
  const json s = json_of(folder_ / "s.json");
  const Evaluation before = evaluate(read(folder_ / "in.txt").value());
  const Evaluation after = evaluate(read(folder_ / "o.txt").value());
  EXPECT_EQ(s["plain_cost"]["before"].get<double>(), before.cost);
  EXPECT_NEAR(s["plain_cost"]["after"].get<double>(), after.cost, 1e-11 * after.cost);
  EXPECT_NEAR(s["final_cost"].get<double>(), after.cost, 1e-10 * after.cost);
  EXPECT_NEAR(s["initial_cost"].get<double>(), before.cost, 1e-10 * before.cost);
  EXPECT_NEAR(s["rms_px"]["after"].get<double>(), after.rms_px, 1e-10 * after.rms_px);
}

TEST_F(JsonTest, ObservationsBehindTheirCameraAreListed) {
  // Image 0 looks along -z from the origin; point 1 lies behind it.
  write_text(folder_ / "behind.txt",
             "2 2 4\n0 0 1 2\n1 0 3 4\n0 1 5 6\n1 1 7 8\n"
             "0 0 0 0 0 0 500 0 0\n0 0 0 0 0 -30 500 0 0\n0 0 -10\n1 1 20\n");
  ASSERT_EQ(run({"info", "behind.txt", "--json", "i.json"}).exit_code, 0);
  const json list = json_of(folder_ / "i.json")["behind_camera"];
  EXPECT_EQ(list,
            (json{{"count", 1}, {"first", {{{"observation", 2}, {"image", 0}, {"point", 1}}}}}));
  ASSERT_EQ(run({"solve", "behind.txt", "--json", "s.json", "--cheirality", "hold-out",
                 "--max-iterations", "2"})
                .exit_code,
            0);
  const json s = json_of(folder_ / "s.json");
  EXPECT_EQ(s["behind_camera"]["before"], list);
  EXPECT_EQ(s["rejected_observations"], list);
}

TEST_F(JsonTest, ProgressGoesToStderrAndQuietSilencesIt) {
  const Outcome loud = run({"solve", "in.txt"});
  EXPECT_NE(loud.err.find("iteration 1"), std::string::npos);
  EXPECT_EQ(loud.out.find("iteration 1"), std::string::npos);
  EXPECT_NE(loud.out.find("cost"), std::string::npos);
  for (const char* verb : {"solve", "info"}) {
    const Outcome quiet = run({verb, "in.txt", "--quiet"});
    EXPECT_EQ(quiet.exit_code, 0);
    EXPECT_EQ(quiet.err, "");
    EXPECT_NE(quiet.out, "");
  }
}

}  // namespace
}  // namespace sheaf
