// SPDX-License-Identifier: BSD-3-Clause
// Maps a recording with a filter that is part of this program: own_filter RECORDING
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <cstdio>
#include <memory>

#include "plumbline/plumbline.hpp"

using namespace plumbline;

/// Takes the colour out of a cloud.
class Grey : public cloud::Filter {
 public:
  /// Key, variable, range, unit, help: parser, checks and messages are made from these.
  void declare(core::OptionTable& table) override {
    table.number("green", green_, {0.0, 1.0}, "ratio", "Share of green in the brightness");
  }
  /// The input stays as it is; the result is a new cloud.
  core::Result<cloud::CloudPtr> apply(const cloud::CloudConstPtr& input,
                                      const cloud::FilterContext&) const override {
    auto output = std::make_shared<cloud::Cloud>(*input);
    for (cloud::Point& p : *output)
      p.r = p.g = p.b = static_cast<std::uint8_t>(green_ * p.g + (1.0 - green_) / 2.0 * (p.r + p.b));
    return output;
  }

 private:
  double green_ = 0.6;
};

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  MapOptions options;
  options.filters.add({"grey", "Takes the colour out.", "", "", [] { return std::make_unique<Grey>(); }});
  options.set = {"fuse.filters=[{type: clusters}, {type: grey, green: 50 %}]"};
  const auto cloud = map(argv[1], "", options).and_then([](const Result& result) { return result.cloud(); });
  if (!cloud) return std::fprintf(stderr, "%s\n", cloud.error().message.c_str()), 1;

  const auto grey = [](const cloud::Point& p) { return p.r == p.g && p.g == p.b; };
  const bool all = std::all_of(cloud->cloud->begin(), cloud->cloud->end(), grey);
  std::printf("%zu points, %s\n", cloud->cloud->size(), all ? "all of them grey" : "some of them in colour");
}
