// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include "convert/copy_target.hpp"
#include "frame_images.hpp"
#include "plumbline/core/output_file.hpp"
#include "plumbline/dataset/image_io.hpp"
#include "plumbline/dataset/trajectory_io.hpp"

namespace plumbline::dataset {
namespace {

/// "1305031102.175304000": whole nanoseconds, so that the copy has the stamps of the original.
std::string stamp_text(std::int64_t nanoseconds) {
  constexpr std::int64_t kSecond = 1'000'000'000;
  const bool negative = nanoseconds < 0;
  const std::int64_t size = negative ? -nanoseconds : nanoseconds;
  return fmt::format("{}{}.{:09d}", negative ? "-" : "", size / kSecond, size % kSecond);
}

class TumTarget final : public CopyTarget {
 public:
  TumTarget(std::filesystem::path folder, sensor::Camera camera)
      : folder_(std::move(folder)), camera_(std::move(camera)), list_(folder_ / "associations.txt") {
    list_.write(std::string(kCopyTitle) + "\n");
  }

  core::Result<void> add(std::int64_t color_ns, std::int64_t depth_ns, const StoredPair& pair) override {
    const auto color = write("rgb", stamp_text(color_ns), pair.color);
    if (!color) return tl::unexpected(color.error());
    StoredImage depth = pair.depth;
    // Floats in files are read in steps of kFloatDepthScale; another scale is kept by units.
    if (depth.ending.empty() && depth.pixels.type() == CV_32FC1 && camera_.depth_scale != kFloatDepthScale)
      depth.pixels = depth_units(depth.pixels, camera_.depth_scale);
    const auto depth_file = write("depth", stamp_text(depth_ns), depth);
    if (!depth_file) return tl::unexpected(depth_file.error());
    list_.write(
        fmt::format("{} {} {} {}\n", stamp_text(color_ns), *color, stamp_text(depth_ns), *depth_file));
    return {};
  }

  core::Result<void> finish(const std::optional<geometry::Trajectory>& truth) override {
    if (auto written = core::write_file(folder_ / "camera.yaml", sensor::to_yaml(camera_)); !written)
      return written;
    if (truth) {
      if (auto written = write_trajectory(folder_ / "groundtruth.txt", *truth); !written) return written;
    }

    // The list of pairs completes the folder
    return list_.commit();
  }

 private:
  /// Writes a file into the folder `part`; returns its name.
  core::Result<std::string> write(const std::string& part, const std::string& name,
                                  const StoredImage& image) {
    StoredImage file = image;
    if (file.ending.empty()) {
      if (file.pixels.depth() == CV_64F) file.pixels.convertTo(file.pixels, CV_32F);
      const bool floats = file.pixels.depth() == CV_32F;
      auto bytes = floats ? encode_tiff(file.pixels) : encode_png(file.pixels, 1);
      if (!bytes) return tl::unexpected(bytes.error());
      file.bytes = std::move(*bytes);
      file.ending = floats ? ".tiff" : ".png";
    }
    std::string relative = part + "/" + name + file.ending;
    if (auto written = core::write_file(folder_ / relative, file.bytes); !written)
      return tl::unexpected(written.error());
    return relative;
  }

  std::filesystem::path folder_;
  sensor::Camera camera_;
  core::OutputFile list_;
};

}  // namespace

core::Result<std::unique_ptr<CopyTarget>> make_tum_target(const std::filesystem::path& folder,
                                                          const sensor::Camera& camera) {
  for (const char* part : {"rgb", "depth"}) {
    if (auto made = core::make_folder(folder / part); !made) return tl::unexpected(made.error());
  }
  return std::make_unique<TumTarget>(folder, camera);
}

}  // namespace plumbline::dataset
