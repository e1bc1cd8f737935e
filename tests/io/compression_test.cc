// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <thread>

#include "io/bal.h"
#include "io/bytes.h"
#include "sheaf/io.h"

namespace sheaf {
namespace {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kSanitized = true;
#elif defined(__has_feature)
constexpr bool kSanitized = __has_feature(address_sanitizer) || __has_feature(thread_sanitizer);
#else
constexpr bool kSanitized = false;
#endif

using test::bzip2;
using test::gzip;

const std::string kFirst = "1 1 1\n0 0 1 2\n";
const std::string kSecond = "0 0 0 0 0 -5 500 0 0\n1 2 3\n";
const std::string kText = kFirst + kSecond;

/// Some thousand observations whose pixels do not compress to nothing.
std::string long_text(std::size_t observations) {
  std::string text = "1 1 " + std::to_string(observations) + "\n";
  for (std::size_t i = 0; i < observations; ++i)
    text += "0 0 " + std::to_string(i * 7919 % 100003) + ".25 " + std::to_string(i % 977) + "\n";
  return text + kSecond;
}

std::string error_of(const std::string& bytes) {
  const Result<Problem> result = parse_bal(bytes, "f");
  if (result.ok()) return "read without an error";
  EXPECT_EQ(result.error().code(), ErrorCode::unreadable_input);
  return result.error().what();
}

TEST(Compression, IsToldByContentNotByName) {
  const test::Folder folder;
  test::spill(folder / "a.bz2", gzip(kText));
  test::spill(folder / "b.gz", bzip2(kText));
  test::spill(folder / "c.gz", kText);
  test::spill(folder / "d.ply", gzip(kText));
  EXPECT_EQ(read_file(folder / "a.bz2").value().compression, "gzip");
  EXPECT_EQ(read_file(folder / "b.gz").value().compression, "bzip2");
  EXPECT_EQ(read_file(folder / "c.gz").value().compression, "none");
  EXPECT_EQ(read_file(folder / "d.ply").value().compression, "gzip");
  EXPECT_EQ(read_file(folder / "d.ply").value().format, "bal");
}

TEST(Compression, FollowsTheNameWhenWriting) {
  const test::Folder folder;
  const Problem problem = parse_bal(kText, "f").value();
  for (const auto& [name, magic] :
       {std::pair{"a.gz", "\x1f\x8b"}, {"a.bz2", "BZh"}, {"a", "1 1 1"}}) {
    ASSERT_TRUE(write(problem, folder / name).ok());
    EXPECT_EQ(test::slurp(folder / name).rfind(magic, 0), 0u) << name;
    EXPECT_EQ(read(folder / name).value().points, problem.points);
  }
}

TEST(Compression, SeveralMembersAreOneText) {
  const std::string empty_member = gzip("");
  for (const std::string& bytes :
       {gzip(kFirst) + gzip(kSecond), bzip2(kFirst) + bzip2(kSecond),
        empty_member + gzip(kFirst) + empty_member + gzip(kSecond) + empty_member,
        bzip2("1 1 1\n0 0 1") + bzip2("") + bzip2(" 2\n" + kSecond),
        gzip(kFirst + "0 0 0 0 0 -5 50") + gzip("0 0 0\n1 2 3")}) {
    const Result<Problem> result = parse_bal(bytes, "f");
    ASSERT_TRUE(result.ok()) << result.error().what();
    EXPECT_EQ(result.value().points, (std::vector<double>{1, 2, 3}));
    EXPECT_EQ(result.value().cameras[0].parameters[0], 500);
  }
}

TEST(Compression, BytesBehindItAreRefused) {
  for (const auto& pack : {gzip(kText), bzip2(kText)}) {
    const std::string place = "f: byte " + std::to_string(pack.size());
    for (const std::string& behind : {std::string("garbage"), std::string("\0\0\0\0", 4), kText})
      EXPECT_NE(error_of(pack + behind).find("expected the end of the file"), std::string::npos)
          << error_of(pack + behind);
  }
  EXPECT_EQ(error_of(gzip(kText) + "\x1f\x8b"),
            "f: byte " + std::to_string(gzip(kText).size() + 2) +
                ": found the end of the file, expected the rest of its gzip data (truncated?)");
}

TEST(Compression, EveryCutIsRefused) {
  for (const std::string& pack : {gzip(kText), bzip2(kText)})
    for (std::size_t size = 0; size < pack.size(); ++size)
      EXPECT_NE(error_of(pack.substr(0, size)), "read without an error") << size;
  const std::string pack = gzip(long_text(20000));
  EXPECT_EQ(error_of(pack.substr(0, pack.size() / 2)),
            "f: byte " + std::to_string(pack.size() / 2) +
                ": found the end of the file, expected the rest of its gzip data (truncated?)");
}

TEST(Compression, EveryFlippedByteIsRefusedOrHarmless) {
  const Problem expected = parse_bal(kText, "f").value();
  for (const std::string& pack : {gzip(kText), bzip2(kText)})
    for (std::size_t i = 0; i < pack.size(); ++i) {
      std::string damaged = pack;
      damaged[i] = static_cast<char>(damaged[i] ^ 0x55);
      // The gzip header has bytes (time, system) that change nothing, and the last byte of bzip2
      // data is padding; the check sums see the rest.
      if (const Result<Problem> result = parse_bal(damaged, "f"); result.ok()) {
        EXPECT_EQ(result.value().points, expected.points);
        EXPECT_TRUE(i < 10 || i + 1 == pack.size()) << i;
      }
    }
}

TEST(Compression, CorruptDataNamesTheByte) {
  std::string pack = gzip(long_text(20000));
  pack[pack.size() - 6] ^= 1;  // the check sum
  EXPECT_EQ(error_of(pack).substr(0, 8), "f: byte ");
  EXPECT_NE(error_of(pack).find("found corrupt data, expected valid gzip data"), std::string::npos);
  EXPECT_NE(error_of("BZh91AY&SYgarbage that goes on for a while").find("valid bzip2 data"),
            std::string::npos);
}

struct Outcome {
  std::string message;
  double seconds = 0;    ///< of processor time: a busy machine is not the reader's fault
  double megabytes = 0;  ///< peak resident size of a process that does nothing else
};

/// Reads in a process of its own, so that its peak memory is its own as well.
Outcome read_apart(const std::filesystem::path& path) {
  int pipe_ends[2];
  if (::pipe(pipe_ends) != 0) return {"no pipe"};
  const pid_t child = ::fork();
  if (child == 0) {
    const Result<Problem> result = read(path);
    const std::string message = result.ok() ? "" : result.error().what();
    (void)!::write(pipe_ends[1], message.data(), message.size());
    ::_exit(0);
  }
  ::close(pipe_ends[1]);
  Outcome outcome;
  char block[4096];
  for (ssize_t n; (n = ::read(pipe_ends[0], block, sizeof block)) > 0;)
    outcome.message.append(block, static_cast<std::size_t>(n));
  ::close(pipe_ends[0]);
  rusage usage{};
  int status = 0;
  ::wait4(child, &status, 0, &usage);
  EXPECT_TRUE(WIFEXITED(status));
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  outcome.seconds = seconds(usage.ru_utime) + seconds(usage.ru_stime);
  outcome.megabytes = static_cast<double>(usage.ru_maxrss) / 1024;
  return outcome;
}

std::string repeated(const std::string& piece, std::size_t times) {
  std::string all;
  for (std::size_t i = 0; i < times; ++i) all += piece;
  return all;
}

TEST(Compression, BombsAreRefusedSoonAndInLittleMemory) {
  const test::Folder folder;
  // Members of 4 MiB each, in a row: a bomb that takes no time to make.
  const auto gzip_bomb = [](const std::string& piece, std::size_t gibibytes) {
    return repeated(gzip(repeated(piece, (4 << 20) / piece.size())), 256 * gibibytes);
  };
  const auto bzip2_bomb = [](const std::string& piece, std::size_t gibibytes) {
    return repeated(bzip2(repeated(piece, (4 << 20) / piece.size())), 256 * gibibytes);
  };
  const std::string header = "16 22106 83718\n", vast = "1 1 250000000\n";
  const struct {
    const char* name;
    std::string bytes;
  } bombs[] = {{"zeros", gzip_bomb("0", 8)},
               {"blanks", gzip_bomb(" ", 8)},
               {"nothing", repeated(gzip(""), 100000)},
               {"header and blanks", gzip(header) + gzip_bomb(" ", 8)},
               {"header and digits", gzip(header + "0 0 ") + gzip_bomb("0", 8)},
               {"records", gzip(vast) + gzip_bomb("0 0 0 0\n", 2)},
               {"bzip2 zeros", bzip2_bomb("0", 8)},
               {"bzip2 header and blanks", bzip2(header) + bzip2_bomb(" ", 8)},
               {"bzip2 records", bzip2(vast) + bzip2_bomb("0 0 0 0\n", 2)}};
  for (const auto& bomb : bombs) {
    test::spill(folder / "bomb", bomb.bytes);
    const Outcome outcome = read_apart(folder / "bomb");
    EXPECT_NE(outcome.message, "") << bomb.name;
    EXPECT_LT(outcome.seconds, 2) << bomb.name;
    if (!kSanitized) {
      EXPECT_LT(outcome.megabytes, 200) << bomb.name;
    }
    if (std::getenv("SHEAF_TEST_VERBOSE") != nullptr)
      std::printf("%s: %zu bytes, %.3f s, %.0f MB: %s\n", bomb.name, bomb.bytes.size(),
                  outcome.seconds, outcome.megabytes, outcome.message.c_str());
  }
}

TEST(Compression, ReadsPipesAndHashesThem) {
  const test::Folder folder;
  const std::string text = long_text(50000);
  for (const std::string& bytes : {text, gzip(text)}) {
    const std::filesystem::path plain = folder / "plain", fifo = folder / "fifo";
    test::spill(plain, bytes);
    ASSERT_EQ(::mkfifo(fifo.c_str(), 0600), 0);
    std::thread writer([&] { test::spill(fifo, bytes); });
    const Result<InputFile> piped = read_file(fifo, {.hash = true});
    writer.join();
    ASSERT_TRUE(piped.ok()) << piped.error().what();
    const InputFile direct = read_file(plain, {.hash = true}).value();
    EXPECT_EQ(piped.value().sha256, direct.sha256);
    EXPECT_EQ(piped.value().sha256.size(), 64u);
    EXPECT_EQ(piped.value().bytes, direct.bytes);
    EXPECT_EQ(piped.value().problem.observation_xy, direct.problem.observation_xy);
    std::filesystem::remove(fifo);
  }
}

}  // namespace
}  // namespace sheaf
