// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <fstream>

#include "plumbline/core/config.hpp"
#include "plumbline/core/git_lfs.hpp"

namespace plumbline::core {
namespace {

const char* const kPointer =
    "version https://git-lfs.github.com/spec/v1\n"
    "oid sha256:4d7a214614ab2935c943f9e0ff69d22eadbb8f32b1258daaa5e2ca24d17e2393\nsize 12345\n";

std::filesystem::path written(const std::string& text) {
  const std::filesystem::path file = std::filesystem::path(testing::TempDir()) / "plumbline_git_lfs.yaml";
  std::ofstream(file, std::ios::binary) << text;
  return file;
}

TEST(GitLfs, PointersAreRecognisedByTheirBeginning) {
  EXPECT_TRUE(begins_as_lfs_pointer(kPointer));
  EXPECT_FALSE(begins_as_lfs_pointer("version 1"));
  EXPECT_FALSE(begins_as_lfs_pointer(""));
  EXPECT_TRUE(is_lfs_pointer(written(kPointer)));
  EXPECT_FALSE(is_lfs_pointer(written("version https://git-lfs")));
  EXPECT_FALSE(is_lfs_pointer(testing::TempDir()));
  EXPECT_FALSE(is_lfs_pointer("no such file"));
}

TEST(GitLfs, AConfigurationIsNamedAsAPointer) {
  const auto read = read_yaml(written(kPointer));
  ASSERT_FALSE(read);
  EXPECT_NE(
      read.error().message.find("plumbline_git_lfs.yaml: is a Git LFS pointer, not the file itself; run "
                                "`git lfs pull`"),
      std::string::npos)
      << read.error().message;
}

}  // namespace
}  // namespace plumbline::core
