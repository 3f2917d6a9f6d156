// SPDX-License-Identifier: BSD-3-Clause
// One frame as a cloud with colour and normals, through a chain of filters, into a file.
//
//   filter_cloud INPUT PIPELINES CHAIN.yaml CLOUD.ply|CLOUD.pcd
//
// near.yaml beside this file is such a chain.
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <cstdio>
#include <vector>

#include "plumbline/cloud/filters/filter_chain.hpp"
#include "plumbline/cloud/fusion/keyframe_cloud.hpp"
#include "plumbline/cloud/io/cloud_io.hpp"
#include "plumbline/core/error.hpp"
#include "plumbline/pipeline/input.hpp"

using namespace plumbline;

namespace {

/// Prints the message; returns the exit code that the program uses for this kind of error.
int fail(const core::Error& error) {
  std::fprintf(stderr, "%s\n", error.message.c_str());
  return static_cast<int>(error.kind);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 5) {
    std::fprintf(stderr, "usage: filter_cloud INPUT PIPELINES CHAIN.yaml CLOUD.ply\n");
    return 2;
  }

  const std::filesystem::path pipelines = argv[2];
  const core::Executor executor;
  const auto log = core::stderr_log(core::LogLevel::kWarning);
  dataset::OpenOptions options;
  options.cameras_folder = pipelines / "cameras";

  // Load the chain first: a wrong key is reported at once, with file, line and column.
  const auto chain = cloud::FilterChain::load(argv[3], cloud::builtin_filters());
  if (!chain) return fail(chain.error());

  const auto source = pipeline::open_input(argv[1], options, pipelines / "scenes", executor, *log);
  if (!source) return fail(source.error());
  const auto frame = (*source)->read(0);
  if (!frame) return fail(frame.error());

  const cloud::CloudPtr cloud = cloud::organised_cloud(*frame, (*source)->camera().color);
  cloud::FilterContext context;
  context.viewpoint = Eigen::Vector3f::Zero();  // the cloud is in the camera's frame

  std::vector<cloud::FilterReport> reports;
  const auto filtered = chain->apply(cloud, context, &reports);
  if (!filtered) return fail(filtered.error());
  std::printf("%s", cloud::to_table(reports).c_str());
  if (auto written = cloud::write_cloud(argv[4], **filtered); !written) return fail(written.error());

  const auto back = cloud::read_cloud(argv[4]);
  if (!back) return fail(back.error());
  std::printf("%zu points in %s\n", back->cloud->size(), argv[4]);
}
