// SPDX-License-Identifier: BSD-3-Clause
// Detection of a trajectory's format, and reading that all formats share.
#include "trajectories/trajectory_formats.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "plumbline/core/numbers.hpp"
#include "plumbline/core/text.hpp"

namespace plumbline::dataset {
namespace {

constexpr std::size_t kColumns = 8;
constexpr double kMinQuaternionNorm = 1e-3;  // below, the rotation is rounding noise
constexpr std::array<const TrajectoryFormat*, 3> kTrajectoryFormats = {&kKittiTrajectory, &kEurocTrajectory,
                                                                       &kTumTrajectory};

/// Which of stamp, tx ty tz, qx qy qz qw a column of this name is; none for others, such as velocities.
std::optional<std::size_t> role_of(std::string name) {
  name = name.substr(0, name.find_first_of("[("));
  while (!name.empty() && (name.back() == ' ' || name.back() == '_')) name.pop_back();
  if (name.empty()) return std::nullopt;
  const auto begins = [&](const char* word) { return name.rfind(word, 0) == 0; };
  if (begins("time") || begins("stamp") || name == "t") return 0;
  const char axis = name.back();
  const bool rotation = begins("q") || begins("orientation") || begins("rot");
  if (rotation && axis == 'w') return 7;
  if (axis < 'x' || axis > 'z') return std::nullopt;
  const auto offset = static_cast<std::size_t>(axis - 'x');
  if (rotation) return 4 + offset;
  const bool position = name.size() == 1 || begins("p") || begins("t");
  return position ? std::optional<std::size_t>(1 + offset) : std::nullopt;
}

/// The columns that a line names; none when it does not name all eight.
std::optional<TrajectoryColumns> header_of(std::string line) {
  line = core::lower(std::move(line));
  std::replace(line.begin(), line.end(), '#', ' ');
  const bool commas = line.find(',') != std::string::npos;
  const std::vector<std::string> names = split_words(line, commas ? ",;\r\n" : " \t\r\n");
  TrajectoryColumns columns;
  std::array<bool, kColumns> found{};
  for (std::size_t i = 0; i < names.size(); ++i) {
    const std::string name = names[i].substr(std::min(names[i].find_first_not_of(' '), names[i].size()));
    const auto role = role_of(name);
    if (!role || found[*role]) continue;
    found[*role] = true;
    columns.at[*role] = i;
    if (*role == 0) columns.stamp_name = name;
    if (name.rfind("p_rs", 0) == 0) columns.nanoseconds = true;
  }
  const bool all = std::all_of(found.begin(), found.end(), [](bool f) { return f; });
  return all ? std::optional<TrajectoryColumns>(columns) : std::nullopt;
}

/// Sixteen whole numbers between commas are eight with decimal commas.
bool eight_cut_in_two(const std::vector<std::string>& words) {
  const auto whole = [](const std::string& word) {
    return word.find_first_not_of("+-0123456789") == std::string::npos;
  };
  return words.size() == 16 && words[15].size() > 1 && std::all_of(words.begin(), words.end(), whole);
}

core::Result<TrajectoryText> read_text(const std::filesystem::path& file,
                                       std::size_t most_lines = std::numeric_limits<std::size_t>::max()) {
  const auto lines = read_raw_lines(file, most_lines);
  if (!lines) return tl::unexpected(lines.error());
  TrajectoryText text;
  text.file = file.string();

  for (const RawLine& line : *lines) {
    std::vector<std::string> words = split_words(line.text, " \t\r\n,;\v\f");
    if (words.empty()) continue;
    if (text.rows.empty()) {  // a header stands above the rows, as a comment or without '#'
      const auto header = header_of(line.text);
      if (header) text.header = header;
      if (header && words.front().front() != '#') continue;
    }
    if (words.front().front() == '#') continue;

    // Decimal commas would be read as separators
    if (core::has_decimal_comma(split_words(line.text, " \t\r\n;\v\f")) || eight_cut_in_two(words))
      return text.wrong(line.number, "decimal comma; write numbers with a point");
    if (text.rows.empty()) text.commas = line.text.find(',') != std::string::npos;
    text.rows.push_back({line.number, std::move(words)});
  }

  return text;
}

const TrajectoryFormat& format_of(const TrajectoryText& text) {
  return **std::find_if(kTrajectoryFormats.begin(), kTrajectoryFormats.end(),
                        [&](const TrajectoryFormat* format) { return format->recognises(text); });
}

/// Units of the stamp per second.
double units_per_second(const TrajectoryText& text) {
  const std::string name = text.header ? text.header->stamp_name : "";
  const auto says = [&](const char* unit) { return name.find(unit) != std::string::npos; };
  if (says("[ns]") || says("_ns") || says("(ns)") || says("nsec") || says("nano")) return 1e9;
  if (text.header && text.header->nanoseconds) return 1e9;
  if (says("[us]") || says("_us") || says("micro")) return 1e6;
  if (says("[ms]") || says("_ms") || says("milli")) return 1e3;
  const std::vector<std::string>& first = text.rows.front().words;
  const std::size_t column = text.header ? text.header->at[0] : 0;
  const double stamp = column < first.size() ? std::abs(core::to_number(first[column]).value_or(0.0)) : 0.0;
  return stamp > 1e17 ? 1e9 : stamp > 1e14 ? 1e6 : stamp > 1e11 ? 1e3 : 1.0;
}

/// Says how many poses share their stamps with others.
void note_shared_stamps(TrajectoryReading& reading) {
  std::size_t shared = 0;
  std::size_t stamps = 0;
  double first = 0.0;
  for (std::size_t i = 0; i < reading.poses.size();) {
    std::size_t end = i + 1;
    while (end < reading.poses.size() && reading.poses[end].stamp == reading.poses[i].stamp) ++end;
    if (end - i > 1 && stamps++ == 0) first = reading.poses[i].stamp;
    if (end - i > 1) shared += end - i;
    i = end;
  }
  if (stamps == 1) reading.notes.push_back(fmt::format("{} poses share one stamp, {:.6f}", shared, first));
  if (stamps > 1) {
    reading.notes.push_back(
        fmt::format("{} poses share {} stamps, the first of these {:.6f}", shared, stamps, first));
  }
}

}  // namespace

tl::unexpected<core::Error> TrajectoryText::wrong(int line, const std::string& what) const {
  return core::input_error(fmt::format("{}:{}: {}", file, line, what));
}

/// All words of a row as numbers.
core::Result<std::vector<double>> TrajectoryText::numbers(const TextLine& row) const {
  std::vector<double> numbers;
  for (const std::string& word : row.words) {
    const std::optional<double> value = core::to_number(word);
    if (!value) return wrong(row.number, fmt::format("'{}' is not a number", word));
    numbers.push_back(*value);
  }
  return numbers;
}

core::Result<PoseOfRow> read_columns(const TrajectoryText& text, const TextLine& row,
                                     const TrajectoryColumns& columns, double& stamp) {
  std::array<double, kColumns> n{};
  for (std::size_t i = 0; i < kColumns; ++i) {
    if (columns.at[i] >= row.words.size()) {
      return text.wrong(row.number, fmt::format("expected {}, found {} words",
                                                text.header ? "the columns that the header names"
                                                            : "'stamp tx ty tz qx qy qz qw'",
                                                row.words.size()));
    }

    const std::string& word = row.words[columns.at[i]];
    const std::optional<double> value = core::to_number(word);
    if (!value) return text.wrong(row.number, fmt::format("'{}' is not a number", word));
    n[i] = *value;
  }

  // Values that are not finite mark a lost pose
  stamp = n[0] / units_per_second(text);
  if (!std::all_of(n.begin(), n.end(), [](double v) { return std::isfinite(v); })) return PoseOfRow();

  // Rounded quaternions are normalised; zero has no direction
  const Eigen::Quaterniond q(n[7], n[4], n[5], n[6]);
  if (q.norm() < kMinQuaternionNorm) return text.wrong(row.number, "the quaternion is zero");
  if (!std::isfinite(q.norm())) return text.wrong(row.number, "the quaternion is too large to be one");

  return PoseOfRow(geometry::StampedPose{stamp, {q, Eigen::Vector3d(n[1], n[2], n[3])}});
}

core::Result<TrajectoryReading> read_trajectory_file(const std::filesystem::path& file) {
  const auto text = read_text(file);
  if (!text) return tl::unexpected(text.error());

  const TrajectoryFormat& format = format_of(*text);
  TrajectoryReading reading;
  reading.format = format.name;
  reading.stamped = format.stamped;

  // Rows without stamps are numbered
  for (const TextLine& row : text->rows) {
    auto stamp = static_cast<double>(reading.rows.size());
    const auto pose = format.read_row(*text, row, stamp);
    if (!pose) return tl::unexpected(pose.error());
    reading.rows.push_back(stamp);
    if (*pose) reading.poses.push_back({stamp, (*pose)->world_from_camera});
  }

  // Lost poses are left out and counted
  const std::size_t left_out = reading.rows.size() - reading.poses.size();
  if (left_out > 0 && reading.poses.empty())
    return text->wrong(text->rows.front().number, "no row is finite: there is no pose");

  if (left_out > 0) {
    reading.notes.push_back(fmt::format("{} of {} rows hold a value that is not finite and are left out",
                                        left_out, reading.rows.size()));
  }

  // Rows may be in any order
  std::stable_sort(reading.poses.begin(), reading.poses.end(), kByStamp);
  note_shared_stamps(reading);
  return reading;
}

core::Result<geometry::Trajectory> read_trajectory(const std::filesystem::path& file,
                                                   std::vector<std::string>* notes) {
  auto reading = read_trajectory_file(file);
  if (!reading) return tl::unexpected(reading.error());

  // Row numbers are not times
  if (!reading->stamped) {
    return core::input_error(fmt::format(
        "{}: holds matrices without stamps, as KITTI's; 'stamp tx ty tz qx qy qz qw' is needed here",
        file.string()));
  }
  if (notes != nullptr) {
    for (const std::string& note : reading->notes) notes->push_back(file.string() + ": " + note);
  }
  return std::move(reading->poses);
}

bool holds_poses(const std::filesystem::path& file) {
  constexpr std::size_t kLooksAt = 200;  // lines; clouds have millions
  const auto text = read_text(file, kLooksAt);
  if (!text || text->rows.empty()) return false;
  if (text->header || kKittiTrajectory.recognises(*text)) return true;

  // Four of eight numbers form a unit quaternion
  const auto n = text->numbers(text->rows.front());
  if (!n || n->size() != kColumns) return false;
  return std::abs(std::hypot(std::hypot((*n)[4], (*n)[5], (*n)[6]), (*n)[7]) - 1.0) < 1e-3;
}

core::Result<void> pair_by_number(TrajectoryReading& estimate, TrajectoryReading& truth) {
  if (estimate.stamped && truth.stamped) return {};

  // Pairing by number needs equal counts
  if (estimate.rows.size() != truth.rows.size()) {
    return core::input_error(fmt::format(
        "there are no stamps in {}, and the counts differ ({} poses, {} in the truth): they cannot be "
        "paired by number",
        estimate.stamped ? "the truth" : "the estimate", estimate.rows.size(), truth.rows.size()));
  }

  // Row numbers become the other file's stamps
  constexpr double kittis_step_s = 0.1;
  const auto restamp = [&](TrajectoryReading& reading, const TrajectoryReading& other) {
    for (geometry::StampedPose& pose : reading.poses) {
      pose.stamp =
          other.stamped ? other.rows[static_cast<std::size_t>(pose.stamp)] : kittis_step_s * pose.stamp;
    }

    // Rows without a finite stamp are left out
    auto& poses = reading.poses;
    const auto lost = [](const geometry::StampedPose& pose) { return !std::isfinite(pose.stamp); };
    poses.erase(std::remove_if(poses.begin(), poses.end(), lost), poses.end());
    std::stable_sort(poses.begin(), poses.end(), kByStamp);
  };

  // The numbers are lost once the truth has stamps
  const TrajectoryReading unstamped_truth = truth;
  if (!truth.stamped) restamp(truth, estimate);
  if (!estimate.stamped) restamp(estimate, unstamped_truth);
  estimate.notes.push_back(fmt::format("paired by number: {} poses in both files, of which {} has no stamps",
                                       estimate.rows.size(),
                                       estimate.stamped ? "the truth"
                                       : truth.stamped  ? "the estimate"
                                                        : "neither"));
  return {};
}

}  // namespace plumbline::dataset
