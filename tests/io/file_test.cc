// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <thread>

#include "io/bytes.h"
#include "io/output_file.h"
#include "sheaf/io.h"

namespace sheaf {
namespace {

Problem small_problem() {
  Problem problem;
  problem.add_image({{1, 0, 0, 0}, {0, 0, -5}}, Camera{CameraModel::bal, {500, 0, 0}});
  problem.add_point(1, 2, 3);
  problem.add_observation(0, 0, 1, 2);
  return problem;
}

std::string message_of(const Result<void>& result) {
  if (result.ok()) return "no error";
  EXPECT_EQ(result.error().code(), ErrorCode::unwritable_output);
  return result.error().what();
}

TEST(ReadFile, SaysWhyAFileCannotBeRead) {
  const test::Folder folder;
  test::spill(folder / "empty", "");
  std::filesystem::create_directory(folder / "folder");
  const auto message = [&](const std::string& name) {
    const Result<InputFile> result = read_file(folder / name, {.hash = true});
    EXPECT_FALSE(result.ok());
    EXPECT_EQ(result.error().code(), ErrorCode::unreadable_input);
    return std::string(result.error().what());
  };
  const std::string place = (folder / "").string();
  EXPECT_EQ(message("missing"),
            place + "missing: found: No such file or directory, expected a readable file");
  EXPECT_EQ(message("empty"), place + "empty: found an empty file, expected text");
  EXPECT_EQ(message("folder"),
            place +
                "folder: found a folder without cameras.bin or cameras.txt, expected a file or "
                "the folder of a COLMAP model");
}

TEST(ReadFile, HashesOnlyWhenAsked) {
  const test::Folder folder;
  test::spill(folder / "f", "1 1 1\n0 0 1 2\n0 0 0 0 0 -5 500 0 0\n1 2 3\n");
  EXPECT_EQ(read_file(folder / "f").value().sha256, "");
  // By sha256sum of coreutils.
  EXPECT_EQ(read_file(folder / "f", {.hash = true}).value().sha256,
            "52f6f9772cafd6f78283a7553e9b268a47c358e783ef4020cf68414a96f2a66f");
}

TEST(WriteFile, RefusesWhatCannotBeWrittenAndLeavesNothing) {
  const test::Folder folder;
  std::filesystem::create_directory(folder / "folder");
  test::spill(folder / "file", "kept");
  for (const auto& attempt :
       {+[](const std::filesystem::path& path) { return write(small_problem(), path); },
        +[](const std::filesystem::path& path) { return check_writable(path); },
        +[](const std::filesystem::path& path) {
          return write_ply(small_problem(), small_problem(), path);
        }}) {
    EXPECT_NE(message_of(attempt(folder / "absent/out.txt")).find("No such file"),
              std::string::npos);
    EXPECT_NE(message_of(attempt(folder / "file/out.txt")).find("Not a directory"),
              std::string::npos);
    EXPECT_NE(message_of(attempt("")).find("name is empty"), std::string::npos);
  }
  EXPECT_EQ(folder.files(), 2u);
  EXPECT_EQ(test::slurp(folder / "file"), "kept");
  // A folder is for models.
  const std::filesystem::path model = folder / "folder";
  EXPECT_NE(message_of(check_writable(model)).find("is a directory"), std::string::npos);
  EXPECT_NE(message_of(write(small_problem(), model, {.format = "bal"})).find("is a directory"),
            std::string::npos);
  EXPECT_TRUE(check_writable(model, true).ok());
  EXPECT_TRUE(check_writable(folder / "new/", true).ok());
  EXPECT_FALSE(check_writable(folder / "absent/new/", true).ok());
}

TEST(WriteFile, AFullDiskIsAnError) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "no /dev/full";
  EXPECT_NE(message_of(write(small_problem(), "/dev/full")).find("No space left"),
            std::string::npos);
}

TEST(WriteFile, WritesDevicesDirectly) {
  EXPECT_TRUE(write(small_problem(), "/dev/null").ok());
  EXPECT_TRUE(check_writable("/dev/null").ok());
  EXPECT_TRUE(std::filesystem::is_character_file("/dev/null"));
}

TEST(WriteFile, WritesPipesDirectly) {
  const test::Folder folder;
  const std::filesystem::path fifo = folder / "fifo";
  ASSERT_EQ(::mkfifo(fifo.c_str(), 0600), 0);
  EXPECT_TRUE(check_writable(fifo).ok());  // and does not wait for a reader
  Result<Problem> received = Error(ErrorCode::usage, "nothing was read");
  std::thread reader([&] { received = read(fifo); });
  EXPECT_TRUE(write(small_problem(), fifo).ok());
  reader.join();
  ASSERT_TRUE(received.ok()) << received.error().what();
  EXPECT_EQ(received.value().points, small_problem().points);
  EXPECT_EQ(folder.files(), 1u);
}

TEST(WriteFile, ReplacesTheTargetKeepingModeAndLinks) {
  const test::Folder folder;
  test::spill(folder / "target", "old");
  ::chmod((folder / "target").c_str(), 0640);
  std::filesystem::create_symlink("target", folder / "link");
  ASSERT_TRUE(write(small_problem(), folder / "link").ok());
  EXPECT_TRUE(std::filesystem::is_symlink(folder / "link"));
  EXPECT_EQ(read(folder / "target").value().points, small_problem().points);
  struct stat status;
  ASSERT_EQ(::stat((folder / "target").c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 07777, 0640u);
  EXPECT_EQ(folder.files(), 2u);
}

TEST(WriteFile, TakesNamesOfAnyAllowedLength) {
  const test::Folder folder;
  const std::string name(255, 'n');
  EXPECT_TRUE(write(small_problem(), folder / name).ok());
  EXPECT_NE(message_of(write(small_problem(), folder / (name + "n"))), "no error");
  EXPECT_EQ(folder.files(), 1u);
}

TEST(WriteFile, CheckLeavesTheTargetAlone) {
  const test::Folder folder;
  EXPECT_TRUE(check_writable(folder / "new").ok());
  EXPECT_EQ(folder.files(), 0u);
  test::spill(folder / "old", "kept");
  EXPECT_TRUE(check_writable(folder / "old").ok());
  EXPECT_EQ(test::slurp(folder / "old"), "kept");
  EXPECT_EQ(folder.files(), 1u);
}

TEST(OutputFile, LeavesNothingWithoutCommit) {
  const test::Folder folder;
  for (Compression compression : {Compression::none, Compression::gzip, Compression::bzip2}) {
    Result<OutputFile> out = OutputFile::create(folder / "out", compression);
    ASSERT_TRUE(out.ok());
    out.value().write(std::string(1 << 20, 'x'));
    EXPECT_EQ(folder.files(), 1u);  // the partial one
  }
  EXPECT_EQ(folder.files(), 0u);
}

}  // namespace
}  // namespace sheaf
