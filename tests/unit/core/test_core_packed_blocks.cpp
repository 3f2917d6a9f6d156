// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <utility>

#include "plumbline/core/packed_blocks.hpp"

namespace plumbline::core {
namespace {

TEST(PackedBlocks, ComeBackFromTheFileAndFromMemory) {
  Bytes large(100000);
  for (std::size_t i = 0; i < large.size(); ++i) large[i] = static_cast<std::uint8_t>(i * i % 251);
  for (const char* folder : {"", "/nowhere"}) {
    PackedBlocks blocks;
    blocks.open(*folder == '\0' ? std::filesystem::temp_directory_path() : std::filesystem::path(folder));
    EXPECT_EQ(blocks.add(large), 0U);
    EXPECT_EQ(blocks.add({}), 1U);
    EXPECT_EQ(blocks.add({7, 8}), 2U);
    EXPECT_EQ(blocks.count(), 3U);
    EXPECT_LT(blocks.bytes(), large.size());

    const PackedBlocks moved = std::move(blocks);
    EXPECT_EQ(moved.get(2), Bytes({7, 8}));
    EXPECT_EQ(moved.get(0), large);
    EXPECT_EQ(moved.get(1), Bytes());
  }
}

}  // namespace
}  // namespace plumbline::core
