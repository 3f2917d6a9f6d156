// SPDX-License-Identifier: BSD-3-Clause
// `plumbline filter` (voxel grid, statistical outliers) beside a bare program that makes the same calls to
// PCL: time and memory of both as the system counts them, and whether they agree point for point.
//   compare_pcl_filters PLUMBLINE FOLDER [POINTS]
#include <fmt/format.h>
#include <pcl/filters/statistical_outlier_removal.h>
#include <pcl/filters/voxel_grid.h>
#include <pcl/io/pcd_io.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <random>

#include "plumbline/cloud/cloud_io.hpp"

using namespace plumbline;

namespace {

constexpr float kLeaf = 0.02F;
constexpr int kNeighbours = 16;
constexpr double kDeviations = 2.0;

/// Walls, floor and ceiling of a room of 8 x 3 x 6 m, 3 mm of noise, one point of 200 is dust.
void make_cloud(const std::filesystem::path& file, std::size_t points) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> share(-0.5F, 0.5F);
  std::normal_distribution<float> noise(0.0F, 0.003F);
  const Eigen::Vector3f size(8.0F, 3.0F, 6.0F);
  cloud::Cloud room;
  room.points.resize(points);
  room.width = static_cast<std::uint32_t>(points);
  room.height = 1;
  for (std::size_t i = 0; i < points; ++i) {
    cloud::Point& p = room.points[i];
    Eigen::Vector3f place;
    for (int axis = 0; axis < 3; ++axis) place[axis] = share(random);
    // Sides in proportion to their area: y faces twice as often as the others.
    const std::size_t kind = i % 4;
    const int axis = kind < 2 ? 1 : kind == 2 ? 0 : 2;
    Eigen::Vector3f normal = Eigen::Vector3f::Zero();
    normal[axis] = place[axis] < 0.0F ? 1.0F : -1.0F;
    if (i % 200 != 0) place[axis] = place[axis] < 0.0F ? -0.5F : 0.5F;
    const float off = noise(random);
    p.getVector3fMap() = place.cwiseProduct(size) + off * normal;
    p.getNormalVector3fMap() = normal;
    p.r = static_cast<std::uint8_t>(random() % 256);
    p.g = static_cast<std::uint8_t>(i % 256);
    p.b = 90;
    p.a = 255;
    p.curvature = 0.0F;
  }
  if (auto written = cloud::write_pcd(file, room); !written)
    throw std::runtime_error(written.error().message);
}

int bare(const char* in, const char* out) {
  auto cloud = std::make_shared<cloud::Cloud>();
  if (pcl::io::loadPCDFile(in, *cloud) != 0) return 1;
  auto thin = std::make_shared<cloud::Cloud>();
  pcl::VoxelGrid<cloud::Point> grid;
  grid.setLeafSize(kLeaf, kLeaf, kLeaf);
  grid.setInputCloud(cloud);
  grid.filter(*thin);
  pcl::StatisticalOutlierRemoval<cloud::Point> removal;
  removal.setMeanK(kNeighbours);
  removal.setStddevMulThresh(kDeviations);
  removal.setInputCloud(thin);
  cloud::Cloud clean;
  removal.filter(clean);
  return pcl::io::savePCDFileBinary(out, clean);
}

struct Cost {
  double wall_s = 0.0;
  double user_s = 0.0;
  double memory_mb = 0.0;
};

Cost measure(const std::vector<std::string>& command) {
  std::vector<char*> words;
  for (const std::string& word : command) words.push_back(const_cast<char*>(word.c_str()));
  words.push_back(nullptr);
  const auto start = std::chrono::steady_clock::now();
  const pid_t child = fork();
  if (child == 0) {
    execv(words[0], words.data());
    _exit(127);
  }
  int status = 0;
  rusage used{};
  wait4(child, &status, 0, &used);
  if (status != 0) throw std::runtime_error(command[0] + " failed");
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - start;
  return {wall.count(),
          static_cast<double>(used.ru_utime.tv_sec) + 1e-6 * static_cast<double>(used.ru_utime.tv_usec),
          static_cast<double>(used.ru_maxrss) / 1024.0};
}

bool same_points(const std::filesystem::path& a, const std::filesystem::path& b) {
  const auto left = cloud::read_cloud(a);
  const auto right = cloud::read_cloud(b);
  if (!left || !right || left->cloud->size() != right->cloud->size()) return false;
  for (std::size_t i = 0; i < left->cloud->size(); ++i) {
    if ((*left->cloud)[i].getVector3fMap() != (*right->cloud)[i].getVector3fMap()) return false;
  }
  fmt::print("{} points are left, the same in both\n", left->cloud->size());
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc == 4 && std::string(argv[1]) == "--bare") return bare(argv[2], argv[3]);
  if (argc < 3) {
    fmt::print(stderr, "usage: compare_pcl_filters PLUMBLINE FOLDER [POINTS]\n");
    return 2;
  }
  const std::filesystem::path folder = argv[2];
  const std::size_t points = argc > 3 ? std::stoul(argv[3]) : 10'000'000;
  const std::string in = folder / "in.pcd";
  make_cloud(in, points);
  std::ofstream(folder / "chain.yaml") << fmt::format(
      "chain: compare\nfilters:\n  - {{type: voxel_grid, leaf: {} m}}\n"
      "  - {{type: statistical_outlier, neighbours: {}, deviations: {}}}\n",
      kLeaf, kNeighbours, kDeviations);
  const std::string pcl = folder / "pcl.pcd";
  const std::string own = folder / "own.pcd";
  const std::string chain = folder / "chain.yaml";
  const Cost theirs = measure({"/proc/self/exe", "--bare", in, pcl});
  const Cost one = measure({argv[1], "filter", chain, in, own, "--threads", "1", "-q"});
  const Cost ours = measure({argv[1], "filter", chain, in, own});
  fmt::print("{:<26}{:>10}{:>10}{:>12}\n", "", "wall s", "user s", "peak MB");
  for (const auto& [name, cost] :
       {std::pair{"PCL, bare program", theirs}, std::pair{"plumbline, one thread", one},
        std::pair{"plumbline, all threads", ours}}) {
    fmt::print("{:<26}{:>10.1f}{:>10.1f}{:>12.0f}\n", name, cost.wall_s, cost.user_s, cost.memory_mb);
  }
  fmt::print("speed {:.2f}x, memory {:.2f}x\n", theirs.wall_s / ours.wall_s,
             ours.memory_mb / theirs.memory_mb);
  return same_points(own, pcl) ? 0 : 1;
}
