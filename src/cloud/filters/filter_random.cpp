// SPDX-License-Identifier: BSD-3-Clause
#include <pcl/filters/random_sample.h>

#include "filters/filter_tools.hpp"

namespace plumbline::cloud {
namespace {

class RandomSamplingFilter : public Filter {
 public:
  void declare(core::OptionTable& table) override {
    table.integer("count", count_, {1, 1000000000}, "", "Points to keep; a smaller cloud stays whole");
    table.integer("seed", seed_, {0, 2147483647}, "", "Added to the run's seed");
  }
  core::Result<CloudPtr> apply(const CloudConstPtr& input, const FilterContext& context) const override {
    const CloudConstPtr points = finite_list(input);

    // Fewer points than wanted: all of them
    if (points->size() <= static_cast<std::size_t>(count_)) return finite_list(*points);
    pcl::RandomSample<Point> sample;
    sample.setSample(static_cast<unsigned>(count_));
    sample.setSeed(context.seed + static_cast<unsigned>(seed_));
    CloudPtr output = filtered_by(sample, points);
    make_list(*output);
    return output;
  }

 private:
  int count_ = 100000;
  int seed_ = 1;
};

}  // namespace

FilterInfo random_sampling_filter() {
  return {"random_sampling", "Keeps a given number of points chosen at random.",
          "PCL's RandomSample: without putting back, in the order of the input. The same seed keeps the same "
          "points.",
          "- type: random_sampling\n  count: 50000\n",
          [] { return std::make_unique<RandomSamplingFilter>(); }};
}

}  // namespace plumbline::cloud
