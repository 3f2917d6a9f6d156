// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// What the fuzz targets have in common. Each target is one file that defines LLVMFuzzerTestOneInput: linked
// with libFuzzer (clang, preset `fuzz`) it searches, linked with replay.cpp (any compiler) it is a quick
// test.
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace plumbline::fuzz {

/// Bytes that may be allocated at once for an input whose contents take `decoded` bytes in memory.
constexpr std::size_t allowance(std::size_t decoded) { return 4 * decoded + (std::size_t{64} << 20); }

/// Watches operator new from construction on.
class MemoryWatch {
 public:
  MemoryWatch();
  /// The most that was allocated at once since then.
  [[nodiscard]] std::size_t peak() const;
};

/// Ends the program with a message when the watch saw more than `allowance(decoded)`.
void check_memory(const MemoryWatch& watch, std::size_t decoded);

/// Ends the program with the message when `holds` is false.
void require(bool holds, const char* what);

/// The input as a file with this ending, for readers of files.
class InputFile {
 public:
  InputFile(const std::uint8_t* data, std::size_t size, const char* ending);
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;  ///< the same for every input of this process
};

/// Whole message of an expected failure: not empty, not endless, names the file.
void require_message(const std::string& message, const std::string& file);

}  // namespace plumbline::fuzz
