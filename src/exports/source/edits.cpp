// SPDX-License-Identifier: BSD-3-Clause
#include "source/edits.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <optional>
#include <system_error>
#include <utility>

#include "plumbline/core/config.hpp"
#include "plumbline/core/options.hpp"

namespace plumbline::exports {
namespace {

constexpr double kEverywhere_m = 1e6;
constexpr std::size_t kMostCorners = 1000;

/// The numbers of a list of lists, or of a flat one.
void add_numbers(const core::ConfigNode& node, std::vector<double>& numbers, core::ConfigProblems& problems) {
  if (node.kind == core::ConfigNode::Kind::kSequence) {
    for (const core::ConfigNode& item : node.items) add_numbers(item, numbers, problems);
    return;
  }

  double value = 0.0;
  core::OptionTable table;
  table.number("number", value, {-kEverywhere_m, kEverywhere_m}, "m", "");
  table.set("number", node, "", problems);
  numbers.push_back(value);
}

std::vector<double> numbers_of(const core::ConfigNode& edit, const std::string& key,
                               core::ConfigProblems& problems) {
  std::vector<double> numbers;
  if (const core::ConfigNode* node = edit.find(key)) add_numbers(*node, numbers, problems);
  return numbers;
}

}  // namespace

bool Edits::Piece::contains(const Eigen::Vector3d& p) const {
  if (!box.contains(p)) return false;
  if (polygon.empty()) return true;
  bool inside = false;
  for (std::size_t i = 0, j = polygon.size() - 1; i < polygon.size(); j = i++) {
    const Eigen::Vector2d& a = polygon[i];
    const Eigen::Vector2d& b = polygon[j];
    if ((a.y() > p.y()) != (b.y() > p.y()) &&
        p.x() < (b.x() - a.x()) * (p.y() - a.y()) / (b.y() - a.y()) + a.x())
      inside = !inside;
  }

  return inside;
}

core::Result<Edits> Edits::of(const std::string& named, const std::filesystem::path& folder) {
  std::error_code ec;
  if (!named.empty()) return parse(named);
  if (folder.empty() || !std::filesystem::is_regular_file(folder / kEditsFile, ec)) return Edits();
  return parse(folder / kEditsFile);
}

/// A list of {remove: box|ceiling...}: see docs/guide/control.md.
core::Result<Edits> Edits::parse(const std::filesystem::path& file) {
  const auto root = core::read_yaml(file);
  if (!root) return tl::unexpected(root.error());
  Edits edits;
  if (root->kind == core::ConfigNode::Kind::kNull) return edits;  // every line was deleted
  core::ConfigProblems problems;
  double scale = 1.0;

  for (const core::ConfigNode& edit : root->items) {
    if (const auto factor = numbers_of(edit, "scale", problems); factor.size() == 1) {
      scale *= factor.front();
      continue;
    }
    Piece piece;
    piece.ceiling = edit.find("ceiling") != nullptr;
    const core::ConfigNode* what = edit.find(piece.ceiling ? "ceiling" : "remove");
    const std::string kind = what != nullptr ? what->scalar : "";

    const std::vector<double> n = numbers_of(edit, "at", problems);
    bool fine = false;
    if (kind == "box" && n.size() == 6) {
      piece.box.extend(Eigen::Vector3d(n[0], n[1], n[2])).extend(Eigen::Vector3d(n[3], n[4], n[5]));
      fine = true;
    } else if (kind == "polygon" && n.size() >= 6 && n.size() % 2 == 0 && n.size() <= 2 * kMostCorners) {
      const auto z = numbers_of(edit, "z", problems);
      fine = z.empty() || (z.size() == 2 && z[0] < z[1]);
      for (std::size_t i = 0; fine && i < n.size(); i += 2) {
        piece.polygon.emplace_back(scale * n[i], scale * n[i + 1]);
        piece.box.extend(Eigen::Vector3d(n[i], n[i + 1], z.empty() ? -kEverywhere_m : z[0]));
        piece.box.extend(Eigen::Vector3d(n[i], n[i + 1], z.empty() ? kEverywhere_m : z[1]));
      }
    }

    if (!fine) {
      problems.push_back(
          {edit.mark, "",
           "is not an edit; write {remove: box, at: [x, y, z, x, y, z]}, {remove: polygon, at: [[x, y], "
           "...], z: [low, high]}, or 'ceiling' in place of 'remove'"});
      continue;
    }
    piece.box = Eigen::AlignedBox3d(scale * piece.box.min(), scale * piece.box.max());
    edits.pieces_.push_back(std::move(piece));
  }

  if (root->kind != core::ConfigNode::Kind::kSequence)
    problems.push_back({root->mark, "", "must be a list of edits"});
  if (!problems.empty()) return tl::unexpected(core::to_error(problems));
  return edits;
}

void Edits::take_ceilings(std::vector<double> floors) {
  floors_ = std::move(floors);
  no_ceilings_ = true;
}

bool Edits::removes(const Eigen::Vector3d& p, float normal_z) const {
  for (const Piece& piece : pieces_) {
    if ((!piece.ceiling || no_ceilings_) && piece.contains(p)) return true;
  }
  constexpr float kDown = -0.8F;
  constexpr double kHeadroom_m = 1.8;
  if (!no_ceilings_ || floors_.empty() || !(normal_z < kDown)) return false;
  const auto above = std::upper_bound(floors_.begin(), floors_.end(), p.z());
  return above != floors_.begin() && p.z() > *std::prev(above) + kHeadroom_m;
}

core::Result<std::string> edits_text(const std::filesystem::path& file, double scale) {
  if (const auto edits = Edits::parse(file); !edits) return tl::unexpected(edits.error());
  std::ifstream stream(file, std::ios::binary);
  const std::string text((std::istreambuf_iterator<char>(stream)), {});
  if (scale == 1.0) return text;
  return fmt::format("- {{scale: {:.9f}}}  # of the lines below, which were made before adjust\n", scale) +
         text;
}

}  // namespace plumbline::exports
