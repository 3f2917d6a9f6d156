// SPDX-License-Identifier: BSD-3-Clause
// Keyframes and coarse surfaces as bytes: column by column, each column in byte planes.
#include <algorithm>
#include <cmath>
#include <utility>

#include "store/store_codec.hpp"

namespace plumbline::maps {
namespace {

using features::CornerPatch;
using features::FrameFeatures;
using features::Line3;
using features::LineFeature;
using features::PointFeature;

/// column(get) writes or reads one number of each thing; `get` returns a reference to it.
template <typename T, typename Io, typename Things>
auto column(Io& io, Things& things) {
  return [&io, &things](const auto& get) {
    std::vector<T> values(things.size());
    if constexpr (!Io::kReads) {
      for (std::size_t i = 0; i < values.size(); ++i) values[i] = get(things[i]);
    }
    io.planes(values.data(), values.size());
    if constexpr (Io::kReads) {
      for (std::size_t i = 0; i < values.size(); ++i) get(things[i]) = values[i];
    }
  };
}

/// Columns of one kind compress better than records.
template <typename Io>
void point_columns(Io& io, std::vector<PointFeature>& points) {
  io.column_size(points, 6 * sizeof(float));
  const auto put = column<float>(io, points);
  put([](auto& p) -> auto& { return p.pixel.x(); });
  put([](auto& p) -> auto& { return p.pixel.y(); });
  put([](auto& p) -> auto& { return p.depth; });
  put([](auto& p) -> auto& { return p.angle; });
  put([](auto& p) -> auto& { return p.response; });
  column<std::int32_t>(io, points)([](auto& p) -> auto& { return p.octave; });
}

/// Ends in double precision, noise in single.
template <typename Io>
void line3_columns(Io& io, std::vector<Line3>& lines) {
  const auto exact = column<double>(io, lines);
  for (int i = 0; i < 3; ++i) {
    exact([i](auto& l) -> auto& { return l.start(i); });
    exact([i](auto& l) -> auto& { return l.end(i); });
  }
  const auto put = column<float>(io, lines);
  put([](auto& l) -> auto& { return l.inlier_share; });
  put([](auto& l) -> auto& { return l.coverage; });
  put([](auto& l) -> auto& { return l.start_noise.depth; });
  put([](auto& l) -> auto& { return l.start_noise.across; });
  put([](auto& l) -> auto& { return l.end_noise.depth; });
  put([](auto& l) -> auto& { return l.end_noise.across; });
}

template <typename Io>
void line_columns(Io& io, std::vector<LineFeature>& lines) {
  // Image segments
  io.column_size(lines, 5 * sizeof(float));
  const auto put = column<float>(io, lines);
  put([](auto& l) -> auto& { return l.segment.start.x(); });
  put([](auto& l) -> auto& { return l.segment.start.y(); });
  put([](auto& l) -> auto& { return l.segment.end.x(); });
  put([](auto& l) -> auto& { return l.segment.end.y(); });
  put([](auto& l) -> auto& { return l.segment.response; });
  for (LineFeature& l : lines) io(l.descriptor);

  // Only some lines have a 3D segment
  std::vector<Line3> in_space;
  for (LineFeature& l : lines) {
    bool there = l.line3.has_value();
    io(there);
    if constexpr (Io::kReads) {
      if (there) l.line3.emplace();
    }
    if (there) in_space.push_back(*l.line3);
  }

  // Segments as columns, then back to their lines
  line3_columns(io, in_space);
  if constexpr (Io::kReads) {
    auto next = in_space.begin();
    for (LineFeature& l : lines) {
      if (l.line3.has_value()) *l.line3 = *next++;
    }
  }
}

/// Single-precision image, stored as byte planes.
template <typename Io>
void thumbnail(Io& io, cv::Mat& image) {
  // Only single precision is stored
  if (!image.empty() && image.type() != CV_32FC1)
    throw std::invalid_argument("store: thumbnail is no CV_32FC1");

  // The size is checked before memory is allocated
  std::int32_t rows = image.rows;
  std::int32_t columns = image.cols;
  io(rows, columns);
  io.check(rows >= 0 && columns >= 0 && rows <= 1 << 14 && columns <= 1 << 14, "an image's size is wrong");
  const auto width = static_cast<std::size_t>(columns);

  // Rows may have padding in memory
  std::vector<float> values;
  if constexpr (!Io::kReads) {
    for (int y = 0; y < rows; ++y)
      values.insert(values.end(), image.ptr<float>(y), image.ptr<float>(y) + width);
    io.planes(values.data(), values.size());

  } else {
    const std::size_t size = static_cast<std::size_t>(rows) * width;
    io.need(size * sizeof(float));
    values.resize(size);
    io.planes(values.data(), values.size());
    if (!values.empty()) image = cv::Mat(rows, columns, CV_32FC1, values.data()).clone();
  }
}

/// Patches belong to the points; their middle is recomputed.
template <typename Io>
void patch_columns(Io& io, FrameFeatures& f) {
  io.column_size(f.patches, 2 * sizeof(float) + CornerPatch::kPixels);
  io.check(f.patches.empty() || f.patches.size() == f.points.size(), "patches and points differ");
  const auto put = column<float>(io, f.patches);
  put([](auto& p) -> auto& { return p.offset.x(); });
  put([](auto& p) -> auto& { return p.offset.y(); });
  for (std::size_t i = 0; i < f.patches.size(); ++i) {
    io(f.patches[i].gray);
    if constexpr (Io::kReads) f.patches[i].middle = f.points[i].pixel - f.patches[i].offset;
  }
}

/// All that a keyframe keeps of its image.
template <typename Io>
void feature_columns(Io& io, FrameFeatures& f) {
  point_columns(io, f.points);
  io(f.descriptors);
  line_columns(io, f.lines);
  io(f.shutter_motion);
  thumbnail(io, f.thumbnail);
  thumbnail(io, f.thumbnail_depth);
}

/// `f`: null, or the features, which may be changed when they are read.
template <typename Io>
void keyframe_fields(Io& io, Keyframe& k, std::shared_ptr<FrameFeatures>& f) {
  io(k.id, k.frame_index, k.stamp, k.turn_rate, k.reference, k.camera_from_reference, k.reference_sigma_m);
  bool there = f != nullptr;
  io(there);
  if constexpr (Io::kReads) {
    if (there) f = std::make_shared<FrameFeatures>();
  }
  if (there) feature_columns(io, *f);
  io.column_size(k.surface, 7 * sizeof(float));
  const auto put = column<float>(io, k.surface);
  for (int i = 0; i < 3; ++i) put([i](auto& s) -> auto& { return s.point(i); });
  for (int i = 0; i < 3; ++i) put([i](auto& s) -> auto& { return s.normal(i); });
  put([](auto& s) -> auto& { return s.sigma; });
  if (there) patch_columns(io, *f);
}

/// Differences of rounded numbers of either sign, small ones as small numbers.
template <typename Io, typename Get>
void rounded_column(Io& io, std::vector<SurfaceSample>& samples, double step, double most, const Get& get) {
  // Each number is a difference to its predecessor
  std::vector<std::uint32_t> codes(samples.size());
  std::uint32_t before = 0;
  if constexpr (!Io::kReads) {
    for (std::size_t i = 0; i < codes.size(); ++i) {
      const double value = static_cast<double>(get(samples[i]));
      if (!std::isfinite(value))
        throw std::invalid_argument("store: a surface has coordinates that are not finite");
      const auto now = static_cast<std::uint32_t>(std::lround(std::clamp(value, -most, most) / step));
      const std::uint32_t difference = now - before;

      // Zigzag code: the sign in the lowest bit
      codes[i] = difference << 1U ^ (0U - (difference >> 31U));
      before = now;
    }
  }

  io.planes(codes.data(), codes.size());

  // Sums restore the rounded values
  if constexpr (Io::kReads) {
    for (std::size_t i = 0; i < codes.size(); ++i) {
      before += (codes[i] >> 1U) ^ (0U - (codes[i] & 1U));
      get(samples[i]) = static_cast<float>(static_cast<double>(static_cast<std::int32_t>(before)) * step);
    }
  }
}

template <typename Io>
void fields(Io& io, StoredSurface& surface) {
  // Rounding steps below the noise of depth cameras
  constexpr double kPoint_m = 2e-4;
  constexpr double kNormal = 1.0 / 250.0;
  constexpr double kSigma_m = 5e-6;
  constexpr double kMost_m = 1000.0;

  // Positions, normals and noise as columns
  std::vector<SurfaceSample>& samples = surface.samples;
  io(surface.voxel_m);
  io.column_size(samples, 7 * sizeof(std::uint32_t));
  for (int k = 0; k < 3; ++k) {
    rounded_column(
        io, samples, kPoint_m, kMost_m, [k](auto& s) -> auto& { return s.point(k); });
  }

  for (int k = 0; k < 3; ++k) {
    rounded_column(
        io, samples, kNormal, 1.0, [k](auto& s) -> auto& { return s.normal(k); });
  }

  rounded_column(
      io, samples, kSigma_m, 1.0, [](auto& s) -> auto& { return s.sigma; });

  // Rounded normals lose their unit length
  if constexpr (Io::kReads) {
    for (SurfaceSample& sample : samples) sample.normal.normalize();
  }
}

}  // namespace

void encode(const Keyframe& keyframe, ByteWriter& to) {
  auto features = std::const_pointer_cast<FrameFeatures>(keyframe.features);  // a writer changes nothing
  keyframe_fields(to, const_cast<Keyframe&>(keyframe), features);
}

/// A keyframe; its grid is rebuilt from the points.
std::shared_ptr<const Keyframe> decode_keyframe(const Bytes& bytes, const sensor::Pinhole& camera) {
  ByteReader from(bytes);
  auto keyframe = std::make_shared<Keyframe>();
  std::shared_ptr<FrameFeatures> features;
  keyframe_fields(from, *keyframe, features);
  from.expect_end();
  if (features != nullptr) {
    features->grid = features::PointGrid(features->points, camera.width, camera.height);
  }
  keyframe->features = std::move(features);
  return keyframe;
}

void encode(const StoredSurface& surface, ByteWriter& to) { fields(to, const_cast<StoredSurface&>(surface)); }

StoredSurface decode_surface(const Bytes& bytes) {
  ByteReader from(bytes);
  StoredSurface surface;
  fields(from, surface);
  from.expect_end();
  return surface;
}

}  // namespace plumbline::maps
