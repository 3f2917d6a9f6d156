// SPDX-License-Identifier: BSD-3-Clause
// The pictures of docs/reference/filters.md: one view of a generated room before and after the last filter of
// every example chain.
//   filter_pictures SOURCE-FOLDER [FILTER...]
#include <fmt/format.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "plumbline/cloud/filters/filter_chain.hpp"
#include "plumbline/cloud/fusion/keyframe_cloud.hpp"
#include "plumbline/cloud/io/cloud_io.hpp"
#include "plumbline/pipeline/input.hpp"
#include "plumbline/viz/snapshot.hpp"

using namespace plumbline;

namespace {

namespace fs = std::filesystem;

template <typename T>
T must(core::Result<T> result) {
  if (!result) throw std::runtime_error(result.error().message);
  return std::move(*result);
}

/// The chain of an example without its last `without` filters.
cloud::FilterChain load_part(const fs::path& file, std::size_t without) {
  core::ConfigNode node = must(core::read_yaml(file));
  for (auto& [key, value] : node.entries) {
    if (key == "filters") value.items.resize(value.items.size() - without);
  }
  core::ConfigProblems problems;
  auto chain = cloud::FilterChain::parse(node, "", cloud::builtin_filters(), problems);
  if (!problems.empty()) throw std::runtime_error(core::to_string(problems));
  return chain;
}

cv::Mat draw(const cloud::CloudPtr& cloud, viz::ColorMode color, const fs::path& scratch) {
  viz::Scene scene;
  scene.cloud = cloud;
  viz::SnapshotOptions options;
  options.view = viz::View::kExplicit;
  options.viewpoint.eye = {1.3, -1.4, -1.2};
  options.viewpoint.target = {0.0, 0.2, 2.2};
  options.viewpoint.field_of_view_deg = 48.0;
  options.up = Eigen::Vector3d(0.0, -1.0, 0.0);
  options.color = color;
  options.width_px = 318;
  options.height_px = 240;
  options.point_size_px = 2.0;
  options.annotations = false;
  options.cull_back_faces = false;
  const auto drawn = viz::render_snapshot(scene, options, scratch);
  if (!drawn) throw std::runtime_error(drawn.error().message);
  return cv::imread(scratch.string());
}

/// One keyframe's organised cloud, every second pixel.
cloud::CloudPtr film(const fs::path& pipelines, const core::Executor& executor) {
  const auto log = core::null_log();
  const auto source =
      must(pipeline::open_input("synth:office?frames=60&seed=4", {}, pipelines / "scenes", executor, *log));
  const auto frame = must(source->read(30));
  cloud::KeyframeCloudOptions options;
  options.stride_px = 2;
  return cloud::organised_cloud(frame, source->camera().color, options);
}

viz::ColorMode color_for(const std::string& type) {
  const bool normals = type == "normals" || type == "normal_consistency" || type == "mls";
  return normals ? viz::ColorMode::kNormal : viz::ColorMode::kRgb;
}

/// Fewer shades: half the file.
void save(const cv::Mat& before, const cv::Mat& after, const fs::path& file) {
  cv::Mat picture;
  const cv::Mat gap(before.rows, 4, CV_8UC3, cv::Scalar(255, 255, 255));
  cv::hconcat(std::vector<cv::Mat>{before, gap, after}, picture);
  for (auto it = picture.begin<cv::Vec3b>(); it != picture.end<cv::Vec3b>(); ++it) {
    for (int c = 0; c < 3; ++c) (*it)[c] = static_cast<std::uint8_t>(((*it)[c] + 8) / 17 * 17);
  }
  if (!cv::imwrite(file.string(), picture, {cv::IMWRITE_PNG_COMPRESSION, 9})) {
    throw std::runtime_error(file.string() + ": cannot be written");
  }
}

void run(const fs::path& folder, const std::vector<std::string>& wanted) {
  const core::Executor executor;
  const fs::path source = fs::absolute(folder);  // the working folder changes below
  const fs::path scratch = fs::temp_directory_path() / "plumbline_filter_pictures";
  fs::create_directories(scratch);
  const cloud::CloudPtr cloud = film(source / "pipelines", executor);

  // merge gets what a box holds, turned about: something that was not there.
  auto other = std::make_shared<cloud::Cloud>(*cloud);
  for (cloud::Point& p : other->points) {
    p.x = -p.x;
    p.y -= 1.2F;
  }
  fs::current_path(scratch);
  if (auto written = cloud::write_ply("other.ply", *other); !written)
    throw std::runtime_error(written.error().message);

  cloud::FilterContext context;
  context.viewpoint = Eigen::Vector3f::Zero();
  context.executor = &executor;

  for (const std::string& type : cloud::builtin_filters().types()) {
    if (!wanted.empty() && std::find(wanted.begin(), wanted.end(), type) == wanted.end()) continue;
    const fs::path example = source / "pipelines/filters/examples" / (type + ".yaml");

    const auto before = must(load_part(example, 1).apply(cloud, context));
    const auto after = must(load_part(example, 0).apply(cloud, context));
    const viz::ColorMode color = color_for(type);
    save(draw(before, color, scratch / "before.png"), draw(after, color, scratch / "after.png"),
         source / "docs/reference/pictures" / (type + ".png"));
    fmt::print("{:<24}{:>8} -> {:>8}\n", type, before->size(), after->size());
  }
  fs::remove_all(scratch);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) return 2;
  try {
    run(argv[1], {argv + 2, argv + argc});
  } catch (const std::exception& e) {
    fmt::print(stderr, "{}\n", e.what());
    return 1;
  }
}
