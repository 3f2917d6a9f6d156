// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Numbers from text, and the middle of many.
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

namespace plumbline::core {

/// The whole word as a number, whatever the locale; "nan" and "inf" are numbers here.
inline std::optional<double> to_number(std::string_view word) {
  if (!word.empty() && word.front() == '+') word.remove_prefix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc{} || end != word.data() + word.size()) return std::nullopt;
  return value;
}

/// True if the words of a line, separated by blanks, are numbers with decimal commas, as a locale writes
/// them: "0,5 1,25". Words that lists separate by commas ("1,2,3" or "1, 2") are not.
inline bool has_decimal_comma(const std::vector<std::string>& words) {
  const auto decimal = [](const std::string& word) {
    const std::size_t comma = word.find(',');
    if (comma == std::string::npos || comma + 1 == word.size()) return false;
    const bool digit = word[comma + 1] >= '0' && word[comma + 1] <= '9';
    return digit && word.find('.') == std::string::npos &&
           to_number(word.substr(0, comma) + "." + word.substr(comma + 1)).has_value();
  };
  return words.size() > 1 && std::any_of(words.begin(), words.end(), decimal);
}

/// The median, the upper one if their number is even. There must be at least one value, and no NaN.
template <typename T>
T median(std::vector<T> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// The q-quantile of the finite values, its rank rounded to the nearest; `none` when there are none.
/// 0 <= q <= 1.
template <typename T>
T quantile(std::vector<T> values, double q, T none = std::numeric_limits<T>::quiet_NaN()) {
  values.erase(std::remove_if(values.begin(), values.end(), [](T v) { return !std::isfinite(v); }),
               values.end());
  if (values.empty()) return none;
  const auto place =
      values.begin() + static_cast<std::ptrdiff_t>(q * static_cast<double>(values.size() - 1) + 0.5);
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

/// The median less one standard error of its rank, the quantile 1/2 - 1/(2 sqrt(n)) of n finite values: what
/// the median is at least, even if they are few. `none` when there are none.
template <typename T>
T least_median(std::vector<T> values, T none = std::numeric_limits<T>::quiet_NaN()) {
  values.erase(std::remove_if(values.begin(), values.end(), [](T v) { return !std::isfinite(v); }),
               values.end());
  if (values.empty()) return none;
  const double rank = 0.5 - 0.5 / std::sqrt(static_cast<double>(values.size()));
  return quantile(std::move(values), rank, none);
}

}  // namespace plumbline::core
