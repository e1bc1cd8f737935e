// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "io/sha256.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace sheaf {
namespace {

std::string digest(const std::string& message, std::size_t piece,
                   Sha256::Path path = Sha256::Path::best) {
  Sha256 hash(path);
  for (std::size_t i = 0; i < message.size(); i += piece)
    hash.update(message.data() + i, std::min(piece, message.size() - i));
  return hash.hex_digest();
}

TEST(Sha256, PortablePathMatchesPublishedVectors) {
  EXPECT_EQ(digest(std::string(1000000, 'a'), 4096, Sha256::Path::portable),
            "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

// The examples of FIPS 180-4.
TEST(Sha256, MatchesPublishedVectors) {
  EXPECT_EQ(digest("", 1), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(digest("abc", 3), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(digest("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq", 56),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  EXPECT_EQ(digest(std::string(1000000, 'a'), 997),
            "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST(Sha256, DoesNotDependOnThePieces) {
  for (std::size_t size : {1, 55, 56, 57, 63, 64, 65, 119, 120, 128, 200}) {
    std::string message(size, '\0');
    for (std::size_t i = 0; i < size; ++i) message[i] = static_cast<char>(31 * i + size);
    const std::string whole = digest(message, size);
    for (std::size_t piece : {1, 3, 63, 64}) EXPECT_EQ(digest(message, piece), whole) << size;
    EXPECT_EQ(digest(message, size, Sha256::Path::portable), whole) << size;
  }
}

}  // namespace
}  // namespace sheaf
