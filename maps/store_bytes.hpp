// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Numbers as little-endian bytes whatever the machine, and packed blobs.
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <cstring>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "plumbline/core/ids.hpp"
#include "plumbline/geometry/rigid3.hpp"

namespace plumbline::maps {

using Bytes = std::vector<std::uint8_t>;

/// Unsigned integer of the size of T.
template <typename T>
using BitsOf =
    std::conditional_t<sizeof(T) == 8, std::uint64_t,
                       std::conditional_t<sizeof(T) == 4, std::uint32_t,
                                          std::conditional_t<sizeof(T) == 2, std::uint16_t, std::uint8_t>>>;

class ByteWriter {
 public:
  template <typename T>
  void put(T value) {
    static_assert(std::is_arithmetic_v<T> && !std::is_same_v<T, bool>);
    BitsOf<T> bits{};
    std::memcpy(&bits, &value, sizeof(T));
    std::array<std::uint8_t, sizeof(T)> raw{};
    for (std::size_t k = 0; k < sizeof(T); ++k) raw[k] = static_cast<std::uint8_t>(bits >> (8U * k));
    bytes_.insert(bytes_.end(), raw.begin(), raw.end());
  }
  void count(std::size_t value) { put(static_cast<std::uint64_t>(value)); }
  void flag(bool value) { bytes_.push_back(value ? 1 : 0); }
  template <typename Tag>
  void put(const core::Id<Tag>& id) {
    put(id.robot);
    put(id.index);
  }
  template <typename T, int Rows, int Columns>
  void put(const Eigen::Matrix<T, Rows, Columns>& matrix) {  // by rows
    for (int r = 0; r < Rows; ++r) {
      for (int c = 0; c < Columns; ++c) put(matrix(r, c));
    }
  }
  void put(const geometry::Rigid3& transform) {
    put(transform.rotation);
    put(transform.translation);
  }
  void put(const std::array<std::uint64_t, 4>& descriptor) {
    for (const std::uint64_t word : descriptor) put(word);
  }
  void put(std::string_view text) {
    count(text.size());
    bytes_.insert(bytes_.end(), text.begin(), text.end());
  }
  void raw(const Bytes& bytes) { bytes_.insert(bytes_.end(), bytes.begin(), bytes.end()); }
  /// All lowest bytes, then all second ones ...: alike bytes side by side, which is what zstd packs best.
  template <typename T>
  void planes(const std::vector<T>& values) {
    const std::size_t at = bytes_.size();
    bytes_.resize(at + values.size() * sizeof(T));
    for (std::size_t i = 0; i < values.size(); ++i) {
      BitsOf<T> bits{};
      std::memcpy(&bits, &values[i], sizeof(T));
      for (std::size_t k = 0; k < sizeof(T); ++k) {
        bytes_[at + k * values.size() + i] = static_cast<std::uint8_t>(bits >> (8U * k));
      }
    }
  }
  /// planes() of which each is packed by itself: for columns of which every bit counts.
  template <typename T>
  void apart(const std::vector<T>& values) {
    planes(values);
    const std::size_t first = bytes_.size() - values.size() * sizeof(T);
    for (std::size_t k = 0; k <= sizeof(T); ++k) cuts_.push_back(first + k * values.size());
  }
  [[nodiscard]] const Bytes& bytes() const { return bytes_; }
  /// Where bytes of another kind begin, ascending; some may be the same.
  [[nodiscard]] const std::vector<std::size_t>& cuts() const { return cuts_; }
  void clear() {
    bytes_.clear();
    cuts_.clear();
  }

 private:
  Bytes bytes_;
  std::vector<std::size_t> cuts_;
};

/// Thrown by ByteReader, and caught where a stored thing is decoded: it names what the file says wrongly.
struct BadBytes : std::runtime_error {
  using std::runtime_error::runtime_error;
};

class ByteReader {
 public:
  explicit ByteReader(const Bytes& bytes) : at_(bytes.data()), left_(bytes.size()) {}

  template <typename T>
  T get() {
    const std::uint8_t* from = take(sizeof(T));
    BitsOf<T> bits = 0;
    for (std::size_t k = 0; k < sizeof(T); ++k) {
      bits =
          static_cast<BitsOf<T>>(bits | static_cast<BitsOf<T>>(static_cast<BitsOf<T>>(from[k]) << (8U * k)));
    }
    T value{};
    std::memcpy(&value, &bits, sizeof(T));
    return value;
  }
  template <typename T>
  void get(T& value) {
    static_assert(std::is_arithmetic_v<T>);
    value = get<T>();
  }
  /// Number of things of at least `size` bytes each that follow.
  std::size_t count(std::size_t size) {
    const auto n = get<std::uint64_t>();
    if (n > left_ / size) throw BadBytes("it promises more than it holds");
    return static_cast<std::size_t>(n);
  }
  bool flag() {
    const std::uint8_t value = *take(1);
    if (value > 1) throw BadBytes("a flag is neither 0 nor 1");
    return value == 1;
  }
  template <typename Tag>
  void get(core::Id<Tag>& id) {
    get(id.robot);
    get(id.index);
  }
  template <typename T, int Rows, int Columns>
  void get(Eigen::Matrix<T, Rows, Columns>& matrix) {
    for (int r = 0; r < Rows; ++r) {
      for (int c = 0; c < Columns; ++c) get(matrix(r, c));
    }
  }
  void get(geometry::Rigid3& transform) {
    get(transform.rotation);
    get(transform.translation);
  }
  void get(std::array<std::uint64_t, 4>& descriptor) {
    for (std::uint64_t& word : descriptor) get(word);
  }
  void get(std::string& text) {
    const std::size_t size = count(1);
    const std::uint8_t* from = take(size);
    text.assign(from, from + size);
  }
  template <typename T>
  std::vector<T> planes(std::size_t n) {
    if (n > left_ / sizeof(T)) throw BadBytes("it ends too early");
    const std::uint8_t* from = take(n * sizeof(T));
    std::vector<T> values(n);
    for (std::size_t i = 0; i < n; ++i) {
      BitsOf<T> bits = 0;
      for (std::size_t k = sizeof(T); k-- > 0;) {
        if constexpr (sizeof(T) > 1) bits = static_cast<BitsOf<T>>(bits << 8U);
        bits = static_cast<BitsOf<T>>(bits | from[k * n + i]);
      }
      std::memcpy(&values[i], &bits, sizeof(T));
    }
    return values;
  }
  /// Everything that is left.
  Bytes rest() {
    const std::size_t size = left_;
    const std::uint8_t* from = take(size);
    return {from, from + size};
  }
  [[nodiscard]] bool at_end() const { return left_ == 0; }
  void expect_end() const {
    if (left_ != 0) throw BadBytes("it holds more than it should");
  }

 private:
  const std::uint8_t* take(std::size_t size) {
    if (size > left_) throw BadBytes("it ends too early");
    const std::uint8_t* from = at_;
    at_ += size;
    left_ -= size;
    return from;
  }
  const std::uint8_t* at_;
  std::size_t left_;
};

/// One zstd frame with checksum. Same bytes, same frame.
Bytes pack(const Bytes& bytes);
/// The same in fewer bytes and more time: the parts between `cuts` (ascending) each get a code of their own,
/// so that what cannot be packed does not spoil what can.
Bytes pack(const Bytes& bytes, const std::vector<std::size_t>& cuts);
/// Throws BadBytes: truncated, damaged, or more than `most` bytes.
Bytes unpack(const std::uint8_t* bytes, std::size_t size, std::size_t most = std::size_t{1} << 30U);

/// Number that two different contents hardly ever have in common (2^-64); not against malice.
std::uint64_t fingerprint(const Bytes& bytes);

}  // namespace plumbline::maps
