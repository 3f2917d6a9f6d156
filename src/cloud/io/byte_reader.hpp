// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Buffered reading of binary records and text tokens that never goes past the file's end.
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace plumbline::cloud {

class ByteReader {
 public:
  explicit ByteReader(const std::filesystem::path& file) : stream_(file, std::ios::binary) {
    std::error_code error;
    if (!std::filesystem::is_directory(file, error)) size_ = std::filesystem::file_size(file, error);
    open_ = stream_.good() && !error && !std::filesystem::is_directory(file, error);
    buffer_.resize(kBlock);
  }

  [[nodiscard]] bool open() const { return open_; }
  /// Bytes of the file that were not read yet.
  [[nodiscard]] std::uint64_t remaining() const { return size_ - given_; }

  /// The next `count` bytes, valid until the next call; nullptr when the file does not have them.
  const std::uint8_t* take(std::size_t count) {
    if (end_ - begin_ < count && !fill(count)) return nullptr;
    const std::uint8_t* bytes = buffer_.data() + begin_;
    begin_ += count;
    given_ += count;
    return bytes;
  }

  /// A line without its end (LF or CR LF); false at the end of the file or when it is longer than `longest`.
  bool line(std::string& text, std::size_t longest) {
    text.clear();
    for (;;) {
      const std::uint8_t* c = take(1);
      if (c == nullptr) break;
      if (*c == '\n') {
        if (!text.empty() && text.back() == '\r') text.pop_back();
        return true;
      }
      if (text.size() >= longest) return false;
      text.push_back(static_cast<char>(*c));
    }
    return !text.empty();
  }

  /// The next word between blanks; false at the end of the file or when longer than 63 characters.
  bool word(std::string& text) {
    text.clear();
    for (const std::uint8_t* c = take(1); c != nullptr; c = take(1)) {
      const bool blank = *c == ' ' || *c == '\n' || *c == '\t' || *c == '\r' || *c == '\f' || *c == '\v';
      if (blank && !text.empty()) return true;
      if (blank) continue;
      if (text.size() >= 63) return false;
      text.push_back(static_cast<char>(*c));
    }
    return !text.empty();
  }

 private:
  static constexpr std::size_t kBlock = std::size_t{1} << 18;

  bool fill(std::size_t count) {
    if (!open_ || remaining() < count) return false;

    // Unread bytes move to the front
    std::memmove(buffer_.data(), buffer_.data() + begin_, end_ - begin_);
    end_ -= begin_;
    begin_ = 0;
    if (buffer_.size() < count) buffer_.resize(count);
    stream_.read(reinterpret_cast<char*>(buffer_.data() + end_),
                 static_cast<std::streamsize>(buffer_.size() - end_));
    end_ += static_cast<std::size_t>(stream_.gcount());
    return end_ >= count;
  }

  std::ifstream stream_;
  bool open_ = false;
  std::uint64_t size_ = 0;
  std::uint64_t given_ = 0;
  std::vector<std::uint8_t> buffer_;
  std::size_t begin_ = 0;
  std::size_t end_ = 0;
};

}  // namespace plumbline::cloud
