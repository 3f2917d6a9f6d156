// SPDX-License-Identifier: BSD-3-Clause
// filter: a chain of filters on the merged cloud.
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <memory>
#include <utility>
#include <vector>

#include "options/chain_option.hpp"
#include "stages/stages.hpp"
#include "summary/sections.hpp"

namespace plumbline::pipeline {
namespace {

class FilterStage : public Stage {
 public:
  void declare(core::OptionTable& table) override {
    filters_.declare(table, "Filter chain: a file, or the filters themselves; empty: none");
  }
  void check(const CheckContext& context, const core::ConfigMark& /*mark*/, const std::string& path,
             core::ConfigProblems& problems) override {
    filters_.check(context, path, problems);
  }
  [[nodiscard]] std::vector<std::string> files() const override { return filters_.files(); }
  core::Result<void> start(const RunContext& context) override {
    context_ = &context;
    return {};
  }

  core::Result<void> finish(StageIo& io) override {
    const auto input = io.input<DenseCloud>("cloud");
    auto filtered = filters_.chain().apply({input->cloud, input->columns}, input->voxel_m,
                                           *context_->executor, &reports_);
    if (!filtered) return tl::unexpected(filtered.error());
    if (!reports_.empty()) context_->log->debug("filters of the merged cloud:\n" + cloud::to_table(reports_));
    auto dense = std::make_shared<DenseCloud>();
    dense->cloud = std::move(filtered->cloud);
    dense->columns = std::move(filtered->columns);
    dense->voxel_m = input->voxel_m;
    dense->output_from_map = input->output_from_map;
    dense->upright = input->upright;
    points_ = dense->cloud->size();
    io.output<DenseCloud>("cloud", dense);
    return {};
  }
  void report(Json& summary) const override {
    report_left_out_of_map(reports_, summary["cloud"]);
    summary["cloud"]["points"] = points_;
  }
  void doubt(const Json& summary, std::vector<Doubt>& reasons) const override {
    doubt_empty_cloud(summary, reasons);
  }

 private:
  ChainOption filters_{""};
  const RunContext* context_ = nullptr;
  std::size_t points_ = 0;
  std::vector<cloud::FilterReport> reports_;
};

}  // namespace

StageType filter_stage() {
  return stage_type<FilterStage>("filter", "Runs a filter chain on the merged cloud", Mode::kSerial,
                                 {{"cloud", cloud_port()}}, {{"cloud", cloud_port()}});
}

}  // namespace plumbline::pipeline
