// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/cloud/io/frame.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

namespace plumbline::cloud {
namespace {

constexpr std::string_view kKey = "frame:";
constexpr std::size_t kLongest = 200;  // bytes of a text that is passed on to other files

}  // namespace

Up CloudFrame::up() const {
  if (text.find("z up") != std::string::npos) return Up::kZ;
  return text.find("y down") != std::string::npos ? Up::kMinusY : Up::kUnknown;
}

std::vector<std::string> CloudFrame::comments() const {
  if (!known()) return {};
  return {std::string(kKey) + " " + text};
}

CloudFrame frame_with(Up up) {
  if (up == Up::kUnknown) return {};
  return {up == Up::kZ ? "metres, right-handed, z up" : "metres, right-handed, x right, y down, z ahead"};
}

CloudFrame frame_in(const std::vector<std::string>& comments) {
  for (const std::string& comment : comments) {
    if (comment.compare(0, kKey.size(), kKey) != 0) continue;
    const std::size_t begin = comment.find_first_not_of(' ', kKey.size());
    if (begin == std::string::npos) continue;

    // Long or unprintable text is reduced to its up axis
    CloudFrame frame{comment.substr(begin, comment.find_last_not_of(" \t\r") + 1 - begin)};
    const bool plain = frame.text.size() <= kLongest &&
                       std::all_of(frame.text.begin(), frame.text.end(),
                                   [](char c) { return static_cast<unsigned char>(c) >= 0x20 && c != 0x7f; });
    return plain ? frame : frame_with(frame.up());
  }
  return {};
}

core::Result<void> check_same_up(const std::string& name, const CloudFrame& frame,
                                 const std::string& other_name, const CloudFrame& other) {
  // An unknown frame is not refused
  const Up up = frame.up();
  const Up other_up = other.up();
  if (up == Up::kUnknown || other_up == Up::kUnknown || up == other_up) return {};

  const auto words = [](Up which) { return which == Up::kZ ? "z up" : "y down"; };
  return core::input_error(
      fmt::format("{} has {}, {} has {}, as their headers say; bring both into one frame first, with the "
                  "filter transform",
                  name, words(up), other_name, words(other_up)));
}

}  // namespace plumbline::cloud
