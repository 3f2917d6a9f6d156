// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A file with random access, by several threads at once.
#include <cstdint>
#include <filesystem>

#include "plumbline/core/error.hpp"

namespace plumbline::dataset {

class BinaryFile {
 public:
  BinaryFile() = default;
  ~BinaryFile();
  BinaryFile(BinaryFile&& other) noexcept;
  BinaryFile& operator=(BinaryFile&& other) noexcept;
  /// Error (kInput): cannot be read.
  static core::Result<BinaryFile> open(const std::filesystem::path& file);

  [[nodiscard]] std::uint64_t size() const { return size_; }
  /// Exactly these bytes; false when the file ends before, or cannot be read.
  bool read(std::uint64_t at, void* to, std::size_t count) const;

 private:
  int descriptor_ = -1;
  std::uint64_t size_ = 0;
};

}  // namespace plumbline::dataset
