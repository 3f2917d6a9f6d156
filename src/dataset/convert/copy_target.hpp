// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Targets that a recording can be copied to.
#include <memory>
#include <optional>

#include "bags/bag_writer.hpp"
#include "plumbline/core/error.hpp"
#include "plumbline/core/log.hpp"
#include "plumbline/dataset/body_readings.hpp"
#include "plumbline/dataset/frame_source.hpp"

namespace plumbline::dataset {

/// Marks of copies: the maker in an MCAP file's head, and the first line of associations.txt.
inline constexpr const char* kCopyMaker = "plumbline convert";
inline constexpr const char* kCopyTitle = "# stamp of colour, colour, stamp of depth, depth";

class CopyTarget {
 public:
  virtual ~CopyTarget() = default;
  /// `depth_ns` is the stamp of depth as it was stored, without the camera's delay. Error: kInput is about
  /// this frame only, others end the copy.
  virtual core::Result<void> add(std::int64_t color_ns, std::int64_t depth_ns, const StoredPair& pair) = 0;
  virtual core::Result<void> finish(const std::optional<geometry::Trajectory>& truth) = 0;
};

/// `folder` must not be there.
core::Result<std::unique_ptr<CopyTarget>> make_tum_target(const std::filesystem::path& folder,
                                                          const sensor::Camera& camera);
core::Result<std::unique_ptr<CopyTarget>> make_mcap_target(const std::filesystem::path& file,
                                                           const sensor::Camera& camera,
                                                           const BodyReadings* body, core::Log& log);

/// Messages into any bag. `standard_depth`: depth in other units than millimetres is written in metres, for
/// readers without the camera file, and without a warning. `body` may be null, and outlives the target.
std::unique_ptr<CopyTarget> make_message_target(std::unique_ptr<BagWriter> bag, const sensor::Camera& camera,
                                                bool standard_depth, const BodyReadings* body,
                                                core::Log& log);

/// Stamp in nanoseconds, rounded to whole microseconds if that is the same time: a double that counts seconds
/// since 1970 resolves no more.
std::int64_t nanoseconds(double seconds);

}  // namespace plumbline::dataset
