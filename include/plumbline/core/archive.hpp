// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Things as bytes and back, spelt once: `template <class Io> void fields(Io& io, Thing& thing) { io(thing.a,
// thing.b); }` beside the thing's type writes it with ByteWriter and reads it with ByteReader. Numbers are
// little-endian whatever the machine. Reading is safe on any bytes: it throws BadBytes, and takes no more
// memory than the bytes that were read can fill.
#include <array>
#include <cstdint>
#include <cstring>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "plumbline/core/ids.hpp"

namespace plumbline::core {

using Bytes = std::vector<std::uint8_t>;

/// Thrown by ByteReader, and caught where an object is decoded; it names the error in the bytes.
struct BadBytes : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Unsigned integer of the size of T.
template <typename T>
using BitsOf =
    std::conditional_t<sizeof(T) == 8, std::uint64_t,
                       std::conditional_t<sizeof(T) == 4, std::uint32_t,
                                          std::conditional_t<sizeof(T) == 2, std::uint16_t, std::uint8_t>>>;

/// Shared by both directions: how types fall apart into numbers. Io has number(), list(), planes() and
/// check().
template <typename Io>
class Archive {
 public:
  template <typename... T>
  void operator()(T&... things) {
    (one(things), ...);
  }

 private:
  template <typename T, typename = void>
  struct IsMatrix : std::false_type {};
  template <typename T>
  struct IsMatrix<T, std::void_t<decltype(T::RowsAtCompileTime)>> : std::true_type {};

  /// A flag as one byte, a number, a matrix by rows, or whatever many() takes apart.
  template <typename T>
  void one(T& thing) {
    if constexpr (std::is_same_v<T, bool>) {
      std::uint8_t flag = thing ? 1 : 0;
      io().number(flag);
      io().check(flag <= 1, "a flag is neither 0 nor 1");
      if constexpr (Io::kReads) thing = flag == 1;
    } else if constexpr (std::is_arithmetic_v<T>) {
      io().number(thing);
    } else if constexpr (IsMatrix<T>::value) {  // by rows
      for (int r = 0; r < T::RowsAtCompileTime; ++r) {
        for (int c = 0; c < T::ColsAtCompileTime; ++c) one(thing(r, c));
      }
    } else {
      many(thing);
    }
  }
  template <typename Tag>
  void many(Id<Tag>& id) {
    (*this)(id.robot, id.index);
  }
  template <typename T, std::size_t N>
  void many(std::array<T, N>& things) {
    for (T& thing : things) one(thing);
  }
  /// A flag, then the value if there is one.
  template <typename T>
  void many(std::optional<T>& thing) {
    bool there = thing.has_value();
    one(there);
    if constexpr (Io::kReads) {
      thing.reset();
      if (there) thing.emplace();
    }
    if (there) one(*thing);
  }
  template <typename T>
  void many(std::vector<T>& things) {
    io().list(things);
  }
  void many(std::string& text) { io().list(text); }
  template <typename A, typename B>
  void many(std::pair<A, B>& both) {
    (*this)(both.first, both.second);
  }
  template <typename Key, typename T>
  void many(std::map<Key, T>& things) {
    std::vector<std::pair<Key, T>> list(things.begin(), things.end());
    one(list);
    if constexpr (Io::kReads) things = {list.begin(), list.end()};
  }
  template <typename T>
  void many(T& thing) {
    fields(io(), thing);
  }
  Io& io() { return static_cast<Io&>(*this); }
};

class ByteWriter : public Archive<ByteWriter> {
 public:
  static constexpr bool kReads = false;

  template <typename T>
  void number(T value) {
    planes(&value, 1);
  }
  /// All lowest bytes, then all second ones ...: alike bytes side by side, which is what zstd packs best. The
  /// lowest kBytes of each: the others are zero.
  template <std::size_t kBytes, typename T>
  void planes(const T* values, std::size_t n) {
    const std::size_t at = bytes_.size();
    bytes_.resize(at + n * kBytes);
    for (std::size_t i = 0; i < n; ++i) {
      BitsOf<T> bits{};
      std::memcpy(&bits, &values[i], sizeof(T));
      for (std::size_t k = 0; k < kBytes; ++k) {
        bytes_[at + k * n + i] = static_cast<std::uint8_t>(bits >> (8U * k));
      }
    }
  }
  template <typename T>
  void planes(const T* values, std::size_t n) {
    planes<sizeof(T)>(values, n);
  }
  template <typename List>
  void list(List& things) {
    number(static_cast<std::uint64_t>(things.size()));
    for (auto& thing : things) (*this)(thing);
  }
  /// The number of things that columns of them follow, at least `size` bytes of each.
  template <typename T>
  void column_size(std::vector<T>& things, std::size_t /*size*/) {
    number(static_cast<std::uint64_t>(things.size()));
  }
  void check(bool /*holds*/, const char* /*otherwise*/) {}
  void raw(const Bytes& bytes) { bytes_.insert(bytes_.end(), bytes.begin(), bytes.end()); }
  /// Bytes up to the end of the enclosing data.
  void rest(const Bytes& bytes) { raw(bytes); }
  [[nodiscard]] const Bytes& bytes() const { return bytes_; }
  void clear() { bytes_.clear(); }

 private:
  Bytes bytes_;
};

class ByteReader : public Archive<ByteReader> {
 public:
  static constexpr bool kReads = true;
  explicit ByteReader(const Bytes& bytes) : at_(bytes.data()), left_(bytes.size()) {}

  template <typename T>
  void number(T& value) {
    planes(&value, 1);
  }
  /// Reads what ByteWriter::planes() wrote: the highest bytes are shifted in first.
  template <std::size_t kBytes, typename T>
  void planes(T* values, std::size_t n) {
    const std::uint8_t* from = take(n * kBytes);
    for (std::size_t i = 0; i < n; ++i) {
      BitsOf<T> bits = 0;
      for (std::size_t k = kBytes; k-- > 0;) {
        if constexpr (sizeof(T) > 1) bits = static_cast<BitsOf<T>>(bits << 8U);
        bits = static_cast<BitsOf<T>>(bits | from[k * n + i]);
      }
      std::memcpy(&values[i], &bits, sizeof(T));
    }
  }
  template <typename T>
  void planes(T* values, std::size_t n) {
    planes<sizeof(T)>(values, n);
  }
  /// Reads elements one by one: a length that exceeds the data takes no memory.
  template <typename List>
  void list(List& things) {
    things.clear();
    for (std::size_t n = count(1); n > 0; --n) {
      typename List::value_type thing{};
      (*this)(thing);
      things.push_back(std::move(thing));
    }
  }
  template <typename T>
  void column_size(std::vector<T>& things, std::size_t size) {
    things.resize(count(size));
  }
  void check(bool holds, const char* otherwise) const {
    if (!holds) throw BadBytes(otherwise);
  }
  /// Checks that `size` bytes are left, before memory is allocated for them.
  void need(std::size_t size) const { check(size <= left_, "it ends too early"); }
  /// Everything that is left.
  void rest(Bytes& bytes) {
    const std::size_t size = left_;
    const std::uint8_t* from = take(size);
    bytes.assign(from, from + size);
  }
  [[nodiscard]] bool at_end() const { return left_ == 0; }
  void expect_end() const { check(left_ == 0, "it holds more than it should"); }

 private:
  std::size_t count(std::size_t size) {
    std::uint64_t n = 0;
    number(n);
    check(n <= left_ / size, "it promises more than it holds");
    return static_cast<std::size_t>(n);
  }
  const std::uint8_t* take(std::size_t size) {
    need(size);
    const std::uint8_t* from = at_;
    at_ += size;
    left_ -= size;
    return from;
  }
  const std::uint8_t* at_;
  std::size_t left_;
};

/// Appends a thing's bytes.
template <typename T>
void encode(const T& thing, ByteWriter& to) {
  to(const_cast<T&>(thing));  // a writer changes nothing
}
/// The bytes of one thing.
template <typename T>
Bytes encoded(const T& thing) {
  ByteWriter bytes;
  encode(thing, bytes);
  return bytes.bytes();
}
/// Throws BadBytes, also if there are more bytes than the object needs.
template <typename T>
T decode(const Bytes& bytes) {
  ByteReader from(bytes);
  T thing{};
  from(thing);
  from.expect_end();
  return thing;
}
/// Objects one after another. Throws BadBytes.
template <typename T>
std::vector<T> decode_page(const Bytes& bytes) {
  std::vector<T> things;
  for (ByteReader from(bytes); !from.at_end();) from(things.emplace_back());
  return things;
}

}  // namespace plumbline::core
