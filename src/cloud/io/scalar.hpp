// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Scalars of PLY and PCD records.
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
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

inline std::size_t size_of(ScalarType type) {
  switch (type) {
    case ScalarType::kInt8:
    case ScalarType::kUint8:
      return 1;
    case ScalarType::kInt16:
    case ScalarType::kUint16:
      return 2;
    case ScalarType::kInt64:
    case ScalarType::kUint64:
    case ScalarType::kFloat64:
      return 8;
    default:
      return 4;
  }
}

template <typename T>
double load_as(const std::uint8_t* bytes, bool big_endian) {
  std::array<std::uint8_t, sizeof(T)> raw{};
  std::memcpy(raw.data(), bytes, sizeof(T));
  if (big_endian) std::reverse(raw.begin(), raw.end());
  T value;
  std::memcpy(&value, raw.data(), sizeof(T));
  return static_cast<double>(value);
}

inline double load(ScalarType type, const std::uint8_t* bytes, bool big_endian) {
  switch (type) {
    case ScalarType::kInt8:
      return load_as<std::int8_t>(bytes, big_endian);
    case ScalarType::kUint8:
      return load_as<std::uint8_t>(bytes, big_endian);
    case ScalarType::kInt16:
      return load_as<std::int16_t>(bytes, big_endian);
    case ScalarType::kUint16:
      return load_as<std::uint16_t>(bytes, big_endian);
    case ScalarType::kInt32:
      return load_as<std::int32_t>(bytes, big_endian);
    case ScalarType::kUint32:
      return load_as<std::uint32_t>(bytes, big_endian);
    case ScalarType::kInt64:
      return load_as<std::int64_t>(bytes, big_endian);
    case ScalarType::kUint64:
      return load_as<std::uint64_t>(bytes, big_endian);
    case ScalarType::kFloat32:
      return load_as<float>(bytes, big_endian);
    case ScalarType::kFloat64:
      return load_as<double>(bytes, big_endian);
  }
  return 0.0;
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
