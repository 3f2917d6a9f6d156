// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/viz/snapshot.hpp"

#include <fmt/format.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <vtkContext2D.h>
#include <vtkContextActor.h>
#include <vtkContextItem.h>
#include <vtkContextScene.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkRenderer.h>
#include <vtkTransform2D.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <utility>
#include <vector>

#include "canvas/offscreen.hpp"
#include "canvas/png_writer.hpp"
#include "plumbline/core/numbers.hpp"
#include "scene/overlay.hpp"
#include "scene/point_style.hpp"
#include "scene/raster.hpp"
#include "scene/view_frame.hpp"

namespace plumbline::viz {
namespace {

constexpr int kSupersampling = 2;  // drawn twice as large and scaled down: smooth points, lines and text
constexpr Rgb kBackground{250, 250, 248};
constexpr std::size_t kFramingSample = 100000;
constexpr double kLargest = 30.0 * kSupersampling;  // diameter of a point

// A picture is drawn in bands, since the buffers of a whole one at twice its size take hundreds of megabytes.
// They overlap, so that no wide line is cut at their borders.
constexpr int kBand_px = 128;
constexpr int kMargin = 32;  // large pixels

/// Rows of the large picture that are drawn at a time, from the bottom.
struct Band {
  int first = 0;
  int height = 0;
};

/// Drawing over the points, in a band.
class Overlay : public vtkContextItem {
 public:
  static Overlay* New();
  vtkTypeMacro(Overlay, vtkContextItem);
  bool Paint(vtkContext2D* context) override {
    // The canvas is one band of the picture.
    vtkNew<vtkTransform2D> to_band;
    to_band->Translate(0.0, -band->first);
    context->PushMatrix();
    context->AppendTransform(to_band);
    Painter painter(context, kSupersampling * content->options->height_px / 1200.0);
    draw_paths(painter, *content);
    draw_annotations(painter, *content);
    context->PopMatrix();
    return true;
  }

  const OverlayContent* content = nullptr;
  const Band* band = nullptr;
};
vtkStandardNewMacro(Overlay);

core::Result<void> check(const Scene& scene, const SnapshotOptions& options) {
  if (options.width_px < 64 || options.height_px < 64 || options.width_px > 8192 ||
      options.height_px > 8192) {
    return core::usage_error(fmt::format("picture size {}x{}: each side must be 64 to 8192 pixels",
                                         options.width_px, options.height_px));
  }

  // Every point needs a value.
  const bool by_scalar = options.color == ColorMode::kRobot || options.color == ColorMode::kError ||
                         options.color == ColorMode::kConfidence;
  const std::size_t points = scene.cloud == nullptr ? 0 : scene.cloud->size();
  if (by_scalar && scene.scalars.size() != points) {
    return core::usage_error(
        fmt::format("color {}: the map holds {} such values for {} points; use rgb, height or normal",
                    color_mode_name(options.color), scene.scalars.size(), points));
  }

  if (options.scalar_range && !(options.scalar_range->first < options.scalar_range->second)) {
    return core::usage_error("colour range: the lower end must be below the upper end");
  }

  // The viewpoint must define a direction.
  if (options.view == View::kExplicit) {
    const Eigen::Vector3d forward = options.viewpoint.target - options.viewpoint.eye;
    const double angle = options.viewpoint.field_of_view_deg;

    // Up along the line of sight leaves the roll open.
    if (!forward.allFinite() || !options.viewpoint.up.allFinite() ||
        !(forward.cross(options.viewpoint.up).norm() > 1e-9) || !(angle > 1.0 && angle < 170.0)) {
      return core::usage_error(
          "viewpoint: eye and target must differ, up must not lie along the line of sight, and the field of "
          "view must be between 1 and 170 degrees");
    }
  }

  return {};
}

std::vector<Eigen::Vector3d> positions(const Scene& scene, const std::vector<std::uint32_t>& points) {
  std::vector<Eigen::Vector3d> result;
  result.reserve(points.size());
  for (const auto i : points) result.emplace_back((*scene.cloud)[i].getVector3fMap().cast<double>());
  return result;
}

/// Camera positions and, when there are no points, line landmarks.
std::vector<Eigen::Vector3d> must_see(const Scene& scene, bool with_segments) {
  std::vector<Eigen::Vector3d> result;
  for (const CameraPath& path : scene.paths) {
    for (const auto& pose : path.trajectory) {
      if (pose.world_from_camera.translation.allFinite())
        result.push_back(pose.world_from_camera.translation);
    }
  }
  if (!with_segments) return result;
  for (const Segment& segment : scene.segments) {
    if (!segment.a.allFinite() || !segment.b.allFinite()) continue;
    result.push_back(segment.a);
    result.push_back(segment.b);
  }
  return result;
}

/// Width in pixels that a colour bar with its labels takes at the right of the picture; 0: it has none.
double width_of_scale(const SnapshotOptions& options) {
  constexpr double kWidth_px = 160.0;  // in a picture of this height
  constexpr double kHeight_px = 1200.0;
  constexpr double kMostOfWidth = 0.3;
  const bool shown = options.annotations && options.color != ColorMode::kRgb &&
                     options.color != ColorMode::kNormal && options.color != ColorMode::kRobot;
  return shown ? std::min(kWidth_px * options.height_px / kHeight_px, kMostOfWidth * options.width_px) : 0.0;
}

Projection choose_projection(const Scene& scene, const SnapshotOptions& options, const SceneAxes& axes) {
  Projection directions = view_directions(options, axes);
  const bool fixed = options.view == View::kExplicit;
  Projection for_culling = directions;
  for_culling.orthographic = !fixed;  // the eye is not known yet
  const std::size_t size = scene.cloud == nullptr ? 0 : scene.cloud->size();
  const std::size_t step = std::max<std::size_t>(1, size / kFramingSample);
  const auto sample = positions(scene, visible_points(scene, for_culling, options.cull_back_faces, step));

  // Named views fit the scene into the picture.
  if (!fixed) {
    fit(directions, evened(sample), must_see(scene, sample.empty()), width_of_scale(options));
    return directions;
  }

  // A far plane behind nearly everything.
  std::vector<double> depths;
  depths.reserve(sample.size());
  for (const auto& p : sample) depths.push_back((p - directions.eye).dot(directions.forward));
  directions.near_m = 0.05;
  directions.far_m = std::max(1.0, 1.5 * core::quantile(depths, 0.99, 0.0));
  return directions;
}

/// Size of each point in whole pixels; 0: it is behind the viewer.
std::vector<int> point_sizes(const Scene& scene, const std::vector<std::uint32_t>& points,
                             const SnapshotOptions& options, const Projection& projection, double spacing_m) {
  constexpr double kOverlap = 1.7;  // neighbours at a slant, and voxels that are not quite full
  constexpr double kSmallest = 2.0 * kSupersampling;
  constexpr double kLonely = 6.0 * kSupersampling;  // a single point
  std::vector<int> sizes;
  sizes.reserve(points.size());

  for (const std::uint32_t k : points) {
    double size = options.point_size_px * kSupersampling;

    // Without a size, points must close surfaces.
    if (size <= 0.0) {
      const Eigen::Vector3d p = scene.cloud->at(k).getVector3fMap().cast<double>();
      const double depth = (p - projection.eye).dot(projection.forward);
      const double wanted = kOverlap * spacing_m * projection.pixels_per_metre(depth);
      size = depth < projection.near_m ? 0.0
             : spacing_m > 0.0         ? std::clamp(wanted, kSmallest, kLargest)
                                       : kLonely;
    }

    sizes.push_back(size > 0.0 ? std::max(1, static_cast<int>(std::lround(size))) : 0);
  }

  return sizes;
}

/// Objects that one picture is made of.
struct Drawn {
  std::vector<std::uint32_t> points;
  PointColors styled;
  std::vector<int> sizes;               ///< of the points, large pixels
  std::vector<Eigen::Vector3d> places;  ///< of the points, as projected
  double spacing_m = 0.0;
  OverlayContent content;
};

Drawn choose_what_to_draw(const Scene& scene, const SnapshotOptions& options) {
  // Drawn larger and scaled down, against aliasing.
  SnapshotOptions large = options;
  large.width_px *= kSupersampling;
  large.height_px *= kSupersampling;

  // View and projection come before the points.
  const SceneAxes axes = scene_axes(scene, large);
  Drawn drawn;
  drawn.content.scene = &scene;
  drawn.content.options = &options;
  drawn.content.projection = choose_projection(scene, large, axes);

  // Only points that can be visible.
  const Projection& projection = drawn.content.projection;
  const auto facing = visible_points(scene, projection, options.cull_back_faces);
  drawn.spacing_m = point_spacing(scene, facing);
  drawn.points = nearest_per_cell(scene, facing, projection, kSupersampling);
  drawn.styled = color_points(scene, drawn.points, options, axes, projection);
  drawn.sizes = point_sizes(scene, drawn.points, options, projection, drawn.spacing_m);

  // Positions in pixels.
  for (const Eigen::Vector3d& p : positions(scene, drawn.points))
    drawn.places.push_back(projection.project(p));
  drawn.content.color_scale = drawn.styled.scale;
  drawn.content.empty = facing.empty() && scene.segments.empty();
  return drawn;
}

/// Line landmarks lie on surfaces: drawn a little nearer to the viewer, so that the points do not hide them.
void draw_segments(const Scene& scene, const Drawn& drawn, Raster& raster) {
  const Projection& projection = drawn.content.projection;
  const auto depth_of = [&](const Eigen::Vector3d& p) {
    return (p - projection.eye).dot(projection.forward);
  };
  for (const Segment& segment : scene.segments) {
    if (!segment.a.allFinite() || !segment.b.allFinite()) continue;
    const auto lifted = [&](const Eigen::Vector3d& end) -> Eigen::Vector3d {
      return end + (0.02 + 1.5 * drawn.spacing_m) * projection.to_viewer(end);
    };
    Eigen::Vector3d near = lifted(segment.a), far = lifted(segment.b);
    if (depth_of(near) > depth_of(far)) std::swap(near, far);
    if (depth_of(far) <= projection.near_m) continue;
    const double before = projection.near_m - depth_of(near);
    if (before > 0.0) near += before / (depth_of(far) - depth_of(near)) * (far - near);
    raster.draw_line(projection.project(near), projection.project(far), 2.5 * kSupersampling,
                     !projection.orthographic, scene.segment_color);
  }
}

void draw_band(const Scene& scene, const Drawn& drawn, Raster& raster) {
  for (std::size_t k = 0; k < drawn.points.size(); ++k) {
    if (drawn.sizes[k] > 0) raster.draw_point(drawn.places[k], drawn.sizes[k], drawn.styled.colors[k]);
  }
  draw_segments(scene, drawn, raster);
}

/// Pictures of the same size, `over` with colours that are multiplied by their opacity.
cv::Mat3b composited(const cv::Mat4b& below, const cv::Mat4b& over) {
  cv::Mat3b result(below.size());
  for (int y = 0; y < result.rows; ++y) {
    const cv::Vec4b *under = below[y], *top = over[y];
    cv::Vec3b* to = result[y];
    for (int x = 0; x < result.cols; ++x) {
      if (top[x] == cv::Vec4b(0, 0, 0, 0)) {
        to[x] = {under[x][0], under[x][1], under[x][2]};
        continue;
      }
      const int through = 255 - top[x][3];
      for (int c = 0; c < 3; ++c)
        to[x][c] = static_cast<std::uint8_t>(std::min(255, top[x][c] + (under[x][c] * through + 127) / 255));
    }
  }
  return result;
}

/// Draws picture after picture, in the same window as long as they are of the same size: VTK's shaders are
/// compiled once. This thread draws what VTK draws; points are drawn beside it, a few bands at a time.
class Renderer {
 public:
  explicit Renderer(const core::Executor& executor) : executor_(executor) {}

  core::Result<void> open(const SnapshotOptions& options) {
    const cv::Size size{kSupersampling * options.width_px, band_height(options)};

    // An open window of that size is used again.
    if (window_ != nullptr && size == size_) return {};
    window_.reset();
    rasters_.clear();
    auto window = OffscreenWindow::open(size.width, size.height);
    if (!window) return tl::unexpected(window.error());
    window_ = std::move(*window);
    size_ = size;
    for (std::size_t i = 0; i < kAtATime; ++i) rasters_.emplace_back(size.width, size.height);
    return {};
  }

  /// In the window that is open.
  cv::Mat3b draw(const Scene& scene, const SnapshotOptions& options, const Drawn& drawn) {
    // The overlay has transparent ground.
    Band band;
    band.height = size_.height;
    vtkNew<vtkRenderer> renderer;
    renderer->SetBackground(0.0, 0.0, 0.0);
    renderer->SetBackgroundAlpha(0.0);
    window_->window()->AddRenderer(renderer);

    // Lines and text by VTK's two-dimensional painter.
    vtkNew<Overlay> overlay;
    overlay->content = &drawn.content;
    overlay->band = &band;
    vtkNew<vtkContextActor> actor;
    actor->GetScene()->AddItem(overlay);
    renderer->AddActor(actor);

    cv::Mat3b picture(options.height_px, options.width_px);
    std::array<core::Executor::Job, kAtATime> jobs;

    // Points are drawn while VTK draws the next band.
    for (int first_px = 0, k = 0; first_px < picture.rows; first_px += kBand_px, ++k) {
      band.first = kSupersampling * first_px - kMargin;
      const std::size_t place = static_cast<std::size_t>(k) % kAtATime;

      // The raster must be free.
      jobs[place].wait();
      jobs[place] = executor_.submit(
          [&, first_px, first = band.first, &raster = rasters_[place], over = window_->draw()] {
            raster.clear(first, kBackground);
            draw_band(scene, drawn, raster);

            // The band without its margins.
            cv::Mat3b part = picture.rowRange(first_px, std::min(first_px + kBand_px, picture.rows));
            const cv::Range rows(kMargin, kMargin + kSupersampling * part.rows);
            cv::resize(composited(raster.picture().rowRange(rows), over.rowRange(rows)), part, part.size(),
                       0.0, 0.0, cv::INTER_AREA);
          });
    }

    // Jobs write into the image.
    for (core::Executor::Job& job : jobs) job.wait();
    window_->window()->RemoveRenderer(renderer);
    return picture;
  }

 private:
  static constexpr std::size_t kAtATime = 2;  // bands, each of about 12 MB

  static int band_height(const SnapshotOptions& options) {
    return kSupersampling * std::min(kBand_px, options.height_px) + 2 * kMargin;
  }

  const core::Executor& executor_;
  std::unique_ptr<OffscreenWindow> window_;
  cv::Size size_;
  std::vector<Raster> rasters_;
};

}  // namespace

/// Only this thread calls VTK; others select data, draw points and write pictures.
core::Result<void> render_snapshots(const Scene& scene, const std::vector<Snapshot>& snapshots,
                                    const core::Executor& executor) {
  // Mistakes are reported before anything is drawn.
  for (const Snapshot& snapshot : snapshots) {
    if (auto checked = check(scene, snapshot.options); !checked) return checked;
  }

  std::vector<Drawn> drawn(snapshots.size());
  std::vector<core::Result<void>> written(snapshots.size());
  std::vector<core::Executor::Job> choosing, writing;

  // Selection for the next one runs during drawing.
  const auto choose_next = [&] {
    const std::size_t i = choosing.size();
    if (i == snapshots.size()) return;
    choosing.push_back(
        executor.submit([&, i] { drawn[i] = choose_what_to_draw(scene, snapshots[i].options); }));
  };

  Renderer renderer(executor);
  choose_next();

  // One selection ahead, to limit memory.
  for (std::size_t i = 0; i < snapshots.size(); ++i) {
    if (auto opened = renderer.open(snapshots[i].options); !opened) return opened;
    choosing[i].wait();
    choose_next();
    const cv::Mat3b picture = renderer.draw(scene, snapshots[i].options, drawn[i]);
    drawn[i] = {};
    writing.push_back(
        executor.submit([&, i, picture] { written[i] = write_png(picture, snapshots[i].file); }));
  }

  // The first failure, in the order of requests.
  for (std::size_t i = 0; i < snapshots.size(); ++i) {
    writing[i].wait();
    if (!written[i]) return written[i];
  }

  return {};
}

}  // namespace plumbline::viz
