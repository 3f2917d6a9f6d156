// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/adjust/control.hpp"

#include <fmt/format.h>

#include <fstream>
#include <iterator>
#include <optional>

#include "plumbline/core/csv.hpp"
#include "plumbline/core/options.hpp"
#include "plumbline/core/text.hpp"

namespace plumbline::adjust {
namespace {

/// A number in metres, which may carry a unit; none: it is none.
std::optional<double> metres_of(const std::string& text) {
  double value = 0.0;
  core::OptionTable table;
  table.number("value", value, {-1e8, 1e8}, "m", "");
  core::ConfigNode node;
  node.kind = core::ConfigNode::Kind::kScalar;
  const std::size_t first = text.find_first_not_of(" \t\r");
  if (first == std::string::npos) return std::nullopt;
  node.scalar = text.substr(first, text.find_last_not_of(" \t\r") - first + 1);

  core::ConfigProblems problems;
  table.set("value", node, "", problems);
  return problems.empty() ? std::optional(value) : std::nullopt;
}

std::vector<std::string> fields_of(const std::string& line) {
  std::vector<std::string> fields;
  for (std::size_t at = 0; at <= line.size();) {
    const core::CsvField field = core::next_csv_field(line, at);
    fields.push_back(core::csv_text(field.field));
    if (field.last) break;
  }

  return fields;
}

}  // namespace

core::Result<Eigen::Vector3d> place_of(const std::string& text, const std::string& flag) {
  const std::vector<std::string> fields = fields_of(text);
  Eigen::Vector3d place;
  bool fine = fields.size() == 3;
  for (std::size_t i = 0; fine && i < 3; ++i) {
    const auto value = metres_of(fields[i]);
    fine = value.has_value();
    place[static_cast<Eigen::Index>(i)] = value.value_or(0.0);
  }

  if (fine) return place;
  return core::usage_error(
      fmt::format("{}: '{}' is not a place; give x,y,z in metres, as the viewer tells them", flag,
                  core::printable(text)));
}

core::Result<Control> length_of(const std::array<std::string, 3>& words) {
  Control control;
  for (std::size_t i = 0; i < 2; ++i) {
    const auto place = place_of(words[i], "--length");
    if (!place) return tl::unexpected(place.error());
    (i == 0 ? control.p : control.q) = *place;
  }

  // The standard deviation follows its length behind "+-", in any unit of length; a tape's is assumed without
  // it.
  const std::size_t sign = words[2].find("+-");
  const auto length = metres_of(words[2].substr(0, sign));
  const auto sigma = sign == std::string::npos ? control.sigma_m : metres_of(words[2].substr(sign + 2));

  if (!length || !sigma || !(*length > 0.0) || !(*sigma > 0.0)) {
    return core::usage_error(
        fmt::format("--length: '{}' is not a length; write 4.57m, or 4.57m+-3mm with its "
                    "standard deviation",
                    core::printable(words[2])));
  }

  if ((control.p - control.q).norm() < 0.05)
    return core::usage_error("--length: its places lie within 5 cm of each other; choose others");
  control.length_m = *length;
  control.sigma_m = *sigma;
  control.name = fmt::format("length {:g} m", *length);
  return control;
}

core::Result<Control> pair_of(ControlKind kind, const std::array<std::string, 2>& words) {
  Control control;
  control.kind = kind;
  const std::string name = kind == ControlKind::kLevel ? "level" : "plumb";
  for (std::size_t i = 0; i < 2; ++i) {
    const auto place = place_of(words[i], "--" + name);
    if (!place) return tl::unexpected(place.error());
    (i == 0 ? control.p : control.q) = *place;
  }

  const Eigen::Vector3d way = control.p - control.q;
  const double apart = kind == ControlKind::kLevel ? way.head<2>().norm() : std::abs(way.z());
  if (apart < 0.2)
    return core::usage_error(fmt::format("--{}: its places lie within 20 cm of each other {}", name,
                                         kind == ControlKind::kLevel ? "from above" : "in height"));
  control.name = fmt::format("{} {}", name, words[0]);
  return control;
}

core::Result<std::vector<Control>> read_points(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) return core::input_error(file.string() + ": no such file, or no permission to read it");
  constexpr std::size_t kMostLines = 10000;
  std::vector<Control> points;
  std::string line;

  for (std::size_t number = 1; std::getline(stream, line) && number <= kMostLines; ++number) {
    const std::vector<std::string> fields = fields_of(line);
    if (line.find_first_not_of(" \t\r,") == std::string::npos || line[0] == '#') continue;
    const bool named = !metres_of(fields[0]);
    std::vector<double> values;
    for (std::size_t i = named ? 1 : 0; i < fields.size(); ++i) {
      const auto value = metres_of(fields[i]);
      if (!value) break;
      values.push_back(*value);
    }

    if (values.empty() && points.empty()) continue;  // the line of words
    const bool whole = values.size() + (named ? 1 : 0) == fields.size();
    if (!whole || values.size() < 6 || values.size() > 7 || (values.size() == 7 && !(values[6] > 0.0))) {
      return core::input_error(fmt::format(
          "{}:{}: is not a point; write [name,] x, y, z in the map, E, N, H in the world [, sigma], metres",
          file.string(), number));
    }
    Control& point = points.emplace_back();
    point.kind = ControlKind::kPoint;

    point.name = "point " + (named ? core::printable(fields[0]) : std::to_string(points.size()));
    point.p = {values[0], values[1], values[2]};
    point.world = {values[3], values[4], values[5]};
    if (values.size() == 7) point.sigma_m = values[6];
  }

  if (points.empty()) return core::input_error(file.string() + ": holds no points");
  return points;
}

}  // namespace plumbline::adjust
