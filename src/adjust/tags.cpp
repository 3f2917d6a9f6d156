// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/adjust/tags.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "plumbline/core/options.hpp"
#include "plumbline/dataset/jpeg.hpp"
#include "plumbline/maps/components.hpp"
#include "tag_part.hpp"

namespace plumbline::adjust {
namespace {

/// The point at which a pixel's ray meets a keyframe's surface, camera frame; none: no surface is near.
std::optional<Eigen::Vector3d> on_surface(const Eigen::Vector3d& ray,
                                          const std::vector<maps::SurfaceSample>& surface) {
  constexpr double kReach_m = 0.06;
  std::vector<double> depths;
  for (const maps::SurfaceSample& sample : surface) {
    const Eigen::Vector3d s = sample.point.cast<double>(), n = sample.normal.cast<double>();

    if ((s - ray * (s.dot(ray) / ray.squaredNorm())).norm() > kReach_m) continue;
    const double slope = n.dot(ray.normalized());

    if (std::abs(slope) > 0.3) depths.push_back(n.dot(s) / n.dot(ray));
  }
  if (depths.size() < 3) return std::nullopt;
  const auto middle = depths.begin() + static_cast<std::ptrdiff_t>(depths.size() / 2);
  std::nth_element(depths.begin(), middle, depths.end());
  return Eigen::Vector3d(ray * *middle);
}

Eigen::Vector3d median_of(const std::vector<Eigen::Vector3d>& places) {
  Eigen::Vector3d median;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (const Eigen::Vector3d& p : places) values.push_back(p[axis]);
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    median[axis] = *middle;
  }

  return median;
}

/// The places at which the views put a tag.
std::vector<Eigen::Vector3d> placed(const PlaceViews& seen, const maps::StoredMap& map, double scale) {
  std::vector<Eigen::Vector3d> places;
  for (const auto& [id, in_camera] : seen)
    places.push_back(map.result.output_from_map *
                     (map.map.camera_from_world(id).inverse() * (scale * in_camera)));
  return places;
}

constexpr double kOnePlace_m = 0.3;

/// True if two of the places that are far from `at` are one.
bool elsewhere_too(const std::vector<Eigen::Vector3d>& places, const Eigen::Vector3d& at) {
  for (std::size_t i = 0; i < places.size(); ++i) {
    if ((places[i] - at).norm() <= kOnePlace_m) continue;
    for (std::size_t j = 0; j < i; ++j) {
      if ((places[j] - at).norm() > kOnePlace_m && (places[j] - places[i]).norm() <= kOnePlace_m) return true;
    }
  }

  return false;
}

Tag tag_of(int id, const PlaceViews& seen, const maps::StoredMap& map) {
  constexpr double kLeast_m = 0.002;
  Tag tag;
  tag.id = id;
  const std::vector<Eigen::Vector3d> places = placed(seen, map, 1.0);

  // Views far from the median see a copy of the tag, or read another tag's number: a copy if two of them
  // agree, or if they are many.
  const Eigen::Vector3d median = median_of(places);
  double squares = 0.0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    if ((places[i] - median).norm() > kOnePlace_m) continue;
    tag.seen.push_back(seen[i]);
    tag.at += places[i];
    squares += (places[i] - median).squaredNorm();
  }

  const std::size_t far = seen.size() - tag.seen.size();
  tag.copied = tag.seen.empty() || 5 * far > seen.size() || elsewhere_too(places, median);
  const auto count = static_cast<double>(std::max<std::size_t>(1, tag.seen.size()));
  tag.at = tag.seen.empty() ? median : Eigen::Vector3d(tag.at / count);
  tag.sigma_m = std::max(kLeast_m, std::sqrt(squares) / count);
  return tag;
}

/// Reads one entry: {tag, at, sigma} or {tags: [a, b], length, sigma}.
void read_entry(const core::ConfigNode& node, TagControl& told, core::ConfigProblems& problems) {
  Control control;
  double sigma = control.sigma_m, length = 0.0;
  int number = -1;
  std::vector<double> pair, world;

  core::OptionTable table;
  table.number("sigma", sigma, {1e-5, 10.0}, "m", "");
  table.number("length", length, {0.05, 1e4}, "m", "");
  table.integer("tag", number, {0, 1000000}, "", "");
  table.numbers("tags", pair, 0, {0.0, 1e6}, "", "");
  table.numbers("at", world, 0, {-1e8, 1e8}, "m", "");

  table.set_all(node, "", problems);
  control.sigma_m = sigma;
  const auto whole = [](double id) { return id == std::floor(id); };
  if (number >= 0 && world.size() == 3) {
    control.kind = ControlKind::kPoint;
    control.world = {world[0], world[1], world[2]};
    control.name = fmt::format("tag {}", number);
    told.ids.emplace_back(number, -1);
  } else if (pair.size() == 2 && length > 0.0 && whole(pair[0]) && whole(pair[1]) && pair[0] != pair[1]) {
    control.length_m = length;
    control.name = fmt::format("tags {:.0f} to {:.0f}", pair[0], pair[1]);
    told.ids.emplace_back(static_cast<int>(pair[0]), static_cast<int>(pair[1]));
  } else {
    problems.push_back({node.mark, "", "write {tag: 3, at: [E, N, H]} or {tags: [3, 5], length: 4.57 m}"});
    return;
  }

  told.control.push_back(control);
}

}  // namespace

core::Result<TagControl> read_tags(const std::filesystem::path& file) {
  const auto root = core::read_yaml(file);
  if (!root) return tl::unexpected(root.error());
  TagControl told;
  core::ConfigProblems problems;
  core::OptionTable table;
  table.choice("family", told.family, {"36h11", "4x4", "5x5", "6x6"}, "Kind of tags");
  table.set_all(*root, "", problems, {"control"});

  if (const core::ConfigNode* control = root->find("control")) {
    if (control->kind == core::ConfigNode::Kind::kMap || control->kind == core::ConfigNode::Kind::kScalar)
      problems.push_back({control->mark, "control", "write a list: lines that begin with \"- \""});
    for (const core::ConfigNode& node : control->items) read_entry(node, told, problems);
  }

  if (!problems.empty()) return tl::unexpected(core::to_error(problems));
  return told;
}

core::Result<std::vector<Tag>> find_tags(const maps::StoredMaps& maps, const std::string& family,
                                         const core::Executor& executor) {
  const auto& functions = core::part<TagFunctions>();
  if (!functions) return tl::unexpected(functions.error());
  const maps::StoredPart& part = maps.parts().front();
  const maps::StoredMap& stored = part.run.stored();

  // Whole pictures of the main part's keyframes; where a tag's middle has depth, it has a place.
  const core::KeyframeId root = maps::main_root(stored.map, stored.frames);
  std::vector<std::vector<std::pair<int, Eigen::Vector3d>>> found(part.views.size());
  std::vector<std::uint8_t> looked(part.views.size(), 0);
  executor.parallel_for(part.views.size(), [&](std::size_t view) {
    const core::KeyframeId id = part.views.keyframes[view];
    if (!id.valid() || !stored.map.has_keyframe(id) || maps::root_of(stored.map, id) != root) return;
    const auto file = part.views.reader->whole_picture(part.views.stored_keyframe(view));

    if (!file || file->empty()) return;

    const auto picture = dataset::decode_jpeg_bytes(*file);
    const auto surface = part.views.surface(view);
    if (!picture || !surface || !*surface) return;
    looked[view] = 1;

    cv::Mat grey = *picture;
    if (grey.channels() == 3) cv::cvtColor(*picture, grey, cv::COLOR_BGR2GRAY);

    const sensor::Pinhole camera = maps::camera_of(maps.robots(), id.robot).color;
    for (const SeenTag& tag : (*functions)->detect(grey, family)) {
      const auto place =
          on_surface(camera.unproject(tag.middle.x(), tag.middle.y(), 1.0), (*surface)->samples);
      if (place) found[view].emplace_back(tag.id, *place);
    }
  });

  if (std::count(looked.begin(), looked.end(), 1) == 0) {
    return core::input_error(part.run.file().string() +
                             ": keeps no whole pictures, in which tags are looked for; map again with --set "
                             "store.images=whole");
  }

  // Sorted by number, so that the order in which views were looked at leaves no trace.
  std::map<int, PlaceViews> seen;
  for (std::size_t view = 0; view < found.size(); ++view) {
    for (const auto& [id, place] : found[view]) seen[id].emplace_back(part.views.keyframes[view], place);
  }

  std::vector<Tag> tags;
  for (const auto& [id, place_views] : seen) tags.push_back(tag_of(id, place_views, stored));
  return tags;
}

std::vector<Control> control_of(const TagControl& told, const std::vector<Tag>& tags,
                                std::vector<std::string>& messages) {
  std::map<int, const Tag*> known;
  for (const Tag& tag : tags) {
    if (!tag.copied) known[tag.id] = &tag;
    if (tag.copied)
      messages.push_back(fmt::format("tag {}: is at several places, a copy; it is not used", tag.id));
  }

  std::vector<Control> control;
  for (std::size_t i = 0; i < told.control.size(); ++i) {
    const auto [a, b] = told.ids[i];
    Control one = told.control[i];
    if (known.count(a) == 0 || (b >= 0 && known.count(b) == 0)) {
      messages.push_back(one.name + ": was not seen at one place; it is not used");
      continue;
    }
    one.p = known[a]->at;
    one.seen = known[a]->seen;

    if (b >= 0) one.q = known[b]->at;
    if (b >= 0) one.seen_q = known[b]->seen;
    one.sigma_m = std::hypot(one.sigma_m, known[a]->sigma_m, b >= 0 ? known[b]->sigma_m : 0.0);
    control.push_back(std::move(one));
  }

  return control;
}

std::string tags_table(const std::vector<Tag>& tags, const maps::StoredMap& map, double scale) {
  std::string table = "tag,x,y,z,sigma,keyframes,used\n";
  for (const Tag& tag : tags) {
    Eigen::Vector3d at = Eigen::Vector3d::Zero();
    for (const Eigen::Vector3d& p : placed(tag.seen, map, scale))
      at += p / static_cast<double>(tag.seen.size());
    table += fmt::format("{},{:.4f},{:.4f},{:.4f},{:.4f},{},{}\n", tag.id, at.x(), at.y(), at.z(),
                         tag.sigma_m * scale, tag.seen.size(), tag.copied ? 0 : 1);
  }

  return table;
}

}  // namespace plumbline::adjust
