// SPDX-License-Identifier: BSD-3-Clause
#include "io/shift.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "plumbline/core/numbers.hpp"

namespace plumbline::cloud {

bool exceeds_float(ScalarType type) {
  return type == ScalarType::kFloat64 || type == ScalarType::kInt32 || type == ScalarType::kUint32 ||
         type == ScalarType::kInt64 || type == ScalarType::kUint64;
}

double axis_shift(const std::vector<double>& values) {
  constexpr std::size_t kSamples = 1000;
  constexpr double kFloatsHold = 1000.0;  // metres, to a sixteenth of a millimetre
  constexpr double kLargest = 1e15;       // beyond, whole units are not exact either

  // A sample suffices, since the shift is rounded
  std::vector<double> sample;
  const std::size_t step = std::max<std::size_t>(1, values.size() / kSamples);
  for (std::size_t i = 0; i < values.size(); i += step) {
    if (std::isfinite(values[i])) sample.push_back(values[i]);
  }
  if (sample.empty()) return 0.0;
  const double middle = core::median(std::move(sample));
  return std::abs(middle) < kFloatsHold || std::abs(middle) > kLargest ? 0.0 : std::floor(middle);
}

std::optional<int> axis_of_column(Meaning meaning) {
  if (meaning < Meaning::kX || meaning > Meaning::kZ) return std::nullopt;
  return static_cast<int>(meaning) - static_cast<int>(Meaning::kX);
}

double with_shift(float value, double shift) {
  if (!std::isfinite(value)) return static_cast<double>(value);

  // The float's decimal digits, not its binary value
  std::array<char, 64> text{};
  const auto written = std::to_chars(text.data(), text.data() + text.size(), value);
  double decimal = static_cast<double>(value);
  std::from_chars(text.data(), written.ptr, decimal);
  return shift + decimal;
}

}  // namespace plumbline::cloud
