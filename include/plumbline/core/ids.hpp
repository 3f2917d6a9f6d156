// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Typed ids that name things across modules and robots; never pointers.
#include <cstdint>
#include <functional>
#include <tuple>

namespace plumbline::core {

/// Id of a thing of kind Tag: the robot that made it and a running number within that robot.
template <typename Tag>
struct Id {
  std::int32_t robot = 0;
  std::int32_t index = -1;  ///< -1: no such thing

  [[nodiscard]] bool valid() const { return index >= 0; }
  friend bool operator==(const Id& a, const Id& b) { return a.robot == b.robot && a.index == b.index; }
  friend bool operator!=(const Id& a, const Id& b) { return !(a == b); }
  friend bool operator<(const Id& a, const Id& b) {
    return std::tie(a.robot, a.index) < std::tie(b.robot, b.index);
  }
};

using KeyframeId = Id<struct KeyframeTag>;
using PointId = Id<struct PointTag>;
using LineId = Id<struct LineTag>;

}  // namespace plumbline::core

/// @cond
template <typename Tag>
struct std::hash<plumbline::core::Id<Tag>> {
  std::size_t operator()(const plumbline::core::Id<Tag>& id) const noexcept {
    return std::hash<std::uint64_t>{}(static_cast<std::uint64_t>(static_cast<std::uint32_t>(id.robot)) << 32 |
                                      static_cast<std::uint32_t>(id.index));
  }
};
/// @endcond
