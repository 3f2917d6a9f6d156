// SPDX-License-Identifier: BSD-3-Clause
// Decisions on merging against the truth. Each robot of a generated world was mapped for itself; each two
// maps, and each two components, are compared as `fuse` does. Prints a line for each pair: keyframes in
// common by the truth, what agrees, the error of the alignment, the odds, and the decision.
//   merge_decisions WORLD...    WORLD has NAME/map.db and w/NAME/groundtruth.txt for each robot
#include <fmt/format.h>

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "plumbline/mapping/merging/map_fusion.hpp"
#include "plumbline/maps/components.hpp"
#include "plumbline/maps/stored_maps.hpp"

namespace {

namespace fs = std::filesystem;
namespace maps = plumbline::maps;
namespace mapping = plumbline::mapping;
using plumbline::core::KeyframeId;
using plumbline::geometry::Rigid3;

/// Poses by stamp, milliseconds.
using Truth = std::map<long, Rigid3>;

Truth read_truth(const fs::path& file) {
  Truth poses;
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    if (line.empty() || line[0] == '#') continue;
    std::istringstream row(line);
    double stamp = 0.0;
    Eigen::Vector3d at;
    Eigen::Vector4d q;
    row >> stamp >> at.x() >> at.y() >> at.z() >> q.x() >> q.y() >> q.z() >> q.w();
    poses[std::lround(1e3 * stamp)] = Rigid3(Eigen::Quaterniond(q).normalized().toRotationMatrix(), at);
  }
  return poses;
}

/// A map, or a component of one, and where it lies by the truth.
struct Part {
  std::string name;
  std::unique_ptr<maps::Map> map;
  mapping::Cameras cameras;
  Rigid3 truth_from_map;
  double worst_m = 0.0;  ///< largest error of its keyframes, laid on the truth
};

void lay_on_truth(const Truth& truth, Part& part) {
  constexpr long kHalfFrame_ms = 3;
  std::vector<std::pair<Rigid3, Rigid3>> both;
  Eigen::Matrix3d turns = Eigen::Matrix3d::Zero();
  for (const KeyframeId id : part.map->keyframe_ids()) {
    const auto there = truth.lower_bound(std::lround(1e3 * part.map->keyframe(id).stamp) - kHalfFrame_ms);
    if (there == truth.end()) continue;
    both.emplace_back(part.map->camera_from_world(id).inverse(), there->second);
    turns += there->second.rotation * both.back().first.rotation.transpose();
  }

  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(turns, Eigen::ComputeFullU | Eigen::ComputeFullV);
  part.truth_from_map.rotation = svd.matrixU() * svd.matrixV().transpose();
  part.truth_from_map.translation.setZero();
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();
  for (const auto& [own, there] : both) shift += there.translation - part.truth_from_map * own.translation;
  part.truth_from_map.translation = shift / std::max(1.0, static_cast<double>(both.size()));
  for (const auto& [own, there] : both) {
    const double error = (part.truth_from_map * own.translation - there.translation).norm();
    part.worst_m = std::max(part.worst_m, error);
  }
}

std::vector<Part> read_parts(const fs::path& world, const maps::StoredMaps& stored) {
  std::vector<Part> parts;
  for (const maps::StoredPart& robot : stored.parts()) {
    const Truth truth = read_truth(world / "w" / robot.name / "groundtruth.txt");
    int component = 0;
    for (const KeyframeId root : maps::roots(robot.run.stored().map)) {
      Part part;
      part.name = component++ == 0 ? robot.name : fmt::format("{}.{}", robot.name, component);
      part.map = std::make_unique<maps::Map>(maps::component(robot.run.stored().map, root));
      for (const maps::RobotInfo& info : robot.robots) part.cameras[info.number] = info.camera.color;
      lay_on_truth(truth, part);
      if (part.map->keyframe_count() > 1) parts.push_back(std::move(part));
    }
  }
  return parts;
}

/// Share of the surface of keyframe `of` that keyframe `by` of another map sees.
double seen_share(const Part& one, KeyframeId of, const Part& other, KeyframeId by,
                  const Rigid3& by_from_of) {
  const auto& features = other.map->keyframe(by).features;
  if (features == nullptr || features->thumbnail_depth.empty()) return 0.0;
  const cv::Mat& depth = features->thumbnail_depth;
  const auto& camera = other.cameras.at(by.robot);
  const double scale = static_cast<double>(depth.cols) / camera.width;

  double seen = 0.0;
  const auto& surface = one.map->keyframe(of).surface;
  for (const maps::SurfaceSample& sample : surface) {
    const Eigen::Vector3d at = by_from_of * sample.point.cast<double>();
    if (at.z() < 0.2) continue;
    const Eigen::Vector2d pixel = camera.project(at) * scale;
    const int x = static_cast<int>(std::floor(pixel.x()));
    const int y = static_cast<int>(std::floor(pixel.y()));
    if (x < 0 || y < 0 || x >= depth.cols || y >= depth.rows) continue;
    if (std::abs(static_cast<double>(depth.at<float>(y, x)) - at.z()) < 0.08 + 0.03 * at.z()) seen += 1.0;
  }
  return seen / std::max<double>(1.0, static_cast<double>(surface.size()));
}

/// Keyframes that see the same by the truth, less than 1.5 m and 40 degrees apart and a fifth of the surface
/// of each in view of the other: their number in the map that has fewer.
std::size_t in_common(const Part& a, const Part& b, const Rigid3& a_from_b) {
  std::set<KeyframeId> of_a;
  std::set<KeyframeId> of_b;
  for (const KeyframeId i : a.map->keyframe_ids()) {
    for (const KeyframeId j : b.map->keyframe_ids()) {
      const Rigid3 i_from_j = a.map->camera_from_world(i) * a_from_b * b.map->camera_from_world(j).inverse();
      if (i_from_j.translation.norm() > 1.5 || plumbline::geometry::rotation_angle(i_from_j.rotation) > 0.7)
        continue;
      if (seen_share(b, j, a, i, i_from_j) < 0.2 || seen_share(a, i, b, j, i_from_j.inverse()) < 0.2)
        continue;
      of_a.insert(i);
      of_b.insert(j);
    }
  }
  return std::min(of_a.size(), of_b.size());
}

void print(const std::string& world, const Part& a, const Part& b, const mapping::MergeEvidence& merge) {
  const Rigid3 truth = a.truth_from_map.inverse() * b.truth_from_map;
  double error = -1.0;
  for (const mapping::VerifiedPair& pair : merge.consistency.pairs) {
    const KeyframeId id = b.map->has_keyframe(pair.query) ? pair.query : pair.match;
    const Eigen::Vector3d at = b.map->camera_from_world(id).inverse().translation;
    error = std::max(error, (merge.alignment.a_from_b * at - truth * at).norm());
  }

  const mapping::Ambiguity& e = merge.ambiguity;
  fmt::print(
      "odds {:+.1f} like {:+.1f} conf {}/{} places {} [maps {:.3f} {:.3f}] {}:{}-{} common {} verified {} "
      "agreeing {} error {:.3f} {} | {}/{} thr {} | alt {} {:.1f} m {}/{} thr {} odds {:+.0f} | {}\n",
      e.overlap.log_odds, e.against_like + merge.validation.against_like, merge.validation.confirmed,
      merge.validation.expected, merge.consistency.places, a.worst_m, b.worst_m, world, a.name, b.name,
      in_common(a, b, truth), merge.consistency.verified, merge.consistency.agreeing, error,
      merge.accepted ? "JOINED" : "apart", e.overlap.matched, e.overlap.expected, e.overlap.contradicted,
      e.alternative, e.alternative_m, e.alternative_overlap.matched, e.alternative_overlap.expected,
      e.alternative_overlap.contradicted, e.alternative_overlap.log_odds, merge.refused);
}

void judge(const fs::path& world, const plumbline::core::Executor& executor) {
  std::vector<fs::path> folders;
  for (const auto& entry : fs::directory_iterator(world)) {
    if (fs::exists(entry.path() / "map.db")) folders.push_back(entry.path());
  }
  std::sort(folders.begin(), folders.end());
  const auto stored = maps::StoredMaps::open(folders, executor);
  if (!stored) return fmt::print(stderr, "{}: {}\n", world.string(), stored.error().message);

  const std::vector<Part> parts = read_parts(world, **stored);
  std::vector<mapping::MapPart> compared;
  for (const Part& part : parts) compared.push_back({part.map.get(), part.cameras});
  for (const mapping::MergeEvidence& merge : mapping::find_overlaps(compared, {}, executor)) {
    print(world.filename().string(), parts[merge.a], parts[merge.b], merge);
  }
}

}  // namespace

int main(int argc, char** argv) {
  const plumbline::core::Executor executor(1);
  for (int i = 1; i < argc; ++i) judge(argv[i], executor);
  return 0;
}
