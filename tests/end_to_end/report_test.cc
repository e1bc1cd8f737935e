// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "chart/number_text.h"
#include "end_to_end/command.h"

namespace sheaf {
namespace {

class ReportCommand : public testing::Test {
 protected:
  void SetUp() override { ASSERT_EQ(run({"generate", "in.txt", "--points", "300"}).exit_code, 0); }
  Outcome run(const std::vector<std::string>& arguments) {
    return run_command(arguments, folder_.path());
  }
  std::string page(const std::string& name) { return contents_of(folder_ / name); }
  static bool has(const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
  }
  TemporaryFolder folder_;
};

TEST_F(ReportCommand, SolveAndReportMakeOnePage) {
  ASSERT_EQ(run({"solve", "in.txt", "-o", "out it.txt", "--json", "s.json", "--report", "a.html",
                 "--loss", "huber:2"})
                .exit_code,
            0);
  EXPECT_EQ(json_of(folder_ / "s.json")["command"],
            "sheaf solve in.txt -o 'out it.txt' --report a.html --loss huber:2 --json s.json");
  const std::string first = page("a.html");
  for (const char* part : {"<h1>in", "id=\"run\"", "huber:2", "id=\"settings\"", ">before <span>"})
    EXPECT_TRUE(has(first, part)) << part;
  const Outcome again = run({"report", "in.txt", "out it.txt", "--summary", "s.json", "-o",
                             "b.html", "--json", "report.json"});
  ASSERT_EQ(again.exit_code, 0) << again.err;
  EXPECT_TRUE(has(page("b.html"), "id=\"run\""));
  EXPECT_EQ(json_of(folder_ / "report.json")["report"]["bytes"], page("b.html").size());
  ASSERT_EQ(
      run({"report", "in.txt", "out it.txt", "--summary", "s.json", "-o", "c.html"}).exit_code, 0);
  EXPECT_EQ(page("b.html"), page("c.html"));
}

TEST_F(ReportCommand, SensorsOfRigsHaveTheirSigmas) {
  ASSERT_EQ(
      run({"generate", "rig", "--rigs", "stereo", "--frames", "9", "--points", "400"}).exit_code,
      0);
  ASSERT_EQ(run({"solve", "rig", "--report", "a.html", "--sigmas", "sigmas.json"}).exit_code, 0);
  const auto sensor = json_of(folder_ / "sigmas.json")["sensors"][1];
  const auto length = [&](const char* key) {
    double sum = 0;
    for (const double sigma : sensor[key]) sum += sigma * sigma;
    return digits(std::sqrt(sum), 2);
  };
  const std::string row = ">camera 2</th><td>0</td><td>" + length("translation_sigma") +
                          "</td><td>" + length("rotation_sigma_deg") + "</td></tr></tbody>";
  EXPECT_TRUE(has(page("a.html"), row)) << row;
}

TEST_F(ReportCommand, WhatIsWrongIsSaid) {
  EXPECT_EQ(run({"report", "in.txt"}).exit_code, 2);
  EXPECT_EQ(run({"report", "in.txt", "-o", "in.txt"}).exit_code, 2);
  EXPECT_EQ(run({"report", "none.txt", "-o", "a.html"}).exit_code, 3);
  write_text(folder_ / "s.json", "{\"version\": \"0\"}");
  const Outcome outcome = run({"report", "in.txt", "--summary", "s.json", "-o", "a.html"});
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_TRUE(has(outcome.err, "s.json: found no")) << outcome.err;
  EXPECT_EQ(run({"report", "in.txt", "-o", "no/where/a.html"}).exit_code, 6);
  ASSERT_EQ(run({"generate", "other.txt", "--points", "300", "--cameras", "9"}).exit_code, 0);
  EXPECT_EQ(run({"report", "other.txt", "in.txt", "-o", "a.html"}).exit_code, 2);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "a.html"));
}

TEST_F(ReportCommand, ViewSaysWhereThePageIs) {
  const Outcome outcome = run({"view", "in.txt", "--no-open", "--json", "v.json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const std::filesystem::path path(
      json_of(folder_ / "v.json")["report"]["path"].get<std::string>());
  EXPECT_TRUE(has(contents_of(path), "<!doctype html>"));
  std::filesystem::remove_all(path.parent_path());
}

TEST_F(ReportCommand, PhotometricRunsHaveOneToo) {
  ASSERT_EQ(run({"generate", "scene", "--photometric", "--points", "200"}).exit_code, 0);
  const Outcome outcome = run({"photometric", "scene", "--report", "p.html"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  for (const char* part : {"id=\"patches\"", "data:image/png", "grey levels²", "id=\"run\""})
    EXPECT_TRUE(has(page("p.html"), part)) << part;
}

TEST_F(ReportCommand, JsonIsDocumented) {
  ASSERT_EQ(run({"report", "in.txt", "-o", "a.html", "--json", "report.json"}).exit_code, 0);
  const auto document = json_of(folder_ / "report.json");
  const std::string docs = contents_of("docs/json.md");
  for (const auto& [key, value] : document.items()) EXPECT_TRUE(has(docs, "`" + key)) << key;
}

}  // namespace
}  // namespace sheaf
