// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/core/git_lfs.hpp"

#include <array>
#include <fstream>
#include <system_error>

namespace plumbline::core {
namespace {

constexpr std::string_view kBeginning = "version https://git-lfs.github.com/spec/v1";

}  // namespace

bool begins_as_lfs_pointer(std::string_view beginning) {
  return beginning.substr(0, kBeginning.size()) == kBeginning;
}

/// True for a file that Git LFS has not downloaded yet.
bool is_lfs_pointer(const std::filesystem::path& file) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored)) return false;
  std::array<char, kBeginning.size()> head{};
  std::ifstream stream(file, std::ios::binary);
  stream.read(head.data(), head.size());
  return stream && begins_as_lfs_pointer(std::string_view(head.data(), head.size()));
}

}  // namespace plumbline::core
