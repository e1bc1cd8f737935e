// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
//
// COLMAP itself reads what was solved and written: by a Python that imports pycolmap,
// $SHEAF_PYCOLMAP_PYTHON or the one of the other tests.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "end_to_end/command.h"
#include "end_to_end/rig_folders.h"
#include "sheaf/camera.h"

namespace sheaf {
namespace {

#ifdef SHEAF_PYTHON
constexpr int kNoPycolmap = 77;

class ColmapAgrees : public testing::Test {
 protected:
  Outcome run(const std::vector<std::string>& arguments) {
    return run_command(arguments, folder_.path());
  }
  /// Exit code of the script on a model, and what it said.
  int ask(const std::string& model, std::string& said) {
    EXPECT_EQ(run({"info", model, "--json", "info.json"}).exit_code, 0);
    return compare("colmap_agrees.py", folder_ / model, folder_ / "info.json", said);
  }
  /// Exit code of a script of this folder on two models, and what it said.
  int compare(const std::string& script, const std::string& first, const std::string& second,
              std::string& said) {
    const char* python = std::getenv("SHEAF_PYCOLMAP_PYTHON");
    const std::string line = std::string(python ? python : SHEAF_PYTHON) +
                             " " SHEAF_SOURCE_DIR "/tests/end_to_end/" + script + " '" + first +
                             "' '" + second + "' > '" + (folder_ / "said.txt") + "' 2>&1";
    const int status = std::system(line.c_str());
    said = contents_of(folder_ / "said.txt");
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  TemporaryFolder folder_;
};

TEST_F(ColmapAgrees, OnGeneratedModelsOfEveryCamera) {
  for (std::size_t m = 0; m < kCameraModels; ++m) {
    const std::string name(to_string(static_cast<CameraModel>(m)));
    if (name == "DOUBLE_SPHERE") continue;  // nothing of COLMAP's sees the same
    std::vector<std::string> words = {"generate", name,       "--camera", name,        "--lenses",
                                      "2",        "--points", "300",      "--cameras", "12"};
    // COLMAP has no residuals behind the image plane.
    if (name.find("FISHEYE") != name.npos || name.find("UCM") != name.npos || name == "FOV" ||
        name == "EQUIRECTANGULAR")
      words.insert(words.end(), {"--field-of-view", "150"});
    ASSERT_EQ(run(words).exit_code, 0);
    ASSERT_EQ(run({"solve", name, "-o", name + "-own/", "--quiet"}).exit_code, 0) << name;
    ASSERT_EQ(run({"convert", name + "-own", name + "-solved/", "--format", "colmap"}).exit_code, 0)
        << name;
    std::string said;
    const int status = ask(name + "-solved", said);
    if (status == kNoPycolmap) GTEST_SKIP() << "no pycolmap";
    EXPECT_EQ(status, 0) << name << ": " << said;
  }
}

/// Rigs, frames and poses are those that COLMAP reads, in both forms.
TEST_F(ColmapAgrees, OnRigs) {
  test::make_stale_folder(folder_, "stale");
  test::make_imu_folder(folder_, "imu");
  for (const std::string name : {"stale", "imu"}) {
    std::filesystem::remove_all(folder_ / (name + "-binary"));  // what it was made from
    ASSERT_EQ(run({"convert", name, name + "-binary", "--format", "colmap"}).exit_code, 0);
    ASSERT_EQ(
        run({"convert", name + "-binary", name + "-text", "--format", "colmap-text"}).exit_code, 0);
    for (const std::string form : {"-binary", "-text"}) {
      std::string said;
      int status = compare("colmap_rigs_agree.py", folder_ / (name + form),
                           folder_ / (name + "-text"), said);
      if (status == kNoPycolmap) GTEST_SKIP() << "no pycolmap";
      EXPECT_EQ(status, 0) << name << form << ": " << said;
      // Costs too; the errors of points that the text states are not COLMAP's own.
      status = ask(name + form, said);
      EXPECT_EQ(status, 0) << name << form << ": " << said;
    }
  }
}

TEST_F(ColmapAgrees, OnRealModels) {
  const char* data = std::getenv("SHEAF_DATA");
  const std::filesystem::path models = std::filesystem::path(data ? data : "data") / "colmap";
  if (!std::filesystem::is_directory(models)) GTEST_SKIP() << "no real models";
  for (const auto& entry : std::filesystem::directory_iterator(models)) {
    std::filesystem::remove_all(folder_ / "solved");
    const std::string path = std::filesystem::absolute(entry.path());
    const Outcome solved = run({"solve", path, "-o", "solved/", "--quiet"});
    ASSERT_EQ(solved.exit_code, 0) << path << solved.err;
    std::string said;
    const int status = ask("solved", said);
    if (status == kNoPycolmap) GTEST_SKIP() << "no pycolmap";
    EXPECT_EQ(status, 0) << path << ": " << said;
  }
}
#endif

}  // namespace
}  // namespace sheaf
