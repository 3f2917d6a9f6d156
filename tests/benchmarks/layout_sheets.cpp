// SPDX-License-Identifier: BSD-3-Clause
// Makes docs/guide/pictures/layouts_{home,office,corridor}.png, sixty layouts by number: layout_sheets FOLDER
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "plumbline/core/executor.hpp"
#include "plumbline/dataset/image_io.hpp"
#include "plumbline/synth/layout.hpp"
#include "plumbline/synth/source.hpp"

namespace {

using namespace plumbline;

constexpr int kPlan = 128, kView = 160, kTall = 120, kText = 12, kColumns = 4, kRows = 5;  // px; sheets

/// The lowest storey from above with the path, a picture of the camera's, and numbers below.
cv::Mat3b tile(const std::string& kind, int number) {
  synth::SynthOptions options;
  options.layout = number;
  options.sensor = synth::Sensor::kIdeal;
  options.width = kView;
  options.height = kTall;
  options.fps = 2.0;
  const auto scene = synth::make_layout(kind, options);
  if (!scene) throw std::runtime_error(scene.error().message);

  const synth::Plan& plan = *scene->plan;
  cv::Mat3b out(kTall + kText, kPlan + kView, {255, 255, 255});

  Eigen::AlignedBox2d box;
  double area = 0.0;
  for (const synth::PlanRoom& room : plan.rooms) {
    for (const auto& p : room.outline()) box.extend(p);
    area += room.area();
  }

  const double scale = std::min((kPlan - 8) / box.sizes().x(), (kTall - 8) / box.sizes().y());
  const auto pixel = [&](const Eigen::Vector2d& p) {
    return cv::Point(4 + static_cast<int>(scale * (p.x() - box.min().x())),
                     4 + static_cast<int>(scale * (box.max().y() - p.y())));
  };
  const auto shape = [&](const std::vector<Eigen::Vector2d>& outline, const cv::Scalar& color) {
    std::vector<cv::Point> corners;
    corners.reserve(outline.size());
    for (const auto& p : outline) corners.push_back(pixel(p));
    cv::fillPoly(out, std::vector<std::vector<cv::Point>>{corners}, color);
  };

  shape({box.corner(box.BottomLeft), box.corner(box.BottomRight), box.corner(box.TopRight),
         box.corner(box.TopLeft)},
        {90, 90, 90});
  for (const auto& room : plan.rooms) {
    if (room.storey == 0) shape(room.outline(), {235, 235, 235});
  }

  // Walls are thinner than a pixel.
  for (const auto& room : plan.rooms) {
    const auto outline = room.outline();
    for (std::size_t i = 0; room.storey == 0 && i < outline.size(); ++i)
      cv::line(out, pixel(outline[i]), pixel(outline[(i + 1) % outline.size()]), {60, 60, 60}, 1);
  }

  for (const auto& o : plan.openings) {
    const auto& wall = plan.walls[static_cast<std::size_t>(o.wall)];
    if (plan.rooms[static_cast<std::size_t>(o.front)].storey == 0 && o.back >= 0)
      cv::line(out, pixel(wall.at(o.from)), pixel(wall.at(o.to)), {235, 235, 235}, 2);
  }
  for (const auto& thing : plan.things) {
    if (plan.rooms[static_cast<std::size_t>(thing.room)].storey == 0) shape(thing.outline, {190, 190, 170});
  }

  const core::Executor executor(1);
  const auto world = synth::build_world(*scene, options, executor);
  if (!world) throw std::runtime_error(world.error().message);
  const auto source = synth::SynthSource::create(*world, 0);
  if (!source) throw std::runtime_error(source.error().message);

  const geometry::Trajectory way = *(*source)->truth();
  for (std::size_t i = 1; i < way.size(); ++i) {
    if (way[i].world_from_camera.translation.z() < 2.3)
      cv::line(out, pixel(way[i - 1].world_from_camera.translation.head<2>()),
               pixel(way[i].world_from_camera.translation.head<2>()), {40, 90, 220}, 1, cv::LINE_AA);
  }

  cv::Mat view = (*source)->rendered((*source)->size() / 5).color.pixels;
  view.copyTo(out(cv::Rect(kPlan, 0, kView, kTall)));
  const std::string text = fmt::format("{} {}: {} rooms, {:.0f} m2, path {:.0f} m", kind, number,
                                       plan.rooms.size(), area, (*source)->path_length());
  cv::putText(out, text, {4, kTall + 9}, cv::FONT_HERSHEY_SIMPLEX, 0.33, {0, 0, 0}, 1, cv::LINE_AA);
  return out;
}

}  // namespace

int main(int count, char** words) {
  const std::filesystem::path folder = count > 1 ? words[1] : ".";
  for (const std::string kind : {"home", "office", "corridor"}) {
    cv::Mat3b sheet((kTall + kText) * kRows, (kPlan + kView) * kColumns, {255, 255, 255});
    for (int i = 0; i < kRows * kColumns; ++i) {
      // The last half of the corridors' sheet shows buildings.
      const bool building = kind == "corridor" && i >= 10;
      const cv::Mat3b one = tile(building ? "building" : kind, building ? i - 10 : i);
      one.copyTo(sheet(cv::Rect(i % kColumns * one.cols, i / kColumns * one.rows, one.cols, one.rows)));
    }

    // Few colours make small files.
    for (cv::Vec3b& pixel : sheet) {
      for (int k = 0; k < 3; ++k)
        pixel[k] = static_cast<std::uint8_t>(std::min(255, (pixel[k] + 8) / 16 * 16));
    }

    const auto bytes = dataset::encode_png(sheet, 9);
    if (!bytes) return 1;
    std::FILE* file = std::fopen((folder / fmt::format("layouts_{}.png", kind)).c_str(), "wb");
    if (file == nullptr) return 1;
    std::fwrite(bytes->data(), 1, bytes->size(), file);
    std::fclose(file);
  }
  return 0;
}
