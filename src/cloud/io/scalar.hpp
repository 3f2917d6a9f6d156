// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Scalars of PLY and PCD records.
#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <string>

namespace plumbline::cloud {

enum class ScalarType {
  kInt8,
  kUint8,
  kInt16,
  kUint16,
  kInt32,
  kUint32,
  kInt64,
  kUint64,
  kFloat32,
  kFloat64
};

/// Calls body(T()) with the C++ type T of a scalar.
template <typename Body>
auto with_type(ScalarType type, const Body& body) {
  switch (type) {
    case ScalarType::kInt8:
      return body(std::int8_t());
    case ScalarType::kUint8:
      return body(std::uint8_t());
    case ScalarType::kInt16:
      return body(std::int16_t());
    case ScalarType::kUint16:
      return body(std::uint16_t());
    case ScalarType::kInt32:
      return body(std::int32_t());

    case ScalarType::kUint32:
      return body(std::uint32_t());
    case ScalarType::kInt64:
      return body(std::int64_t());
    case ScalarType::kUint64:
      return body(std::uint64_t());
    case ScalarType::kFloat32:
      return body(float());
    case ScalarType::kFloat64:
      break;
  }

  return body(double());
}

inline std::size_t size_of(ScalarType type) {
  return with_type(type, [](auto value) { return sizeof(value); });
}

// A scalar from bytes that need not be aligned.
inline double load(ScalarType type, const std::uint8_t* bytes, bool big_endian) {
  return with_type(type, [&](auto value) {
    std::array<std::uint8_t, sizeof(value)> raw{};
    std::memcpy(raw.data(), bytes, sizeof(value));
    if (big_endian) std::reverse(raw.begin(), raw.end());
    std::memcpy(&value, raw.data(), sizeof(value));
    return static_cast<double>(value);
  });
}

/// A whole word as a number, nan and inf included, whatever the locale.
inline std::optional<double> parse_number(const std::string& word) {
  const char* begin = word.data();
  const char* end = begin + word.size();
  if (begin != end && *begin == '+') ++begin;
  double value = 0.0;
  const auto [stop, problem] = std::from_chars(begin, end, value);
  if (problem == std::errc::result_out_of_range) return std::strtod(word.c_str(), nullptr);  // 1e-400, 1e400
  if (problem != std::errc() || stop != end) return std::nullopt;
  return value;
}

/// A word as an element count.
inline std::optional<std::uint64_t> parse_count(const std::string& word) {
  if (word.empty() || word.size() > 18) return std::nullopt;
  std::uint64_t value = 0;
  for (char c : word) {
    if (c < '0' || c > '9') return std::nullopt;
    value = value * 10 + static_cast<std::uint64_t>(c - '0');
  }
  return value;
}

/// Nearest byte; NaN becomes 0.
inline std::uint8_t to_byte(double value) {
  if (!(value > 0.0)) return 0;
  return value >= 255.0 ? std::uint8_t{255} : static_cast<std::uint8_t>(value + 0.5);
}

}  // namespace plumbline::cloud
