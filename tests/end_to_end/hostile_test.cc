// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "end_to_end/command.h"
#include "sheaf/io.h"

// Inputs that somebody made to do harm, or that came about by accident.
namespace sheaf {
namespace {

namespace fs = std::filesystem;
using Words = std::vector<std::string>;

class Hostile : public testing::Test {
 protected:
  Outcome run(const Words& arguments) { return run_command(arguments, folder_.path()); }
  void expect_plain(const std::string& text) {
    const auto control = [](unsigned char c) { return (c < 0x20 && c != '\n') || c == 0x7f; };
    EXPECT_TRUE(std::none_of(text.begin(), text.end(), control)) << text;
  }
  TemporaryFolder folder_;
};

TEST_F(Hostile, PipesAndDevicesInModelsAreRefused) {
  ASSERT_EQ(run({"generate", "model", "--camera", "PINHOLE", "--points", "50"}).exit_code, 0);
  for (const char* name : {"model/points3D.bin", "model/cameras.bin"}) {
    fs::rename(folder_ / name, folder_ / "kept");
    ASSERT_EQ(mkfifo((folder_ / name).c_str(), 0600), 0);
    const Outcome pipe = run({"info", "model"});
    EXPECT_EQ(pipe.exit_code, 3);
    EXPECT_NE(pipe.err.find("found a pipe or a device"), std::string::npos) << pipe.err;
    fs::remove(folder_ / name);
    fs::create_symlink("/dev/zero", folder_ / name);
    EXPECT_EQ(run({"info", "model"}).exit_code, 3);
    fs::remove(folder_ / name);
    fs::rename(folder_ / "kept", folder_ / name);
  }
  ASSERT_EQ(run({"generate", "images", "--photometric", "--points", "50"}).exit_code, 0);
  fs::remove(folder_ / "images/1.png");
  ASSERT_EQ(mkfifo((folder_ / "images/1.png").c_str(), 0600), 0);
  const Outcome image = run({"photometric", "images"});
  EXPECT_EQ(image.exit_code, 3);
  EXPECT_NE(image.err.find("found a pipe or a device"), std::string::npos) << image.err;
}

// A terminal would be told to hide, to recolour or to type what a name says.
TEST_F(Hostile, ControlCharactersOfNamesAreShownAsEscapes) {
  const std::string name = "a\x1b[31m\n\x07\xc2\x9b\xe2\x80\xae\xff.txt";
  const std::string shown = "a\\x1b[31m\\n\\x07\\u{9b}\\u{202e}\\xff.txt";
  const Outcome missing = run({"info", name});
  EXPECT_EQ(missing.exit_code, 3);
  expect_plain(missing.err);
  EXPECT_NE(missing.err.find(shown), std::string::npos) << missing.err;
  ASSERT_EQ(run({"generate", name, "--points", "50"}).exit_code, 0);
  const Outcome there = run({"info", name, "--json", "o.json"});
  EXPECT_EQ(there.exit_code, 0) << there.err;
  expect_plain(there.out);
  EXPECT_NE(there.out.find(shown), std::string::npos) << there.out;
  // JSON has its own escapes, and no bytes that are no text.
  EXPECT_EQ(json_of(folder_ / "o.json")["input"]["path"],
            "a\x1b[31m\n\x07\xc2\x9b\xe2\x80\xae\xef\xbf\xbd.txt");
  const Outcome option = run({"solve", "--\x1b[2J"});
  EXPECT_EQ(option.exit_code, 2);
  expect_plain(option.err);
}

TEST_F(Hostile, WhatPeersSayIsShownAsEscapes) {
  ASSERT_EQ(run({"generate", "in.txt", "--points", "50"}).exit_code, 0);
  fs::create_directory(folder_ / "peers");
  write_text(folder_ / "peers/peer-rude", "#!/bin/sh\nprintf '\\033[2Jgone' >&2\nexit 9\n");
  fs::permissions(folder_ / "peers/peer-rude", fs::perms::owner_all);
  const Outcome outcome = run({"compare", "in.txt", "--solvers", "rude", "--peers", "peers"});
  EXPECT_NE((outcome.out + outcome.err).find("\\x1b[2Jgone"), std::string::npos) << outcome.err;
  expect_plain(outcome.out);
  expect_plain(outcome.err);
}

// A killed comparison leaves neither its peer nor, after the next one, its files.
TEST_F(Hostile, PeersEndWithCompare) {
  ASSERT_EQ(run({"generate", "in.txt", "--points", "50"}).exit_code, 0);
  fs::create_directory(folder_ / "peers");
  fs::create_directory(folder_ / "tmp");
  write_text(folder_ / "peers/peer-hang",
             "#!/bin/sh\necho $$ > " + (folder_ / "pid") + "\nexec sleep 1000\n");
  fs::permissions(folder_ / "peers/peer-hang", fs::perms::owner_all);
  const std::string script = "TMPDIR=tmp exec " + command_path() + " compare in.txt --peers peers ";
  RunningCommand command("/bin/sh", {"-c", script + "--solvers hang"}, folder_.path());
  for (int i = 0; i < 500 && contents_of(folder_ / "pid").find('\n') == std::string::npos; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  const pid_t peer = std::stoi(contents_of(folder_ / "pid"));
  EXPECT_EQ(kill(peer, 0), 0);
  command.send(SIGKILL);
  command.wait();
  const auto runs = [&] {
    const std::string status = contents_of("/proc/" + std::to_string(peer) + "/stat");
    return !status.empty() && status.find(") Z ") == std::string::npos;
  };
  for (int i = 0; i < 300 && runs(); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  EXPECT_FALSE(runs()) << "the peer outlived its comparison";
  run_program("/bin/sh", {"-c", script + "--solvers sheaf"}, folder_.path());
  EXPECT_TRUE(fs::is_empty(folder_ / "tmp"));
}

// What `read` would refuse is not written, and wrong places are errors.
TEST_F(Hostile, ProblemsInMemoryAreHeldToTheSameRules) {
  ASSERT_EQ(run({"generate", "model", "--camera", "PINHOLE", "--points", "50"}).exit_code, 0);
  const Problem good = read(folder_ / "model").value();
  const auto expect_not_written = [&](const auto& change, const char* words) {
    Problem problem = good;
    SceneMetadata metadata = *good.metadata;
    change(metadata);
    problem.metadata = std::make_shared<const SceneMetadata>(metadata);
    for (const char* form : {"colmap", "colmap-text"}) {
      const Result<void> written = write(problem, folder_ / "out", {.format = form});
      ASSERT_FALSE(written.ok()) << words;
      EXPECT_EQ(written.error().code(), ErrorCode::usage);
      EXPECT_NE(std::string(written.error().what()).find(words), std::string::npos)
          << written.error().what();
    }
  };
  expect_not_written([](SceneMetadata& m) { m.image_ids[1] = m.image_ids[0]; }, "image's id");
  expect_not_written([](SceneMetadata& m) { m.point_ids[1] = m.point_ids[0]; }, "point's id");
  expect_not_written([](SceneMetadata& m) { m.camera_ids[1] = m.camera_ids[0]; }, "camera's id");
  expect_not_written([](SceneMetadata& m) { m.image_names[1] = "a\nb"; }, "line's end");
  expect_not_written([](SceneMetadata& m) { m.image_names[1] = std::string("a\0b", 3); }, "zero");
  EXPECT_FALSE(fs::exists(folder_ / "out"));
  const auto expect_thrown = [&](const auto& change) {
    Problem problem = good;
    change(problem);
    EXPECT_THROW(evaluate(problem), Error);
  };
  expect_thrown([](Problem& p) { p.observation_image[3] = 4000000000u; });
  expect_thrown([](Problem& p) { p.observation_point[3] = 4000000000u; });
  expect_thrown([](Problem& p) { p.image_camera[0] = 4000000000u; });
  expect_thrown([](Problem& p) { p.observation_xy.pop_back(); });
  expect_thrown([](Problem& p) { p.points.pop_back(); });
}

}  // namespace
}  // namespace sheaf
