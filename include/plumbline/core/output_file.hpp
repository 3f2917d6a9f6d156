// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A file that appears whole or not at all.
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "plumbline/core/error.hpp"

namespace plumbline::core {

/// Buffered writer to a hidden file in the target's folder that commit() renames to the target. A target that
/// is a device or pipe (/dev/stdout) is written in place. Without commit() the target stays as it was.
class OutputFile {
 public:
  explicit OutputFile(std::filesystem::path target);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  void write(const void* bytes, std::size_t count);
  void write(std::string_view text) { write(text.data(), text.size()); }
  /// Little endian, as all machines this runs on.
  template <typename T>
  void put(const T& value) {
    write(&value, sizeof(value));
  }

  /// False if something went wrong already: commit() tells what.
  [[nodiscard]] bool good() const { return problem_.empty(); }
  /// Flushes, closes, renames. The first thing that went wrong since opening, as a kOutput error naming the
  /// target, the cause and what to do about it.
  Result<void> commit();

 private:
  void flush();
  void fail(const std::string& what, int cause);
  void discard();

  std::filesystem::path target_;
  std::filesystem::path written_;  ///< the hidden file, or target_ itself
  int descriptor_ = -1;
  std::vector<char> buffer_;
  std::string problem_;
};

/// Checks that a file could be written there, and leaves nothing behind. Errors (kOutput).
Result<void> check_writable(const std::filesystem::path& file);

/// Makes the folder and all folders above it; existing ones are fine. Errors (kOutput).
Result<void> make_folder(const std::filesystem::path& folder);

/// A whole file at once.
Result<void> write_file(const std::filesystem::path& file, std::string_view bytes);
Result<void> write_file(const std::filesystem::path& file, const std::vector<std::uint8_t>& bytes);

}  // namespace plumbline::core
