// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/maps/keyframe_message.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <opencv2/core.hpp>
#include <utility>

#include "plumbline/sensor/depth_noise.hpp"
#include "store_bytes.hpp"

namespace plumbline::maps {
namespace {

constexpr std::uint16_t kVersion = 2;
constexpr double kPixelSteps = 4.0;      // per pixel, for pictures up to 16000 pixels wide
constexpr double kLengthSteps = 1000.0;  // per metre
constexpr double kPictureSteps = 50.0;   // per metre, of the small depth picture
constexpr double kNoiseSteps = 10000.0;
constexpr int kTurn = 32;                       // directions
constexpr std::size_t kMostPlain = 64U << 20U;  // bytes of a message, unpacked

std::uint16_t unsigned_steps(double value, double steps) {
  return static_cast<std::uint16_t>(std::clamp(std::lround(value * steps), 0L, 65535L));
}
std::int16_t signed_steps(double value, double steps) {
  return static_cast<std::int16_t>(std::clamp(std::lround(value * steps), -32767L, 32767L));
}
float from(double value, double steps) { return static_cast<float>(value / steps); }

/// Pixels begin half a pixel before the middle of the first one.
double pixel_steps(const sensor::Pinhole& camera) {
  return std::min(kPixelSteps, 65000.0 / std::max(1, std::max(camera.width, camera.height)));
}

/// Collects one column after another.
template <typename T, typename Items, typename Get>
void column(ByteWriter& to, const Items& items, const Get& get) {
  std::vector<T> values;
  values.reserve(items.size());
  for (const auto& item : items) values.push_back(static_cast<T>(get(item)));
  to.apart(values);
}

/// By octave, then from above to below: what follows each other lies close, and small steps pack well.
std::vector<std::size_t> by_row(const features::FrameFeatures& f) {
  std::vector<std::size_t> order(f.points.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    const features::PointFeature& p = f.points[a];
    const features::PointFeature& q = f.points[b];
    return std::make_pair(p.octave, p.pixel.y()) < std::make_pair(q.octave, q.pixel.y());
  });
  return order;
}

/// Numbers of landmarks by feature: whether there is one, and those that there are.
void write_landmarks(const std::vector<std::int32_t>& numbers, ByteWriter& to) {
  std::vector<std::int32_t> known;
  std::vector<std::uint8_t> any((numbers.size() + 7) / 8, 0);
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (numbers[i] < 0) continue;
    any[i / 8] = static_cast<std::uint8_t>(any[i / 8] | 1U << i % 8);
    known.push_back(numbers[i]);
  }
  to.apart(any);
  to.count(known.size());
  to.apart(known);
}

std::vector<std::int32_t> read_landmarks(ByteReader& bytes, std::size_t n) {
  const auto any = bytes.planes<std::uint8_t>((n + 7) / 8);
  const auto known = bytes.planes<std::int32_t>(bytes.count(4));
  std::vector<std::int32_t> numbers(n, -1);
  std::size_t next = 0;
  for (std::size_t i = 0; i < n; ++i) {
    if ((any[i / 8] >> i % 8 & 1) == 0) continue;
    if (next == known.size()) throw BadBytes("it ends too early");
    numbers[i] = known[next++];
  }
  return numbers;
}

void write_points(const features::FrameFeatures& f, const std::vector<std::int32_t>& landmarks, double steps,
                  ByteWriter& to) {
  const std::vector<std::size_t> order = by_row(f);
  const auto at = [&](std::size_t i) -> const features::PointFeature& { return f.points[i]; };
  to.count(order.size());
  std::uint16_t last = 0;
  column<std::uint16_t>(to, order, [&](std::size_t i) {
    const std::uint16_t row = unsigned_steps(double{at(i).pixel.y()} + 0.5, steps);
    return row - std::exchange(last, row);
  });
  column<std::uint16_t>(to, order,
                        [&](std::size_t i) { return unsigned_steps(double{at(i).pixel.x()} + 0.5, steps); });
  column<std::uint16_t>(to, order,
                        [&](std::size_t i) { return unsigned_steps(double{at(i).depth}, kLengthSteps); });
  column<std::uint8_t>(
      to, order, [&](std::size_t i) { return std::lround(at(i).angle / 360.0F * kTurn) & (kTurn - 1); });
  column<std::uint8_t>(to, order, [&](std::size_t i) { return at(i).octave; });
  for (const std::size_t i : order) to.put(f.descriptors[i]);
  std::vector<std::int32_t> numbers;
  for (const std::size_t i : order) numbers.push_back(landmarks[i]);
  write_landmarks(numbers, to);
}

void read_points(ByteReader& bytes, const sensor::Pinhole& camera, features::FrameFeatures& f,
                 std::vector<std::int32_t>& landmarks) {
  const double steps = pixel_steps(camera);
  const std::size_t n = bytes.count(40);
  const auto y = bytes.planes<std::uint16_t>(n);
  const auto x = bytes.planes<std::uint16_t>(n);
  const auto depth = bytes.planes<std::uint16_t>(n);
  const auto angle = bytes.planes<std::uint8_t>(n);
  const auto octave = bytes.planes<std::uint8_t>(n);
  f.points.resize(n);
  f.descriptors.resize(n);
  std::uint16_t row = 0;
  for (std::size_t i = 0; i < n; ++i) {
    row = static_cast<std::uint16_t>(row + y[i]);
    f.points[i].pixel = {from(x[i], steps) - 0.5F, from(row, steps) - 0.5F};
    f.points[i].depth = from(depth[i], kLengthSteps);
    f.points[i].angle = static_cast<float>(angle[i]) * 360.0F / kTurn;
    f.points[i].octave = octave[i];
    bytes.get(f.descriptors[i]);
  }
  landmarks = read_landmarks(bytes, n);
  f.grid = features::PointGrid(f.points, camera.width, camera.height);
}

/// Ends of segments and their depth: the ends of lines in space lie on the rays of the segments' ends.
constexpr std::size_t kLineColumns = 6;

std::array<std::uint16_t, kLineColumns> line_numbers(const features::LineFeature& line, double steps) {
  const Eigen::Vector2f& start = line.segment.start;
  const Eigen::Vector2f& end = line.segment.end;
  std::array<std::uint16_t, kLineColumns> numbers{unsigned_steps(double{start.x()} + 0.5, steps),
                                                  unsigned_steps(double{start.y()} + 0.5, steps),
                                                  unsigned_steps(double{end.x()} + 0.5, steps),
                                                  unsigned_steps(double{end.y()} + 0.5, steps),
                                                  0,
                                                  0};
  if (line.line3) {
    numbers[4] = unsigned_steps(line.line3->start.z(), kLengthSteps);
    numbers[5] = unsigned_steps(line.line3->end.z(), kLengthSteps);
  }
  for (const std::size_t end_column : {2U, 3U}) {
    numbers[end_column] = static_cast<std::uint16_t>(numbers[end_column] - numbers[end_column - 2]);
  }
  numbers[5] = static_cast<std::uint16_t>(numbers[5] - numbers[4]);
  return numbers;
}

void write_lines(const features::FrameFeatures& f, double steps, ByteWriter& to) {
  to.count(f.lines.size());
  for (std::size_t k = 0; k < kLineColumns; ++k) {
    column<std::uint16_t>(to, f.lines,
                          [&](const features::LineFeature& l) { return line_numbers(l, steps)[k]; });
  }
  column<std::uint8_t>(to, f.lines, [](const features::LineFeature& l) { return l.line3 ? 1 : 0; });
  for (const features::LineFeature& line : f.lines) to.put(line.descriptor);
}

void read_lines(ByteReader& bytes, const sensor::Pinhole& camera, features::FrameFeatures& f) {
  const double steps = pixel_steps(camera);
  f.lines.resize(bytes.count(2 * kLineColumns + 33));
  std::array<std::vector<std::uint16_t>, kLineColumns> columns;
  for (auto& numbers : columns) numbers = bytes.planes<std::uint16_t>(f.lines.size());
  const auto deep = bytes.planes<std::uint8_t>(f.lines.size());
  for (std::size_t i = 0; i < f.lines.size(); ++i) {
    features::LineFeature& line = f.lines[i];
    const auto number = [&](std::size_t column) { return columns[column][i]; };
    const auto sum = [&](std::size_t a, std::size_t b) {
      return static_cast<std::uint16_t>(number(a) + number(b));
    };
    line.segment.start = {from(number(0), steps) - 0.5F, from(number(1), steps) - 0.5F};
    line.segment.end = {from(sum(0, 2), steps) - 0.5F, from(sum(1, 3), steps) - 0.5F};
    bytes.get(line.descriptor);
    if (deep[i] > 1) throw BadBytes("a flag is neither 0 nor 1");
    if (deep[i] == 0) continue;
    features::Line3 line3;
    const auto on_ray = [&](const Eigen::Vector2f& pixel, std::uint16_t depth) {
      return camera.unproject(double{pixel.x()}, double{pixel.y()}, depth / kLengthSteps);
    };
    line3.start = on_ray(line.segment.start, number(4));
    line3.end = on_ray(line.segment.end, sum(4, 5));
    const auto expected = [&](const Eigen::Vector3d& end) {
      return features::EndpointNoise{static_cast<float>(sensor::depth_sigma(end.z())),
                                     static_cast<float>(end.z() / camera.fx)};
    };
    line3.start_noise = expected(line3.start);
    line3.end_noise = expected(line3.end);
    line.line3 = line3;
  }
}

void write_surface(const std::vector<SurfaceSample>& all, ByteWriter& to) {
  constexpr double kUnit = 127.0;
  constexpr std::size_t kMost = 128;  // evenly chosen: they are spread over the picture
  std::vector<SurfaceSample> surface;
  const std::size_t step = (all.size() + kMost - 1) / kMost;
  for (std::size_t i = 0; i < all.size(); i += step) surface.push_back(all[i]);
  to.count(surface.size());
  for (int axis = 0; axis < 3; ++axis) {
    column<std::int16_t>(to, surface,
                         [&](const SurfaceSample& s) { return signed_steps(double{s.point[axis]}, 2000.0); });
    column<std::int8_t>(to, surface,
                        [&](const SurfaceSample& s) { return std::lround(double{s.normal[axis]} * kUnit); });
  }
  column<std::uint16_t>(to, surface,
                        [](const SurfaceSample& s) { return unsigned_steps(double{s.sigma}, kNoiseSteps); });
}

std::vector<SurfaceSample> read_surface(ByteReader& bytes) {
  std::vector<SurfaceSample> surface(bytes.count(11));
  for (int axis = 0; axis < 3; ++axis) {
    const auto points = bytes.planes<std::int16_t>(surface.size());
    const auto normals = bytes.planes<std::int8_t>(surface.size());
    for (std::size_t i = 0; i < surface.size(); ++i) {
      surface[i].point[axis] = from(points[i], 2000.0);
      surface[i].normal[axis] = normals[i];
    }
  }
  const auto sigma = bytes.planes<std::uint16_t>(surface.size());
  for (std::size_t i = 0; i < surface.size(); ++i) {
    surface[i].normal.normalize();
    surface[i].sigma = from(sigma[i], kNoiseSteps);
  }
  return surface;
}

void write_depth(const cv::Mat& depth, ByteWriter& to) {
  to.put(static_cast<std::uint16_t>(depth.cols));
  to.put(static_cast<std::uint16_t>(depth.rows));
  std::vector<std::uint16_t> steps;  // from one pixel to the next: small numbers pack well
  std::uint16_t last = 0;
  for (int y = 0; y < depth.rows; ++y) {
    for (int x = 0; x < depth.cols; ++x) {
      const std::uint16_t now = unsigned_steps(double{depth.at<float>(y, x)}, kPictureSteps);
      steps.push_back(static_cast<std::uint16_t>(now - last));
      last = now;
    }
  }
  to.apart(steps);
}

cv::Mat read_depth(ByteReader& bytes) {
  const int columns = bytes.get<std::uint16_t>();
  const int rows = bytes.get<std::uint16_t>();
  const auto steps =
      bytes.planes<std::uint16_t>(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
  if (steps.empty()) return {};
  cv::Mat depth(rows, columns, CV_32FC1);
  std::uint16_t last = 0;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    last = static_cast<std::uint16_t>(last + steps[i]);
    depth.at<float>(static_cast<int>(i) / columns, static_cast<int>(i) % columns) = from(last, kPictureSteps);
  }
  return depth;
}

template <typename IdType>
std::vector<std::int32_t> numbers_of(const std::vector<IdType>& ids, std::size_t features) {
  std::vector<std::int32_t> numbers(features, -1);
  for (std::size_t i = 0; i < std::min(ids.size(), features); ++i) {
    if (ids[i].valid()) numbers[i] = ids[i].index;
  }
  return numbers;
}

KeyframeMessage decode(const Bytes& packed) {
  const Bytes plain = unpack(packed.data(), packed.size(), kMostPlain);
  ByteReader bytes(plain);
  if (bytes.get<std::uint16_t>() != kVersion) throw BadBytes("it is of another version");
  KeyframeMessage message;
  auto keyframe = std::make_shared<Keyframe>();
  bytes.get(keyframe->id);
  bytes.get(keyframe->frame_index);
  bytes.get(keyframe->stamp);
  bytes.get(keyframe->turn_rate);
  bytes.get(message.camera_from_world);
  sensor::Pinhole& c = message.camera;
  for (int* size : {&c.width, &c.height}) *size = bytes.get<std::int32_t>();
  for (double* value : {&c.fx, &c.fy, &c.cx, &c.cy}) bytes.get(*value);
  constexpr int kMost_px = 65000;
  if (c.width < 1 || c.height < 1 || c.width > kMost_px || c.height > kMost_px)
    throw BadBytes("it has no camera");
  auto features = std::make_shared<features::FrameFeatures>();
  read_points(bytes, c, *features, message.points);
  read_lines(bytes, c, *features);
  features->thumbnail_depth = read_depth(bytes);
  message.lines = read_landmarks(bytes, features->lines.size());
  keyframe->features = features;
  keyframe->surface = read_surface(bytes);
  message.keyframe = keyframe;
  message.moved.resize(bytes.count(32));
  for (auto& [id, pose] : message.moved) {
    id.robot = keyframe->id.robot;
    bytes.get(id.index);
    Eigen::Matrix<float, 4, 1> turn;
    Eigen::Matrix<float, 3, 1> shift;
    bytes.get(turn);
    bytes.get(shift);
    if (!turn.allFinite() || turn.norm() < 0.5F) throw BadBytes("a pose is none");
    pose = {Eigen::Quaterniond(turn.cast<double>()), shift.cast<double>()};
  }
  message.cloud = bytes.planes<std::uint8_t>(bytes.count(1));
  bytes.expect_end();
  return message;
}

}  // namespace

KeyframeMessage make_message(const Map& map, KeyframeId id, const sensor::Pinhole& camera, int recent) {
  KeyframeMessage message;
  const Keyframe& keyframe = map.keyframe(id);
  auto copy = std::make_shared<Keyframe>(keyframe);
  if (copy->features == nullptr) copy->features = std::make_shared<features::FrameFeatures>();
  message.camera_from_world = map.camera_from_world(id);
  message.camera = camera;
  message.points = numbers_of(map.points_of(id), copy->features->points.size());
  message.lines = numbers_of(map.lines_of(id), copy->features->lines.size());
  message.keyframe = copy;
  for (std::int32_t i = id.index - 1; i >= 0 && static_cast<int>(message.moved.size()) < recent; --i) {
    const KeyframeId earlier{id.robot, i};
    if (map.has_keyframe(earlier)) message.moved.emplace_back(earlier, map.camera_from_world(earlier));
  }
  return message;
}

std::vector<std::uint8_t> encode_message(const KeyframeMessage& message) {
  const Keyframe& keyframe = *message.keyframe;
  const features::FrameFeatures& features = *keyframe.features;
  const double steps = pixel_steps(message.camera);
  ByteWriter to;
  to.put(kVersion);
  to.put(keyframe.id);
  to.put(keyframe.frame_index);
  to.put(keyframe.stamp);
  to.put(keyframe.turn_rate);
  to.put(message.camera_from_world);
  const sensor::Pinhole& c = message.camera;
  for (const int size : {c.width, c.height}) to.put(static_cast<std::int32_t>(size));
  for (const double value : {c.fx, c.fy, c.cx, c.cy}) to.put(value);
  write_points(features, message.points, steps, to);
  write_lines(features, steps, to);
  write_depth(features.thumbnail_depth, to);
  write_landmarks(message.lines, to);
  write_surface(keyframe.surface, to);
  to.count(message.moved.size());
  for (const auto& [id, pose] : message.moved) {
    to.put(id.index);
    to.put(Eigen::Matrix<float, 4, 1>(pose.quaternion().coeffs().cast<float>()));
    to.put(Eigen::Matrix<float, 3, 1>(pose.translation.cast<float>()));
  }
  to.count(message.cloud.size());
  to.apart(message.cloud);
  return pack(to.bytes(), to.cuts());
}

core::Result<KeyframeMessage> decode_message(const std::vector<std::uint8_t>& bytes) {
  try {
    return decode(bytes);
  } catch (const BadBytes& bad) {
    return core::input_error(fmt::format("a keyframe's message cannot be read: {}", bad.what()));
  }
}

}  // namespace plumbline::maps
