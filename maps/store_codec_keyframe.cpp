// SPDX-License-Identifier: BSD-3-Clause
// Keyframes as bytes: column by column, each column in byte planes.
#include <algorithm>
#include <utility>

#include "store_codec.hpp"

namespace plumbline::maps {
namespace {

using features::CornerPatch;
using features::FrameFeatures;
using features::LineFeature;
using features::PointFeature;

/// Calls column(get) for each number of a thing, get giving a reference to it; the order is the format's.
template <typename Visitor>
void point_columns(const Visitor& column) {
  column([](auto& p) -> auto& { return p.pixel.x(); });
  column([](auto& p) -> auto& { return p.pixel.y(); });
  column([](auto& p) -> auto& { return p.depth; });
  column([](auto& p) -> auto& { return p.angle; });
  column([](auto& p) -> auto& { return p.response; });
}
template <typename Visitor>
void segment_columns(const Visitor& column) {
  column([](auto& l) -> auto& { return l.segment.start.x(); });
  column([](auto& l) -> auto& { return l.segment.start.y(); });
  column([](auto& l) -> auto& { return l.segment.end.x(); });
  column([](auto& l) -> auto& { return l.segment.end.y(); });
  column([](auto& l) -> auto& { return l.segment.response; });
}
template <typename Visitor>
void line3_columns(const Visitor& column) {
  for (int i = 0; i < 3; ++i) {
    column([i](auto& l) -> auto& { return l.start(i); });
    column([i](auto& l) -> auto& { return l.end(i); });
  }
}
template <typename Visitor>
void line3_quality_columns(const Visitor& column) {
  column([](auto& l) -> auto& { return l.inlier_share; });
  column([](auto& l) -> auto& { return l.coverage; });
  column([](auto& l) -> auto& { return l.start_noise.depth; });
  column([](auto& l) -> auto& { return l.start_noise.across; });
  column([](auto& l) -> auto& { return l.end_noise.depth; });
  column([](auto& l) -> auto& { return l.end_noise.across; });
}
template <typename Visitor>
void surface_columns(const Visitor& column) {
  for (int i = 0; i < 3; ++i) column([i](auto& s) -> auto& { return s.point(i); });
  for (int i = 0; i < 3; ++i) column([i](auto& s) -> auto& { return s.normal(i); });
  column([](auto& s) -> auto& { return s.sigma; });
}

template <typename T, typename Things>
auto column_writer(const Things& things, ByteWriter& to) {
  return [&things, &to](const auto& get) {
    std::vector<T> column;
    column.reserve(things.size());
    for (const auto& thing : things) column.push_back(get(thing));
    to.planes(column);
  };
}
template <typename T, typename Things>
auto column_reader(Things& things, ByteReader& from) {
  return [&things, &from](const auto& get) {
    const std::vector<T> column = from.planes<T>(things.size());
    for (std::size_t i = 0; i < column.size(); ++i) get(things[i]) = column[i];
  };
}

void write_image(const cv::Mat& image, ByteWriter& to) {
  if (!image.empty() && image.type() != CV_32FC1)
    throw std::invalid_argument("store: thumbnail is no CV_32FC1");
  to.put(static_cast<std::int32_t>(image.rows));
  to.put(static_cast<std::int32_t>(image.cols));
  std::vector<float> values;
  values.reserve(image.total());
  for (int y = 0; y < image.rows; ++y)
    values.insert(values.end(), image.ptr<float>(y), image.ptr<float>(y) + image.cols);
  to.planes(values);
}

cv::Mat read_image(ByteReader& from) {
  const auto rows = from.get<std::int32_t>();
  const auto columns = from.get<std::int32_t>();
  if (rows < 0 || columns < 0 || rows > 1 << 14 || columns > 1 << 14)
    throw BadBytes("a picture's size is wrong");
  const std::size_t width = static_cast<std::size_t>(columns);
  const std::vector<float> values = from.planes<float>(static_cast<std::size_t>(rows) * width);
  if (values.empty()) return {};
  cv::Mat image(rows, columns, CV_32FC1);
  for (int y = 0; y < rows; ++y) {
    std::memcpy(image.ptr<float>(y), values.data() + static_cast<std::size_t>(y) * width,
                width * sizeof(float));
  }
  return image;
}

void write_lines(const std::vector<LineFeature>& lines, ByteWriter& to) {
  to.count(lines.size());
  segment_columns(column_writer<float>(lines, to));
  for (const LineFeature& l : lines) to.put(l.descriptor);
  std::vector<features::Line3> in_space;
  for (const LineFeature& l : lines) {
    to.flag(l.line3.has_value());
    if (l.line3.has_value()) in_space.push_back(*l.line3);
  }
  line3_columns(column_writer<double>(in_space, to));
  line3_quality_columns(column_writer<float>(in_space, to));
}

std::vector<LineFeature> read_lines(ByteReader& from) {
  std::vector<LineFeature> lines(from.count(5 * sizeof(float)));
  segment_columns(column_reader<float>(lines, from));
  for (LineFeature& l : lines) from.get(l.descriptor);
  std::size_t in_space = 0;
  for (LineFeature& l : lines) {
    if (!from.flag()) continue;
    l.line3.emplace();
    ++in_space;
  }
  std::vector<features::Line3> values(in_space);
  line3_columns(column_reader<double>(values, from));
  line3_quality_columns(column_reader<float>(values, from));
  auto next = values.begin();
  for (LineFeature& l : lines) {
    if (l.line3.has_value()) *l.line3 = *next++;
  }
  return lines;
}

void write_features(const FrameFeatures& f, ByteWriter& to) {
  to.count(f.points.size());
  point_columns(column_writer<float>(f.points, to));
  column_writer<std::int32_t>(f.points, to)([](const PointFeature& p) { return p.octave; });
  to.count(f.descriptors.size());
  for (const auto& descriptor : f.descriptors) to.put(descriptor);
  write_lines(f.lines, to);
  write_image(f.thumbnail, to);
  write_image(f.thumbnail_depth, to);
}

FrameFeatures read_features(ByteReader& from, const sensor::Pinhole& picture) {
  FrameFeatures f;
  f.points.resize(from.count(6 * sizeof(float)));
  point_columns(column_reader<float>(f.points, from));
  column_reader<std::int32_t>(f.points, from)([](PointFeature & p) -> auto& { return p.octave; });
  f.descriptors.resize(from.count(sizeof(features::Descriptor256)));
  for (auto& descriptor : f.descriptors) from.get(descriptor);
  f.lines = read_lines(from);
  f.thumbnail = read_image(from);
  f.thumbnail_depth = read_image(from);
  f.grid = features::PointGrid(f.points, picture.width, picture.height);
  return f;
}

void write_patches(const FrameFeatures& f, ByteWriter& to) {
  to.count(f.patches.size());
  const auto column = column_writer<float>(f.patches, to);
  column([](const CornerPatch& p) { return p.offset.x(); });
  column([](const CornerPatch& p) { return p.offset.y(); });
  std::vector<std::uint8_t> gray;
  gray.reserve(f.patches.size() * CornerPatch::kPixels);
  for (const CornerPatch& p : f.patches) gray.insert(gray.end(), p.gray.begin(), p.gray.end());
  to.planes(gray);
}

void read_patches(ByteReader& from, FrameFeatures& f) {
  f.patches.resize(from.count(2 * sizeof(float) + CornerPatch::kPixels));
  if (!f.patches.empty() && f.patches.size() != f.points.size()) throw BadBytes("patches and points differ");
  const auto column = column_reader<float>(f.patches, from);
  column([](CornerPatch & p) -> auto& { return p.offset.x(); });
  column([](CornerPatch & p) -> auto& { return p.offset.y(); });
  const auto gray = from.planes<std::uint8_t>(f.patches.size() * CornerPatch::kPixels);
  auto next = gray.begin();
  for (std::size_t i = 0; i < f.patches.size(); ++i) {
    std::copy_n(next, CornerPatch::kPixels, f.patches[i].gray.begin());
    next += CornerPatch::kPixels;
    f.patches[i].middle = f.points[i].pixel - f.patches[i].offset;
  }
}

}  // namespace

void encode(const Keyframe& keyframe, ByteWriter& to) {
  to.put(keyframe.id);
  to.put(keyframe.frame_index);
  to.put(keyframe.stamp);
  to.put(keyframe.turn_rate);
  to.put(keyframe.reference);
  to.put(keyframe.camera_from_reference);
  to.put(keyframe.reference_sigma_m);
  to.flag(keyframe.features != nullptr);
  if (keyframe.features != nullptr) write_features(*keyframe.features, to);
  to.count(keyframe.surface.size());
  surface_columns(column_writer<float>(keyframe.surface, to));
  if (keyframe.features != nullptr) write_patches(*keyframe.features, to);
}

std::shared_ptr<const Keyframe> decode_keyframe(const Bytes& bytes, const sensor::Pinhole& picture) {
  ByteReader from(bytes);
  auto keyframe = std::make_shared<Keyframe>();
  from.get(keyframe->id);
  from.get(keyframe->frame_index);
  from.get(keyframe->stamp);
  from.get(keyframe->turn_rate);
  from.get(keyframe->reference);
  from.get(keyframe->camera_from_reference);
  from.get(keyframe->reference_sigma_m);
  std::shared_ptr<FrameFeatures> features;
  if (from.flag()) features = std::make_shared<FrameFeatures>(read_features(from, picture));
  keyframe->surface.resize(from.count(7 * sizeof(float)));
  surface_columns(column_reader<float>(keyframe->surface, from));
  if (features != nullptr) read_patches(from, *features);
  keyframe->features = features;
  from.expect_end();
  return keyframe;
}

}  // namespace plumbline::maps
