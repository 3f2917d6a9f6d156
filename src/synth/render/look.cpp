// SPDX-License-Identifier: BSD-3-Clause
// Visibility: the face behind every pixel.
#include <algorithm>
#include <cmath>

#include "render/ray_batch.hpp"
#include "render/render.hpp"

namespace plumbline::synth {

using Eigen::Vector3d;

TexelScale texel_scale(const World& world, std::size_t face) {
  const Face& f = world.scene.faces[face];
  const cv::Size& top = world.texture_sizes[static_cast<std::size_t>(world.texture_of[face])];
  const double tile = world.tile_m[face];

  // Tiled, unless stretched over the face.
  const bool tiled =
      f.stretch_u <= 0.0 || (world.options.texture == Texture::kNone && world.materials[face]->large);
  return {top.width / (tiled ? tile : f.stretch_u), top.height / (tiled ? tile : f.stretch_v)};
}

namespace {

constexpr int kTile = 8;  // pixels

FaceView view_face(const World& world, std::size_t index, const sensor::Pinhole& k,
                   const geometry::Rigid3& camera_from_world) {
  const Face& face = world.scene.faces[index];
  const Vector3d n = camera_from_world.rotation * face.normal, origin = camera_from_world * face.origin;
  const Vector3d ua = camera_from_world.rotation * face.u_axis, va = camera_from_world.rotation * face.v_axis;

  // d = M p is the ray of pixel p with z = 1.
  const auto through_pixels = [&k](const Vector3d& w) {
    return Vector3d(w.x() / k.fx, w.y() / k.fy, w.z() - w.x() * k.cx / k.fx - w.y() * k.cy / k.fy);
  };

  // Inverse depth and texture coordinates are linear forms.
  const double h = n.dot(origin);
  const Vector3d c = through_pixels(n) / (std::abs(h) > 1e-9 ? h : 1e-9);
  const TexelScale scale = texel_scale(world, index);
  const double shift_u = static_cast<double>(world.offset_u[index]) - ua.dot(origin);
  const double shift_v = static_cast<double>(world.offset_v[index]) - va.dot(origin);
  const Vector3d a = scale.u * (through_pixels(ua) + shift_u * c),
                 b = -scale.v * (through_pixels(va) + shift_v * c);

  FaceView out;
  for (int i = 0; i < 3; ++i) {
    out.a[i] = static_cast<float>(a[i]);
    out.b[i] = static_cast<float>(b[i]);
    out.c[i] = static_cast<float>(c[i]);
  }

  return out;
}

/// Marks the tiles that edges of faces cross, with the largest inverse depth of these. Between edges one face
/// covers a whole tile, unless faces intersect; the tile's corners show that.
class EdgeTiles {
 public:
  EdgeTiles(const sensor::Pinhole& camera, const geometry::Rigid3& camera_from_world)
      : camera_(camera),
        camera_from_world_(camera_from_world),
        columns_((camera.width + kTile - 1) / kTile),
        rows_((camera.height + kTile - 1) / kTile),
        nearest_(static_cast<std::size_t>(columns_ * rows_), 0.0F) {}

  void add(const Face& face) {
    corners_.clear();
    for (const Eigen::Vector2d& uv : face.polygon)
      corners_.push_back(camera_from_world_ * face.at(uv.x(), uv.y()));
    for (std::size_t i = 0; i < corners_.size(); ++i) add(corners_[i], corners_[(i + 1) % corners_.size()]);
  }
  [[nodiscard]] float nearest(int column, int row) const {
    return nearest_[static_cast<std::size_t>(row * columns_ + column)];
  }
  [[nodiscard]] int columns() const { return columns_; }
  [[nodiscard]] int rows() const { return rows_; }

 private:
  struct Spot {
    double x, y, inverse_depth;
  };
  [[nodiscard]] Spot project(const Vector3d& p) const {
    const double w = 1.0 / p.z();
    return {camera_.fx * p.x() * w + camera_.cx, camera_.fy * p.y() * w + camera_.cy, w};
  }

  void add(Vector3d a, Vector3d b) {
    constexpr double kNear = 0.02;
    if (a.z() < kNear && b.z() < kNear) return;

    // Clipped at the near plane.
    if (a.z() < kNear) a += (kNear - a.z()) / (b.z() - a.z()) * (b - a);
    if (b.z() < kNear) b += (kNear - b.z()) / (a.z() - b.z()) * (a - b);
    Spot from = project(a), to = project(b);
    if (std::abs(to.x - from.x) >= std::abs(to.y - from.y)) {
      if (from.x > to.x) std::swap(from, to);
      march(from, to, {columns_, rows_, 1, columns_});
    } else {
      if (from.y > to.y) std::swap(from, to);
      march({from.y, from.x, from.inverse_depth}, {to.y, to.x, to.inverse_depth},
            {rows_, columns_, columns_, 1});
    }
  }

  /// Tiles along an edge's longer axis and across it, and how far apart neighbours are stored.
  struct Axes {
    int along, across, stride_along, stride_across;
  };

  /// Walks tile by tile along the edge's longer axis, which is x of both spots; y and the inverse depth
  /// change linearly over the picture.
  void march(const Spot& start, const Spot& stop, const Axes& axes) {
    constexpr double kMargin = 1.0;  // px
    const double length = std::max(stop.x - start.x, 1e-9), slope = (stop.y - start.y) / length,
                 rate = (stop.inverse_depth - start.inverse_depth) / length;
    const double begin = std::max(start.x - kMargin, 0.0),
                 end = std::min(stop.x + kMargin, axes.along * kTile - 1e-6);

    for (int i = static_cast<int>(begin / kTile); i < axes.along && i * kTile <= end; ++i) {
      // The edge's part in this column of tiles.
      const double from = std::max(begin, static_cast<double>(i * kTile)) - start.x - kMargin,
                   to = std::min(end, static_cast<double>((i + 1) * kTile)) - start.x + kMargin;
      const double ta = start.y + from * slope, tb = start.y + to * slope;
      const double low = std::min(ta, tb) - kMargin, high = std::max(ta, tb) + kMargin;
      if (high < 0.0 || low >= axes.across * kTile) continue;

      // The nearest edge of each tile.
      const int first = static_cast<int>(std::max(low, 0.0) / kTile),
                last = std::min(static_cast<int>(high / kTile), axes.across - 1);
      const auto w =
          static_cast<float>(std::max(start.inverse_depth + from * rate, start.inverse_depth + to * rate));
      for (int j = first; j <= last; ++j) {
        float& nearest = nearest_[static_cast<std::size_t>(i * axes.stride_along + j * axes.stride_across)];
        nearest = std::max(nearest, w);
      }
    }
  }

  const sensor::Pinhole& camera_;
  const geometry::Rigid3& camera_from_world_;
  int columns_, rows_;
  std::vector<float> nearest_;
  std::vector<Vector3d> corners_;
};

/// Faces seen at the corners of all tiles, row by row; one more than tiles in both directions.
cv::Mat1i look_at_corners(RayBatch& rays, int columns, int rows) {
  cv::Mat1i corners(rows + 1, columns + 1);
  constexpr int kBlock = 4;  // neighbouring rays take similar paths through the tree
  for (int top = 0; top <= rows; top += kBlock) {
    for (int left = 0; left <= columns; left += kBlock) {
      for (int j = top; j < std::min(top + kBlock, rows + 1); ++j) {
        for (int i = left; i < std::min(left + kBlock, columns + 1); ++i)
          rays.add(static_cast<float>(i * kTile), static_cast<float>(j * kTile), &corners(j, i));
      }
    }
  }
  rays.flush();
  return corners;
}

/// The face that covers a whole tile; -2 when that is not sure.
int whole_tile(const View& view, const EdgeTiles& edges, const cv::Mat1i& corners, int column, int row) {
  const int id = corners(row, column);
  if (id != corners(row, column + 1) || id != corners(row + 1, column) ||
      id != corners(row + 1, column + 1)) {
    return -2;
  }
  if (id < 0) return edges.nearest(column, row) > 0.0F ? -2 : id;
  const FaceView& f = view.faces[static_cast<std::size_t>(id)];
  float farthest = 1e9F;
  for (const int y : {row * kTile, (row + 1) * kTile}) {
    for (const int x : {column * kTile, (column + 1) * kTile})
      farthest = std::min(farthest, f.c[0] * static_cast<float>(x) + f.c[1] * static_cast<float>(y) + f.c[2]);
  }
  return edges.nearest(column, row) > 0.998F * farthest ? -2 : id;
}

void fill_between(const World& world, View& view) {
  cv::Mat1i& ids = view.ids;
  const int w = ids.cols, h = ids.rows;
  RayBatch rays(world, view);

  for (int y = 0; y < h; ++y) {
    int* row = ids[y];
    const bool cast_row = y % 2 == 0;
    const int* up = ids[y - y % 2];
    const int* low = cast_row || y + 1 >= h ? up : ids[y + 1];

    // Four equal neighbours decide, else a ray.
    for (int x = cast_row ? 1 : 0; x < w; x += cast_row ? 2 : 1) {
      const int x0 = x - x % 2, x1 = x % 2 == 0 || x + 1 >= w ? x0 : x + 1;
      const int id = up[x0];
      if (id == up[x1] && id == low[x0] && id == low[x1]) {
        row[x] = id;
      } else {
        rays.add(static_cast<float>(x), static_cast<float>(y), &row[x]);
      }
    }
  }

  rays.flush();
}

}  // namespace

View look(const World& world, const sensor::Pinhole& camera, const geometry::Rigid3& world_from_camera,
          std::optional<double> time) {
  View view;
  view.time = time;
  view.camera = camera;
  view.world_from_camera = world_from_camera;
  const geometry::Rigid3 camera_from_world = world_from_camera.inverse();

  EdgeTiles edges(camera, camera_from_world);
  view.faces.reserve(world.scene.faces.size());

  // Fixed faces, with their edges by tile.
  for (std::size_t i = 0; i < world.fixed_faces; ++i) {
    view.faces.push_back(view_face(world, i, camera, camera_from_world));
    edges.add(world.scene.faces[i]);
  }

  // Moving faces, in the frame of their rest.
  for (const World::Mover& mover : world.movers) {
    const geometry::Rigid3 motion = world.motion(mover, time.value_or(0.0));
    geometry::Rigid3 camera_from_rest = camera_from_world;
    camera_from_rest.rotation = camera_from_world.rotation * motion.rotation;
    camera_from_rest.translation += camera_from_world.rotation * motion.translation;

    for (std::size_t i = mover.first; i < mover.first + mover.count; ++i) {
      view.faces.push_back(view_face(world, i, camera, camera_from_rest));
    }
  }

  // Rays at the corners of tiles.
  view.ids.create(camera.height, camera.width);
  RayBatch rays(world, view);
  const cv::Mat1i corners = look_at_corners(rays, edges.columns(), edges.rows());

  // Tiles that one face fills need no further rays.
  for (int row = 0; row < edges.rows(); ++row) {
    for (int column = 0; column < edges.columns(); ++column) {
      const cv::Rect tile =
          cv::Rect(column * kTile, row * kTile, kTile, kTile) & cv::Rect({0, 0}, view.ids.size());
      const int id = whole_tile(view, edges, corners, column, row);

      for (int y = tile.y; y < tile.y + tile.height; y += 2) {
        for (int x = tile.x; x < tile.x + tile.width; x += 2) {
          if (id == -2) {
            rays.add(static_cast<float>(x), static_cast<float>(y), &view.ids(y, x));
          } else {
            view.ids(y, x) = id;
          }
        }
      }
    }
  }

  // Pixels in between, then moving faces.
  rays.flush();
  fill_between(world, view);
  if (time) MovingFaces(world, view, *time).draw(view);
  return view;
}

cv::Mat1f exact_depth(const View& view) {
  cv::Mat1f depth(view.ids.size());
  for (int y = 0; y < depth.rows; ++y) {
    const int* ids = view.ids[y];
    float* row = depth[y];
    for (int x = 0; x < depth.cols; ++x) {
      if (ids[x] < 0) {
        row[x] = 0.0F;
        continue;
      }

      // Inverse depth is linear in the image.
      const FaceView& f = view.faces[static_cast<std::size_t>(ids[x])];
      row[x] = 1.0F / (f.c[0] * static_cast<float>(x) + f.c[1] * static_cast<float>(y) + f.c[2]);
    }
  }
  return depth;
}

}  // namespace plumbline::synth
