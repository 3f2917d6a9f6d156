// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Transforms that others publish on ROS 2's network, received by a separate thread.
#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>

#include "plumbline/core/side_thread.hpp"
#include "plumbline/dataset/message_stream.hpp"
#include "plumbline/dataset/ros_messages.hpp"

namespace plumbline::net {

/// Thread-safe. Transforms on /tf are kept of one child frame, `base`; those of the publisher itself are left
/// out, which says with which stamps it sends them.
class TransformListener {
 public:
  TransformListener(std::unique_ptr<dataset::MessageStream> stream, std::string base);

  /// The pose of `child` in `parent` by /tf_static; waits for it. None: there is no chain between them.
  [[nodiscard]] std::optional<geometry::Rigid3> wait_for(const std::string& parent, const std::string& child,
                                                         std::chrono::milliseconds most) const;
  /// The parent of the base in transforms of others on /tf; "" if there was none so far.
  [[nodiscard]] std::string other_parent() const;
  /// The base in that parent, at a stamp (seconds) or, outside of what was received, at the nearest one
  /// within half a second. None: nothing was received there.
  [[nodiscard]] std::optional<geometry::Rigid3> base_at(double stamp) const;
  /// A stamp with which the publisher itself sends the pose of the base.
  void sends(double stamp);

 private:
  void listen(const core::StopToken& stop);
  void take(const dataset::StreamMessage& message);
  [[nodiscard]] std::optional<geometry::Rigid3> fixed(const std::string& parent,
                                                      const std::string& child) const;

  std::unique_ptr<dataset::MessageStream> stream_;  ///< used by the thread only
  const std::string base_;
  mutable std::mutex mutex_;                              ///< protects the members below
  std::map<std::string, dataset::NamedTransform> fixed_;  ///< by child
  std::string parent_;
  std::map<double, geometry::Rigid3> moving_;  ///< parent_from_base, by stamp
  std::deque<std::int64_t> own_ns_;
  core::SideThread thread_;  ///< last: it uses the others
};

}  // namespace plumbline::net
