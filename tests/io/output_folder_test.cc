// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "io/output_folder.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <string>
#include <thread>

#include "end_to_end/command.h"
#include "io/folder_files.h"

namespace sheaf {
namespace {

namespace fs = std::filesystem;

struct stat status_of(const fs::path& path) {
  struct stat status {};
  EXPECT_EQ(::stat(path.c_str(), &status), 0) << path;
  return status;
}

class WholeOutputs : public testing::Test {
 protected:
  void put(const std::string& name, const std::string& text) {
    OutputFile out = OutputFile::create(folder_ / name, Compression::none).value();
    out.write(text);
    out.commit().value();
  }
  void put_all(const std::string& text) {
    OutputFolder out = OutputFolder::create(folder_ / "model/").value();
    for (const char* name : {"a", "b", "inner/c"}) write_bytes(out, name, text).value();
    out.commit().value();
  }
  TemporaryFolder folder_;
};

TEST_F(WholeOutputs, KeepModeAndOwnerOfWhatTheyReplace) {
  write_text(folder_ / "a", "old");
  ASSERT_EQ(::chmod((folder_ / "a").c_str(), 0640), 0);
  // Only root may give files away; another user's file is his own already.
  EXPECT_EQ(::chown((folder_ / "a").c_str(), 12345, 54321) == 0, ::geteuid() == 0);
  const struct stat before = status_of(folder_ / "a");
  put("a", "new");
  const struct stat after = status_of(folder_ / "a");
  EXPECT_EQ(contents_of(folder_ / "a"), "new");
  EXPECT_EQ(after.st_mode & 07777, 0640u);
  EXPECT_EQ(after.st_uid, before.st_uid);
  EXPECT_EQ(after.st_gid, before.st_gid);
}

TEST_F(WholeOutputs, GoThroughLinksThatLeadToNothingYet) {
  fs::create_directory(folder_ / "there");
  fs::create_symlink("there/file", folder_ / "link");
  put("link", "one");
  EXPECT_TRUE(fs::is_symlink(folder_ / "link"));
  EXPECT_EQ(contents_of(folder_ / "there/file"), "one");
  put("link", "two");
  EXPECT_TRUE(fs::is_symlink(folder_ / "link"));
  EXPECT_EQ(contents_of(folder_ / "there/file"), "two");
  fs::create_directory_symlink("real", folder_ / "model");
  put_all("one");
  put_all("two");
  EXPECT_TRUE(fs::is_symlink(folder_ / "model"));
  EXPECT_EQ(contents_of(folder_ / "real/inner/c"), "two");
  EXPECT_EQ(folder_.names(), (std::vector<std::string>{"link", "model", "real", "there"}));
}

// A killed process leaves partial files; one that lives is left alone, whatever numbers they have.
TEST_F(WholeOutputs, CleanWhatDeadProcessesLeft) {
  for (const char* name : {"a.sheaf-partial-0", "a.sheaf-partial-1", "a.sheaf-partial-2"})
    write_text(folder_ / name, "left");
  fs::create_directories(folder_ / "model.sheaf-partial-0/inner");
  write_text(folder_ / "model.sheaf-partial-0/inner/a", "left");
  const int living = ::open((folder_ / "a.sheaf-partial-1").c_str(), O_RDWR);
  ASSERT_EQ(::flock(living, LOCK_EX), 0);
  put("a", "new");
  put_all("new");
  EXPECT_EQ(folder_.names(), (std::vector<std::string>{"a", "a.sheaf-partial-1", "model"}));
  ::close(living);
  put("a", "new");
  EXPECT_EQ(folder_.names(), (std::vector<std::string>{"a", "model"}));
}

TEST_F(WholeOutputs, TwoWritersDoNotMeet) {
  OutputFile first = OutputFile::create(folder_ / "a", Compression::none).value();
  OutputFile second = OutputFile::create(folder_ / "a", Compression::none).value();
  first.write("first"), second.write("second");
  ASSERT_TRUE(second.commit().ok());
  EXPECT_EQ(contents_of(folder_ / "a"), "second");
  ASSERT_TRUE(first.commit().ok());
  EXPECT_EQ(contents_of(folder_ / "a"), "first");
  EXPECT_EQ(folder_.names(), std::vector<std::string>{"a"});
}

TEST_F(WholeOutputs, FoldersKeepOtherFilesAsTheyAre) {
  put_all("old");
  fs::create_directories(folder_ / "model/mine/deep");
  write_text(folder_ / "model/notes", "mine");
  write_text(folder_ / "model/inner/d", "mine");
  write_text(folder_ / "model/mine/deep/e", "mine");
  fs::create_symlink("notes", folder_ / "model/link");
  ASSERT_EQ(::chmod((folder_ / "model").c_str(), 0750), 0);
  ASSERT_EQ(::chmod((folder_ / "model/a").c_str(), 0600), 0);
  const struct stat notes = status_of(folder_ / "model/notes");
  const struct stat deep = status_of(folder_ / "model/mine/deep/e");
  const struct stat d = status_of(folder_ / "model/inner/d");
  const struct stat before = status_of(folder_ / "model");
  put_all("new");
  EXPECT_NE(status_of(folder_ / "model").st_ino, before.st_ino) << "was not exchanged";
  EXPECT_EQ(status_of(folder_ / "model").st_mode & 07777, 0750u);
  EXPECT_EQ(status_of(folder_ / "model/a").st_mode & 07777, 0600u);
  EXPECT_EQ(status_of(folder_ / "model/notes").st_ino, notes.st_ino);
  EXPECT_EQ(status_of(folder_ / "model/notes").st_nlink, 1u);
  EXPECT_EQ(status_of(folder_ / "model/mine/deep/e").st_ino, deep.st_ino);
  EXPECT_EQ(status_of(folder_ / "model/inner/d").st_ino, d.st_ino);
  EXPECT_TRUE(fs::is_symlink(folder_ / "model/link"));
  for (const char* name : {"a", "b", "inner/c"})
    EXPECT_EQ(contents_of(folder_ / (std::string("model/") + name)), "new");
  EXPECT_EQ(folder_.names(), std::vector<std::string>{"model"});
}

// Whoever opens the folder finds files of one generation in it, at every instant.
TEST_F(WholeOutputs, FoldersAreOldOrNewAtEveryInstant) {
  put_all("0");
  std::atomic<bool> over = false;
  int looked = 0, mixed = 0;
  std::thread reader([&] {
    const auto text = [](int folder, const char* name) {
      char bytes[16] = "";
      const int fd = ::openat(folder, name, O_RDONLY);
      if (fd < 0) return std::string("gone");
      const ssize_t n = ::read(fd, bytes, sizeof bytes);
      ::close(fd);
      return std::string(bytes, n > 0 ? static_cast<std::size_t>(n) : 0);
    };
    while (!over) {
      const int model = ::open((folder_ / "model").c_str(), O_RDONLY | O_DIRECTORY);
      const std::string a = text(model, "a"), b = text(model, "b"), c = text(model, "inner/c");
      struct stat own, named;
      const bool replaced = ::fstat(model, &own) != 0 ||
                            ::stat((folder_ / "model").c_str(), &named) != 0 ||
                            own.st_ino != named.st_ino;
      ::close(model);
      if (replaced) continue;  // the old folder is being removed
      ++looked;
      if (a != b || b != c || a == "gone") ++mixed;
    }
  });
  for (int i = 1; i <= 50; ++i) put_all(std::to_string(i));
  over = true;
  reader.join();
  EXPECT_GT(looked, 50);
  EXPECT_EQ(mixed, 0) << "of " << looked;
}

TEST_F(WholeOutputs, AFolderThatIsNotFinishedIsAsItWas) {
  put_all("old");
  const struct stat before = status_of(folder_ / "model");
  {
    OutputFolder out = OutputFolder::create(folder_ / "model").value();
    write_bytes(out, "a", "new").value();
    EXPECT_FALSE(write_bytes(out, "../a", "new").ok());
    EXPECT_FALSE(write_bytes(out, "inner", "new").ok());
  }
  EXPECT_EQ(status_of(folder_ / "model").st_ino, before.st_ino);
  EXPECT_EQ(contents_of(folder_ / "model/a"), "old");
  EXPECT_EQ(folder_.names(), std::vector<std::string>{"model"});
}

// Where it cannot be exchanged: it is where this process stands, or a file in it is a link.
TEST_F(WholeOutputs, FoldersThatCannotBeExchangedAreWrittenFileByFile) {
  put_all("old");
  write_text(folder_ / "far", "old");
  fs::remove(folder_ / "model/b");
  fs::create_symlink("../far", folder_ / "model/b");
  const struct stat before = status_of(folder_ / "model");
  put_all("linked");
  EXPECT_TRUE(fs::is_symlink(folder_ / "model/b"));
  EXPECT_EQ(contents_of(folder_ / "far"), "linked");
  EXPECT_EQ(contents_of(folder_ / "model/inner/c"), "linked");
  const fs::path here = fs::current_path();
  fs::current_path(folder_ / "model/inner");
  put_all("here");
  EXPECT_EQ(contents_of("c"), "here");
  fs::current_path(here);
  EXPECT_EQ(contents_of(folder_ / "model/a"), "here");
  EXPECT_EQ(status_of(folder_ / "model").st_ino, before.st_ino);
  EXPECT_EQ(folder_.names(), (std::vector<std::string>{"far", "model"}));
}

TEST_F(WholeOutputs, NamesOfOpenDescriptorsAreWrittenInto) {
  const int fd = ::open((folder_ / "a").c_str(), O_WRONLY | O_CREAT | O_APPEND, 0600);
  ASSERT_EQ(::write(fd, "before ", 7), 7);
  OutputFile out = OutputFile::create("/dev/fd/" + std::to_string(fd), Compression::none).value();
  out.write("after");
  ASSERT_TRUE(out.commit().ok());
  ::close(fd);
  EXPECT_EQ(contents_of(folder_ / "a"), "before after");
}

}  // namespace
}  // namespace sheaf
