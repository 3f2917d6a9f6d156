// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// zstd, LZ4 (frames) and bzip2 in pieces, so that the beginning of large data can be read without the rest,
// and no header determines how much memory is allocated.
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "bags/bag_file.hpp"

namespace plumbline::dataset {

enum class Compression { kNone, kZstd, kLz4, kBzip2 };

/// Bytes of a compressed block, one after another.
class Inflater {
 public:
  virtual ~Inflater() = default;
  /// The next bytes, at most `size`; fewer only where the data end or are damaged.
  virtual std::size_t get(std::uint8_t* to, std::size_t size) = 0;
};

/// Inflates `size` bytes, which must outlive it; kNone copies.
std::unique_ptr<Inflater> make_inflater(Compression compression, const std::uint8_t* data, std::size_t size);

/// Inflates at most `most` bytes; empty and false if the data are damaged or longer.
bool inflate_all(Compression compression, const std::uint8_t* data, std::size_t size, std::uint64_t most,
                 Bytes& to);

/// True if the bytes begin like a zstd frame; no CDR message begins so.
bool is_zstd(const std::uint8_t* data, std::size_t size);

/// A file that lasts as long as this object, and no longer than its process if its name is taken away.
class TemporaryFile {
 public:
  TemporaryFile() = default;
  ~TemporaryFile();
  TemporaryFile(TemporaryFile&& other) noexcept;
  TemporaryFile& operator=(TemporaryFile&& other) noexcept;
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  /// Removes the name; to be called once every user has opened the file.
  void take_name_away();
  /// Content of `file`, which zstd has compressed; `cut` is set if it ends early. Error (kInput, kOutput).
  static core::Result<TemporaryFile> inflated(const std::filesystem::path& file, bool& cut);

 private:
  std::filesystem::path path_;  ///< "": it has no name any more
  int descriptor_ = -1;
};

}  // namespace plumbline::dataset
