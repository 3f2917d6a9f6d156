// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/viz/snapshot.hpp"

#include <fmt/format.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <vtkActor.h>
#include <vtkCamera.h>
#include <vtkCellArray.h>
#include <vtkContext2D.h>
#include <vtkContextActor.h>
#include <vtkContextItem.h>
#include <vtkContextScene.h>
#include <vtkFloatArray.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkRenderer.h>
#include <vtkShaderProperty.h>
#include <vtkTransform2D.h>
#include <vtkUnsignedCharArray.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/imgproc.hpp>

#include "canvas/offscreen.hpp"
#include "plumbline/core/numbers.hpp"
#include "scene/overlay.hpp"
#include "scene/point_style.hpp"
#include "scene/view_frame.hpp"

namespace plumbline::viz {
namespace {

constexpr int kSupersampling = 2;  // drawn twice as large and scaled down: smooth points, lines and text
constexpr Rgb kBackground{250, 250, 248};
constexpr std::size_t kFramingSample = 100000;
constexpr double kLargest = 30.0 * kSupersampling;  // diameter of a point

// A picture is drawn in bands, since the buffers of a whole one at twice its size take hundreds of megabytes.
// Points are drawn or not by their centres: bands overlap, so that none is cut at their borders.
constexpr int kBand_px = 256;
constexpr int kMargin = 50;  // large pixels: half the largest point, chosen ones included
static_assert(kMargin >= kLargest / 2 && kMargin >= 50 * kSupersampling / 2);

/// Rows of the large picture that are drawn at a time, from the bottom.
struct Band {
  int first = 0;
  int height = 0;
};

/// What is drawn over the points, in a band.
class Overlay : public vtkContextItem {
 public:
  static Overlay* New();
  vtkTypeMacro(Overlay, vtkContextItem);
  bool Paint(vtkContext2D* context) override {
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
  if (options.view == View::kExplicit) {
    const Eigen::Vector3d forward = options.viewpoint.target - options.viewpoint.eye;
    const double angle = options.viewpoint.field_of_view_deg;
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

Projection choose_projection(const Scene& scene, const SnapshotOptions& options, const SceneAxes& axes) {
  Projection directions = view_directions(options, axes);
  const bool fixed = options.view == View::kExplicit;
  Projection for_culling = directions;
  for_culling.orthographic = !fixed;  // the eye is not known yet
  const std::size_t size = scene.cloud == nullptr ? 0 : scene.cloud->size();
  const std::size_t step = std::max<std::size_t>(1, size / kFramingSample);
  const auto sample = positions(scene, visible_points(scene, for_culling, options.cull_back_faces, step));
  if (!fixed) {
    fit(directions, evened(sample), must_see(scene, sample.empty()));
    return directions;
  }
  std::vector<double> depths;
  for (const auto& p : sample) depths.push_back((p - directions.eye).dot(directions.forward));
  directions.near_m = 0.05;
  directions.far_m = std::max(1.0, 1.5 * core::quantile(depths, 0.99, 0.0));
  return directions;
}

void place_camera(vtkRenderer& renderer, const Projection& projection, const Band& band) {
  vtkCamera* camera = renderer.GetActiveCamera();
  const Eigen::Vector3d target = projection.eye + projection.forward;
  camera->SetPosition(projection.eye.data());
  camera->SetFocalPoint(target.data());
  camera->SetViewUp(projection.up.data());
  camera->SetParallelProjection(projection.orthographic ? 1 : 0);
  if (projection.orthographic) {
    camera->SetParallelScale(0.5 * band.height / projection.focal_px);
  } else {
    camera->SetViewAngle(2.0 * std::atan(0.5 * band.height / projection.focal_px) * 180.0 / M_PI);
  }
  camera->SetClippingRange(projection.near_m, projection.far_m);
  // In half heights of the band, from the picture's middle to the band's.
  camera->SetWindowCenter(
      0.0, (band.first + 0.5 * band.height - 0.5 * projection.height_px) / (0.5 * band.height));
}

/// Draws band by band what `renderer` of `window` holds; `band` tells the overlay which one.
cv::Mat3b draw_bands(OffscreenWindow& window, vtkRenderer& renderer, const Projection& projection,
                     const SnapshotOptions& options, Band& band) {
  cv::Mat3b picture(options.height_px, options.width_px);
  for (int first_px = 0; first_px < picture.rows; first_px += kBand_px) {
    band.first = kSupersampling * first_px - kMargin;
    place_camera(renderer, projection, band);
    cv::Mat3b part = picture.rowRange(first_px, std::min(first_px + kBand_px, picture.rows));
    const cv::Mat3b large = window.draw().rowRange(kMargin, kMargin + kSupersampling * part.rows);
    cv::resize(large, part, part.size(), 0.0, 0.0, cv::INTER_AREA);
  }
  return picture;
}

/// Points of one size as an actor; `members` index `points` and `colors`.
vtkSmartPointer<vtkActor> point_actor(const Scene& scene, const std::vector<std::uint32_t>& points,
                                      const std::vector<Rgb>& colors,
                                      const std::vector<std::uint32_t>& members, float size_px) {
  const auto count = static_cast<vtkIdType>(members.size());
  vtkNew<vtkFloatArray> xyz;
  xyz->SetNumberOfComponents(3);
  xyz->SetNumberOfTuples(count);
  vtkNew<vtkUnsignedCharArray> rgb;
  rgb->SetNumberOfComponents(3);
  rgb->SetNumberOfTuples(count);
  float* to_xyz = xyz->GetPointer(0);
  unsigned char* to_rgb = rgb->GetPointer(0);
  for (const auto k : members) {
    const auto& p = (*scene.cloud)[points[k]];
    to_xyz = std::copy_n(p.data, 3, to_xyz);
    *to_rgb++ = colors[k].r;
    *to_rgb++ = colors[k].g;
    *to_rgb++ = colors[k].b;
  }
  vtkNew<vtkCellArray> vertices;  // one cell of all points
  vertices->InsertNextCell(static_cast<int>(count));
  for (vtkIdType i = 0; i < count; ++i) vertices->InsertCellPoint(i);
  vtkNew<vtkPoints> vtk_points;
  vtk_points->SetData(xyz);
  vtkNew<vtkPolyData> data;
  data->SetPoints(vtk_points);
  data->SetVerts(vertices);
  data->GetPointData()->SetScalars(rgb);
  vtkNew<vtkPolyDataMapper> mapper;
  mapper->SetInputData(data);
  auto actor = vtkSmartPointer<vtkActor>::New();
  actor->SetMapper(mapper);
  actor->GetProperty()->SetPointSize(size_px);
  actor->GetProperty()->LightingOff();
  // Discs instead of squares.
  actor->GetShaderProperty()->AddFragmentShaderReplacement(
      "//VTK::Color::Impl", true,
      "//VTK::Color::Impl\n"
      "  vec2 from_centre = 2.0 * gl_PointCoord - 1.0;\n"
      "  if (dot(from_centre, from_centre) > 1.0) discard;\n",
      false);
  return actor;
}

/// In perspective near points are larger than far ones: one actor per whole number of pixels.
void add_points(vtkRenderer& renderer, const Scene& scene, const std::vector<std::uint32_t>& points,
                const std::vector<Rgb>& colors, const SnapshotOptions& options, const Projection& projection,
                double spacing_m) {
  constexpr double kOverlap = 1.7;  // neighbours at a slant, and voxels that are not quite full
  constexpr double kSmallest = 2.0 * kSupersampling;
  constexpr double kLonely = 6.0 * kSupersampling;  // a single point
  std::map<int, std::vector<std::uint32_t>> by_size;
  for (std::uint32_t k = 0; k < points.size(); ++k) {
    double size = options.point_size_px * kSupersampling;
    if (size <= 0.0) {
      const Eigen::Vector3d p = scene.cloud->at(points[k]).getVector3fMap().cast<double>();
      const double depth = (p - projection.eye).dot(projection.forward);
      if (depth < projection.near_m) continue;
      const double wanted = kOverlap * spacing_m * projection.pixels_per_metre(depth);
      size = spacing_m > 0.0 ? std::clamp(wanted, kSmallest, kLargest) : kLonely;
    }
    by_size[std::max(1, static_cast<int>(std::lround(size)))].push_back(k);
  }
  for (const auto& [size, members] : by_size) {
    renderer.AddActor(point_actor(scene, points, colors, members, static_cast<float>(size)));
  }
}

/// Line landmarks lie on surfaces: drawn a little nearer to the viewer, so that the points do not hide them.
void add_segments(vtkRenderer& renderer, const Scene& scene, const Projection& projection, double spacing_m) {
  vtkNew<vtkPoints> ends;
  vtkNew<vtkCellArray> lines;
  for (const Segment& segment : scene.segments) {
    if (!segment.a.allFinite() || !segment.b.allFinite()) continue;
    lines->InsertNextCell(2);
    for (const Eigen::Vector3d& end : {segment.a, segment.b}) {
      const Eigen::Vector3d lifted = end + (0.02 + 1.5 * spacing_m) * projection.to_viewer(end);
      lines->InsertCellPoint(ends->InsertNextPoint(lifted.data()));
    }
  }
  if (lines->GetNumberOfCells() == 0) return;
  vtkNew<vtkPolyData> data;
  data->SetPoints(ends);
  data->SetLines(lines);
  vtkNew<vtkPolyDataMapper> mapper;
  mapper->SetInputData(data);
  vtkNew<vtkActor> actor;
  actor->SetMapper(mapper);
  actor->GetProperty()->LightingOff();
  actor->GetProperty()->SetLineWidth(2.5F * kSupersampling);
  actor->GetProperty()->SetColor(scene.segment_color.r / 255.0, scene.segment_color.g / 255.0,
                                 scene.segment_color.b / 255.0);
  renderer.AddActor(actor);
}

}  // namespace

core::Result<void> render_snapshot(const Scene& scene, const SnapshotOptions& options,
                                   const std::filesystem::path& file) {
  if (auto checked = check(scene, options); !checked) return checked;
  SnapshotOptions large = options;
  large.width_px *= kSupersampling;
  large.height_px *= kSupersampling;

  const SceneAxes axes = scene_axes(scene, large);
  OverlayContent content;
  content.scene = &scene;
  content.options = &options;
  content.projection = choose_projection(scene, large, axes);
  const Projection& projection = content.projection;
  const auto facing = visible_points(scene, projection, options.cull_back_faces);
  const double spacing_m = point_spacing(scene, facing);
  const auto points = nearest_per_cell(scene, facing, projection, kSupersampling);
  const PointColors styled = color_points(scene, points, options, axes, projection);
  content.color_scale = styled.scale;
  content.empty = facing.empty() && scene.segments.empty();

  Band band;
  band.height = kSupersampling * std::min(kBand_px, options.height_px) + 2 * kMargin;
  auto window = OffscreenWindow::open(large.width_px, band.height);
  if (!window) return tl::unexpected(window.error());
  vtkNew<vtkRenderer> renderer;
  renderer->SetBackground(kBackground.r / 255.0, kBackground.g / 255.0, kBackground.b / 255.0);
  (*window)->window()->AddRenderer(renderer);
  add_points(*renderer, scene, points, styled.colors, options, projection, spacing_m);
  add_segments(*renderer, scene, projection, spacing_m);
  vtkNew<Overlay> overlay;
  overlay->content = &content;
  overlay->band = &band;
  vtkNew<vtkContextActor> over_points;
  over_points->GetScene()->AddItem(overlay);
  renderer->AddActor(over_points);
  return write_png(draw_bands(**window, *renderer, projection, options, band), file);
}

}  // namespace plumbline::viz
