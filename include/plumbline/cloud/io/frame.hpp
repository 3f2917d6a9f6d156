// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The frame of a cloud as its file states it: a comment of the header that begins with "frame:".
#include <string>
#include <vector>

#include "plumbline/core/error.hpp"

namespace plumbline::cloud {

/// Direction that is up in a frame.
enum class Up {
  kUnknown,
  kZ,      ///< z is up, as in the results of `map`
  kMinusY  ///< y is down, as in the frame of a camera
};

/// The words behind "frame:". Of them "z up" and "y down" have a meaning for this program, the others are for
/// people ("x east, y north, z up, EPSG:25832"). Empty: the file says nothing.
struct CloudFrame {
  std::string text;

  [[nodiscard]] bool known() const { return !text.empty(); }
  [[nodiscard]] Up up() const;
  /// Lines for the header of a file; none if nothing is known.
  [[nodiscard]] std::vector<std::string> comments() const;
};

/// Metres, right-handed, and this direction up; nothing for kUnknown.
CloudFrame frame_with(Up up);

/// The frame that the comments of a header name; the first one counts.
CloudFrame frame_in(const std::vector<std::string>& comments);

/// Checks that two clouds may be put together as they are. Errors (kInput) name both: each says what is up in
/// it, and these differ.
core::Result<void> check_same_up(const std::string& name, const CloudFrame& frame,
                                 const std::string& other_name, const CloudFrame& other);

}  // namespace plumbline::cloud
