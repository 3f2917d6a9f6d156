// SPDX-License-Identifier: BSD-3-Clause
// Filters that read or write a file of their own.
#include <fmt/format.h>

#include <filesystem>
#include <system_error>

#include "filters/filter_tools.hpp"
#include "plumbline/cloud/columns.hpp"

namespace plumbline::cloud {
namespace {

namespace fs = std::filesystem;

class MergeFilter : public Filter {
 public:
  void declare(core::OptionTable& table) override {
    table.text("file", file_, "Cloud to add (.ply, .pcd, .xyz, .csv), relative to the working directory");
  }
  std::string check() const override { return file_.empty() ? "file: a cloud to add must be named" : ""; }
  core::Result<void> ready(const FilterContext&) const override {
    std::error_code error;
    if (fs::is_regular_file(file_, error)) return {};
    return core::input_error(file_ + ": no such file");
  }
  core::Result<CloudPtr> apply(const CloudConstPtr& input, const FilterContext& context) const override {
    const auto other = read_cloud(file_, LargeCoordinates::kShifted);
    if (!other) return tl::unexpected<core::Error>(other.error());

    // Both clouds must be in one frame
    const auto fits = check_one_frame("the chain's cloud", context.shift, file_, other->shift);
    if (!fits) return tl::unexpected<core::Error>(fits.error());
    if (context.frame != nullptr) {
      const auto same = check_same_up("the chain's cloud", *context.frame, file_, other->frame);
      if (!same) return tl::unexpected<core::Error>(same.error());
    }

    // Both clouds relative to the same shift
    change_shift(*other->cloud, other->shift, context.shift);

    auto output = like(*input);
    output->points.reserve(input->size() + other->cloud->size());
    std::vector<std::size_t> chosen[2];
    const Cloud* parts[2] = {input.get(), other->cloud.get()};

    // Finite points of both, the chain's first
    for (std::size_t side = 0; side < 2; ++side) {
      for (std::size_t i = 0; i < parts[side]->size(); ++i) {
        if (!finite((*parts[side])[i])) continue;
        output->points.push_back((*parts[side])[i]);
        chosen[side].push_back(i);
      }
    }
    make_list(*output);

    // Columns follow their points
    if (context.columns != nullptr && context.made_columns != nullptr) {
      *context.made_columns = pick_columns(*context.columns, chosen[0]);
      append_columns(*context.made_columns, chosen[0].size(), pick_columns(other->columns, chosen[1]),
                     chosen[1].size());
    }

    return output;
  }

 private:
  std::string file_;
};

class TeeFilter : public Filter {
 public:
  void declare(core::OptionTable& table) override {
    table.text("file", file_, "File to write (.ply or .pcd), relative to the working directory");
  }
  std::string check() const override {
    const std::string ending = fs::path(file_).extension().string();
    return ending == ".ply" || ending == ".pcd" ? "" : "file: the name of a .ply or .pcd file is needed";
  }
  std::string writes() const override { return file_; }
  core::Result<void> ready(const FilterContext&) const override {
    const fs::path folder = fs::path(file_).parent_path();
    std::error_code error;
    if (folder.empty() || fs::is_directory(folder, error)) return {};
    return core::output_error(fmt::format("{}: there is no folder {}", file_, folder.string()));
  }
  core::Result<CloudPtr> apply(const CloudConstPtr& input, const FilterContext& context) const override {
    // Several runs of a chain write different files
    fs::path file = file_;
    if (!context.run.empty()) {
      file.replace_filename(file.stem().string() + "_" + context.run + file.extension().string());
    }
    const CloudColumns none;
    const CloudFrame frame = context.frame != nullptr ? *context.frame : CloudFrame();
    if (auto written = write_cloud(file, *input, context.columns != nullptr ? *context.columns : none,
                                   context.shift, frame.comments());
        !written)
      return tl::unexpected<core::Error>(written.error());
    return std::make_shared<Cloud>(*input);
  }

 private:
  std::string file_;
};

}  // namespace

FilterInfo merge_filter() {
  return {"merge", "Adds the points of another file.",
          "The points of the file are appended to those of the chain, unchanged: both clouds must be in one "
          "frame (otherwise put transform before it). Columns that only one of the two has are 0 for the "
          "other's points. Whole inputs are merged by naming several: `plumbline filter CHAIN IN... OUT`. "
          "The result is a list, not organised.",
          "- type: merge\n  file: other.ply\n", [] { return std::make_unique<MergeFilter>(); }};
}

FilterInfo tee_filter() {
  return {"tee", "Writes the cloud at this point of the chain, and passes it on.",
          "For inspecting the cloud between two filters. If a pipeline runs the chain for every keyframe, "
          "the keyframe's number is added to the file's name.",
          "- type: tee\n  file: before_smoothing.ply\n", [] { return std::make_unique<TeeFilter>(); }};
}

}  // namespace plumbline::cloud
