// SPDX-License-Identifier: BSD-3-Clause
// Optical flow that is left when the second picture is laid onto the first one through depth and poses.
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include "pair.hpp"

namespace plumbline::check {
namespace {

using geometry::Rigid3;

constexpr int kCorners = 250;
constexpr int kFewestFlows = 10;
constexpr int kMargin = 5;  ///< pixels around a corner that both pictures must show
const cv::Size kWindow(13, 13);
constexpr int kLevels = 2;
constexpr float kNowhere = -1e4F;
constexpr auto kMetres = static_cast<float>(1.0 / kDepthUnits_per_m);

/// The first frame's grid of depth in another picture.
struct Warp {
  cv::Mat pixels;  ///< CV_32FC2; kNowhere: behind the camera, or without depth
  cv::Mat depth;   ///< CV_32FC1, metres along z of that camera
};

Warp warp_into(const View& first, const View& second) {
  const Rigid3 t = second.poses.world_from_color.inverse() * first.poses.world_from_depth;
  const Eigen::Matrix3f r = t.rotation.cast<float>();
  const Eigen::Vector3f s = t.translation.cast<float>();
  const sensor::Pinhole& k = second.camera->pinhole();
  const auto fx = static_cast<float>(k.fx), fy = static_cast<float>(k.fy);
  const auto cx = static_cast<float>(k.cx), cy = static_cast<float>(k.cy);

  // Rows are read one after another while the camera moves.
  const auto readout = static_cast<float>(second.camera->readout_s());
  const Eigen::Vector3f v = second.poses.velocity.cast<float>() * readout;
  const Eigen::Vector3f w = second.poses.turn.cast<float>() * readout;
  const float per_row = 1.0F / static_cast<float>(k.height);

  const std::vector<float>& columns = first.camera->columns();
  Warp warp;
  warp.pixels.create(first.camera->size(), CV_32FC2);
  warp.depth.create(first.camera->size(), CV_32FC1);
  for (int y = 0; y < warp.depth.rows; ++y) {
    const auto* z = first.frame.depth.ptr<std::uint16_t>(y);
    auto* pixel = warp.pixels.ptr<cv::Vec2f>(y);
    auto* depth = warp.depth.ptr<float>(y);
    const Eigen::Vector3f row = r.col(1) * first.camera->rows()[static_cast<std::size_t>(y)] + r.col(2);

    // Each point of the row, seen from the second camera.
    for (int x = 0; x < warp.depth.cols; ++x) {
      const float far = kMetres * static_cast<float>(z[x]);
      const float ray = columns[static_cast<std::size_t>(x)];
      float px = far * (r(0, 0) * ray + row.x()) + s.x();
      float py = far * (r(1, 0) * ray + row.y()) + s.y();
      float pz = far * (r(2, 0) * ray + row.z()) + s.z();

      const bool there = z[x] > 0 && pz > static_cast<float>(SmallCamera::kNearest_m);

      // The camera moved on until the row was read in which the point is seen.
      if (readout > 0.0F) {
        const float share = (fy * py / pz + cy) * per_row - 0.5F;
        const float mx = v.x() + w.y() * pz - w.z() * py;
        const float my = v.y() + w.z() * px - w.x() * pz;
        const float mz = v.z() + w.x() * py - w.y() * px;

        px -= share * mx;
        py -= share * my;
        pz -= share * mz;
      }
      pixel[x] = there ? cv::Vec2f(fx * px / pz + cx, fy * py / pz + cy) : cv::Vec2f(kNowhere, kNowhere);
      depth[x] = there ? pz : 0.0F;
    }
  }
  return warp;
}

/// Pixels of the first grid whose surface the second frame sees too.
cv::Mat seen_by(const View& second, const Warp& warp) {
  cv::Mat seen(warp.depth.size(), CV_8UC1);
  const cv::Size& size = second.camera->size();
  for (int y = 0; y < seen.rows; ++y) {
    const auto* pixel = warp.pixels.ptr<cv::Vec2f>(y);
    const auto* depth = warp.depth.ptr<float>(y);
    auto* to = seen.ptr<std::uint8_t>(y);

    // A pixel counts where the second depth has the same surface.
    for (int x = 0; x < seen.cols; ++x) {
      const float u = pixel[x][0], v = pixel[x][1];
      to[x] = 0;
      if (!(u >= 1.0F && v >= 1.0F && u < static_cast<float>(size.width - 2) &&
            v < static_cast<float>(size.height - 2)))
        continue;

      const float z = kMetres * static_cast<float>(second.frame.depth.at<std::uint16_t>(
                                    static_cast<int>(v + 0.5F), static_cast<int>(u + 0.5F)));
      to[x] = std::abs(z - depth[x]) < 0.03F + 0.03F * depth[x] ? 255 : 0;
    }
  }
  return seen;
}

bool all_set(const cv::Mat& mask, const cv::Point2f& at) {
  const int x = static_cast<int>(at.x + 0.5F), y = static_cast<int>(at.y + 0.5F);
  if (x < kMargin || y < kMargin || x >= mask.cols - kMargin || y >= mask.rows - kMargin) return false;
  for (int v = y - kMargin; v <= y + kMargin; ++v) {
    const auto* row = mask.ptr<std::uint8_t>(v);
    for (int u = x - kMargin; u <= x + kMargin; ++u) {
      if (row[u] == 0) return false;
    }
  }
  return true;
}

/// Bilinear, inside.
Eigen::Vector2d pixel_at(const cv::Mat& pixels, const cv::Point2f& at) {
  const int x = static_cast<int>(at.x), y = static_cast<int>(at.y);
  const double a = static_cast<double>(at.x) - x, b = static_cast<double>(at.y) - y;
  const auto get = [&](int dx, int dy) {
    const auto& p = pixels.at<cv::Vec2f>(y + dy, x + dx);
    return Eigen::Vector2d(static_cast<double>(p[0]), static_cast<double>(p[1]));
  };
  return (1 - b) * ((1 - a) * get(0, 0) + a * get(1, 0)) + b * ((1 - a) * get(0, 1) + a * get(1, 1));
}

}  // namespace

void FirstView::prepare_flow() {
  prepared_ = true;
  const Warp own = warp_into(view_, view_);
  cv::remap(view_.frame.gray, gray_, own.pixels, cv::Mat(), cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  cv::Mat there = own.depth > 0.0F, inside;
  gray_.setTo(0, ~there);
  cv::erode(there, inside, cv::Mat::ones(2 * kMargin + 1, 2 * kMargin + 1, CV_8UC1), {-1, -1}, 1,
            cv::BORDER_CONSTANT, 0);
  cv::goodFeaturesToTrack(gray_, corners_, kCorners, 0.01, 6.0, inside, 5);
  cv::buildOpticalFlowPyramid(gray_, pyramid_, kWindow, kLevels);
}

void FirstView::add_flow(const View& second, PairRows& rows) {
  if (!prepared_) prepare_flow();
  const Warp warp = warp_into(view_, second);
  const cv::Mat seen = seen_by(second, warp);

  // Corners that the second view sees.
  std::vector<cv::Point2f> from;
  for (const cv::Point2f& corner : corners_) {
    if (all_set(seen, corner)) from.push_back(corner);
  }
  if (from.size() < kFewestFlows) return;

  // The second picture on the first one's grid; where it shows nothing, it shows the first, so that no corner
  // arises.
  cv::Mat gray;
  cv::remap(second.frame.gray, gray, warp.pixels, cv::Mat(), cv::INTER_LINEAR, cv::BORDER_CONSTANT, 0);
  gray_.copyTo(gray, ~seen);
  std::vector<cv::Mat> pyramid;
  cv::buildOpticalFlowPyramid(gray, pyramid, kWindow, kLevels);

  const cv::TermCriteria enough(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 20, 0.02);

  std::vector<cv::Point2f> to, back;
  std::vector<std::uint8_t> forward_found, back_found;
  std::vector<float> unused;
  cv::calcOpticalFlowPyrLK(pyramid_, pyramid, from, to, forward_found, unused, kWindow, kLevels, enough);
  cv::calcOpticalFlowPyrLK(pyramid, pyramid_, to, back, back_found, unused, kWindow, kLevels, enough);

  const Rigid3 second_from_first = second.poses.world_from_depth.inverse() * view_.poses.world_from_depth;
  constexpr double kMostBack_px = 0.3;
  constexpr double kMost_px = 12.0;

  std::vector<FlowRow> flow;
  for (std::size_t i = 0; i < from.size(); ++i) {
    if (forward_found[i] == 0 || back_found[i] == 0 || cv::norm(back[i] - from[i]) > kMostBack_px) continue;
    if (!all_set(seen, to[i])) continue;
    const Eigen::Vector2d off = pixel_at(warp.pixels, to[i]) - pixel_at(warp.pixels, from[i]);
    const cv::Point at(static_cast<int>(from[i].x + 0.5F), static_cast<int>(from[i].y + 0.5F));
    if (off.norm() < kMost_px) flow.push_back({second_from_first * view_.point(at), off});
  }
  if (flow.size() >= kFewestFlows) rows.flow = std::move(flow);
}

}  // namespace plumbline::check
