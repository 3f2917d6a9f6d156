// SPDX-License-Identifier: BSD-3-Clause
#include "bag_part/binary_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "plumbline/core/shortage.hpp"

namespace plumbline::dataset {

BinaryFile::~BinaryFile() {
  if (descriptor_ >= 0) close(descriptor_);
}

BinaryFile::BinaryFile(BinaryFile&& other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)), size_(other.size_) {}

BinaryFile& BinaryFile::operator=(BinaryFile&& other) noexcept {
  std::swap(descriptor_, other.descriptor_);
  std::swap(size_, other.size_);
  return *this;
}

core::Result<BinaryFile> BinaryFile::open(const std::filesystem::path& file) {
  BinaryFile opened;
  opened.descriptor_ = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  struct stat about {};

  // Shortages of the system are not bad input
  if (const std::string shortage = opened.descriptor_ < 0 ? core::shortage_of(errno) : ""; !shortage.empty())
    return core::output_error(fmt::format("{}: cannot be read: {}", file.string(), shortage));
  if (opened.descriptor_ < 0 || fstat(opened.descriptor_, &about) != 0)
    return core::input_error(fmt::format("{}: cannot be read: {}", file.string(), std::strerror(errno)));
  opened.size_ = static_cast<std::uint64_t>(about.st_size);
  return opened;
}

bool BinaryFile::read(std::uint64_t at, void* to, std::size_t count) const {
  if (at > size_ || count > size_ - at) return false;
  char* next = static_cast<char*>(to);

  // One call may read only a part
  while (count > 0) {
    const ssize_t got = pread(descriptor_, next, count, static_cast<off_t>(at));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return false;
    next += got;
    at += static_cast<std::uint64_t>(got);
    count -= static_cast<std::size_t>(got);
  }
  return true;
}

}  // namespace plumbline::dataset
