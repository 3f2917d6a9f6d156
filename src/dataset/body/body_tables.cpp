// SPDX-License-Identifier: BSD-3-Clause
#include "body/body_tables.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "layout.hpp"
#include "plumbline/core/numbers.hpp"
#include "plumbline/core/text.hpp"
#include "text_lines.hpp"

namespace plumbline::dataset {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;

constexpr std::string_view kNumberSeparators = ",; \t\r\n";

/// A column by the names that programs give it, lower case and without unit.
struct BodyColumn {
  std::vector<std::string> names;
  bool needed = true;
};

BodyColumn axis_of(const std::vector<std::string>& begins, char axis, bool needed) {
  BodyColumn column{{}, needed};
  for (const std::string& begin : begins) column.names.push_back(begin + axis);
  return column;
}

const BodyColumn kStampColumn{{"stamp", "timestamp", "time", "t"}};

/// stamp, turn rates, accelerations.
std::vector<BodyColumn> imu_columns() {
  const std::vector<std::string> turn = {
      "w", "w_rs_s_", "alpha_", "gyro_", "gyro.", "angular_velocity_", "angular_velocity.", "g"};
  const std::vector<std::string> accel = {
      "a", "a_rs_s_", "a_", "accel_", "accel.", "linear_acceleration_", "linear_acceleration."};
  std::vector<BodyColumn> columns{kStampColumn};
  for (const char axis : {'x', 'y', 'z'}) columns.push_back(axis_of(turn, axis, true));
  for (const char axis : {'x', 'y', 'z'}) columns.push_back(axis_of(accel, axis, false));
  return columns;
}

/// stamp, x, y, z, yaw, quaternion.
std::vector<BodyColumn> odometry_columns() {
  return {kStampColumn,
          {{"x", "px", "tx"}},
          {{"y", "py", "ty"}},
          {{"z", "pz", "tz"}, false},
          {{"yaw", "theta"}, false},
          {{"qx"}, false},
          {{"qy"}, false},
          {{"qz"}, false},
          {{"qw"}, false}};
}

/// Rows of numbers in the order of the columns; NaN where a column is missing.
core::Result<std::vector<std::vector<double>>> read_table(const fs::path& file,
                                                          const std::vector<BodyColumn>& columns) {
  const auto lines = read_raw_lines(file);
  if (!lines) return tl::unexpected(lines.error());
  std::vector<std::vector<double>> rows;
  std::vector<int> places;
  bool nanoseconds = false;

  for (const RawLine& line : *lines) {
    std::vector<std::string> words = split_words(line.text, places.empty() ? ",;\r\n" : kNumberSeparators);
    if (words.empty()) continue;

    // The header says which column is where.
    if (places.empty()) {
      for (std::string& word : words) {
        word = core::lower(word);
        nanoseconds = nanoseconds || word.find("[ns]") != std::string::npos;
        word = word.substr(0, word.find_first_of("[("));
        word.erase(std::remove_if(word.begin(), word.end(), [](char c) { return c == ' ' || c == '#'; }),
                   word.end());
      }

      for (const BodyColumn& column : columns) {
        const auto at =
            std::find_first_of(words.begin(), words.end(), column.names.begin(), column.names.end());
        if (at == words.end() && column.needed) {
          return core::input_error(fmt::format("{}:{}: the header names no column '{}'", file.string(),
                                               line.number, column.names.front()));
        }
        places.push_back(at == words.end() ? -1 : static_cast<int>(at - words.begin()));
      }
      continue;
    }

    std::vector<double> row;
    for (const int place : places) {
      const auto value = place < 0 ? std::optional(std::nan(""))
                         : place < static_cast<int>(words.size())
                             ? core::to_number(words[static_cast<std::size_t>(place)])
                             : std::nullopt;

      // Columns may be missing, but not single numbers
      if (!value) {
        return core::input_error(
            fmt::format("{}:{}: column {} is not a number", file.string(), line.number, place + 1));
      }
      row.push_back(*value);
    }

    // The size of a stamp tells its unit
    row[0] *= nanoseconds || row[0] > 1e17 ? 1e-9 : row[0] > 1e14 ? 1e-6 : row[0] > 1e11 ? 1e-3 : 1.0;
    rows.push_back(std::move(row));
  }
  return rows;
}

/// Without rows that are not finite, by stamp, of equal stamps the first.
template <typename Reading>
std::vector<Reading> in_order(std::vector<Reading> readings) {
  std::stable_sort(readings.begin(), readings.end(), kByStamp);
  const auto same = [](const Reading& a, const Reading& b) { return a.stamp == b.stamp; };
  readings.erase(std::unique(readings.begin(), readings.end(), same), readings.end());
  return readings;
}

/// Rows without a stamp or a turn rate are left out.
core::Result<std::vector<ImuReading>> read_imu_table(const fs::path& file) {
  const auto rows = read_table(file, imu_columns());
  if (!rows) return tl::unexpected(rows.error());
  std::vector<ImuReading> readings;
  for (const std::vector<double>& r : *rows) {
    const ImuReading reading{r[0], {r[1], r[2], r[3]}, {r[4], r[5], r[6]}};
    if (std::isfinite(reading.stamp) && reading.turn_rate.allFinite()) readings.push_back(reading);
  }
  return in_order(std::move(readings));
}

core::Result<std::vector<OdometryReading>> read_odometry_table(const fs::path& file) {
  const auto rows = read_table(file, odometry_columns());
  if (!rows) return tl::unexpected(rows.error());
  std::vector<OdometryReading> readings;
  for (const std::vector<double>& r : *rows) {
    // The rotation is a quaternion or a yaw angle
    const bool full = std::isfinite(r[5] + r[6] + r[7] + r[8]);
    const Eigen::Quaterniond turn = full ? Eigen::Quaterniond(r[8], r[5], r[6], r[7])
                                         : Eigen::Quaterniond(Eigen::AngleAxisd(r[4], Vector3d::UnitZ()));

    // Planar odometry has neither height nor tilt
    OdometryReading reading;
    reading.stamp = r[0];
    reading.odom_from_body = {turn, Vector3d(r[1], r[2], std::isfinite(r[3]) ? r[3] : 0.0)};

    // Rows that are not finite are left out
    const bool finite =
        reading.odom_from_body.translation.allFinite() && reading.odom_from_body.rotation.allFinite();
    if (finite && std::isfinite(reading.stamp)) readings.push_back(reading);
  }
  return in_order(std::move(readings));
}

template <typename Reading>
void take_table(core::Result<std::vector<Reading>> read, std::vector<Reading>& readings, core::Log& log) {
  if (read)
    readings = std::move(*read);
  else
    log.warning(read.error().message + "; correct it, or remove the file: it is not used");
}

template <typename Reading>
std::vector<Reading> after(const std::vector<Reading>& all, double from, double until) {
  const auto later = [](double stamp, const Reading& reading) { return stamp < reading.stamp; };
  const auto first = std::upper_bound(all.begin(), all.end(), from, later);
  const auto last = std::upper_bound(first, all.end(), until, later);
  return {first, last};
}

}  // namespace

BodyReadings readings_between(const std::vector<ImuReading>& imu,
                              const std::vector<OdometryReading>& odometry, double imu_after,
                              double odometry_after, double until) {
  return {after(imu, imu_after, until), after(odometry, odometry_after, until), std::nullopt};
}

std::shared_ptr<const BodyReadings> read_body_tables(const fs::path& folder, bool with_odometry,
                                                     core::Log& log) {
  auto body = std::make_shared<BodyReadings>();

  // The first table with readings counts
  for (const char* name : {"imu.csv", "imu0/data.csv"}) {
    if (body->imu.empty() && is_file(folder / name))
      take_table(read_imu_table(folder / name), body->imu, log);
  }
  if (const fs::path wheels = folder / "odometry.csv"; with_odometry && is_file(wheels))
    take_table(read_odometry_table(wheels), body->odometry, log);
  if (body->imu.empty() && body->odometry.empty()) return nullptr;
  return body;
}

}  // namespace plumbline::dataset
