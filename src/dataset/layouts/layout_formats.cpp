// SPDX-License-Identifier: BSD-3-Clause
// Table of layouts, and messages about a folder that has none of them.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <map>

#include "layout.hpp"
#include "plumbline/core/git_lfs.hpp"
#include "plumbline/dataset/recording_poses.hpp"
#include "text_lines.hpp"

namespace plumbline::dataset {
namespace {

namespace fs = std::filesystem;

/// True if one of the alternatives of a part exists.
bool has_part(const fs::path& folder, const std::string& part) {
  const std::vector<std::string> names = split_words(part, "|");
  return std::any_of(names.begin(), names.end(), [&](const std::string& name) {
    return name.back() == '/' ? is_folder(folder / name) : is_file(folder / name);
  });
}

std::string alternatives(const std::string& part) {
  std::string text;
  for (const std::string& name : split_words(part, "|")) text += (text.empty() ? "" : " or ") + name;
  return text;
}

/// Folders by name, files by how many of each ending, at most a dozen words.
std::string what_is_there(const fs::path& folder) {
  std::vector<std::string> seen;
  std::map<std::string, std::size_t> endings;
  std::error_code ignored;

  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    const fs::path& path = entry.path();
    if (is_folder(path)) {
      seen.push_back(path.filename().string() + "/");
    } else {
      ++endings[path.has_extension() ? path.extension().string() : "without ending"];
    }
  }

  // At most eight folders are named
  std::sort(seen.begin(), seen.end());
  constexpr std::size_t kMost = 8;
  const std::size_t folders = seen.size();
  seen.resize(std::min(folders, kMost));
  if (folders > kMost) seen.push_back(fmt::format("{} more folders", folders - kMost));

  // Endings follow until the list is full
  for (const auto& [ending, count] : endings) {
    if (seen.size() < 2 * kMost)
      seen.push_back(fmt::format("{} {} file{}", count, ending, count == 1 ? "" : "s"));
  }

  std::string text;
  for (const std::string& word : seen) text += (text.empty() ? "" : ", ") + word;
  return text;
}

/// The first file of the folder, by name, that is a Git LFS pointer; "": none is.
fs::path lfs_pointer_in(const fs::path& folder) {
  fs::path first;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    const fs::path& path = entry.path();
    if ((first.empty() || path < first) && core::is_lfs_pointer(path)) first = path;
  }
  return first;
}

/// The layout of which the largest share of parts exists, and what it lacks; "" if no layout has any part.
std::string nearest_layout(const fs::path& folder) {
  double best = 0.0;
  std::string text;

  for (const LayoutFormat* format : layout_formats()) {
    std::string missing;
    std::size_t there = 0;
    for (const std::string& part : format->parts) {
      if (has_part(folder, part)) {
        ++there;
      } else {
        missing += (missing.empty() ? "" : ", ") + alternatives(part);
      }
    }

    // The share of parts decides, not their number
    const double share = static_cast<double>(there) / static_cast<double>(format->parts.size());
    if (share <= best) continue;
    best = share;
    text =
        fmt::format("the nearest layout is '{}' ({}), of which is missing: {}", format->name, format->program,
                    missing.empty() ? "nothing is found by name; look into its files" : missing);
  }

  return text;
}

}  // namespace

const std::vector<const LayoutFormat*>& layout_formats() {
  static const std::vector<const LayoutFormat*> formats = {
      &tum_layout(),     &seven_scenes_layout(), &replica_layout(),  &scannet_layout(),
      &stray_layout(),   &polycam_layout(),      &record3d_layout(), &tartanair_layout(),
      &redwood_layout(), &azure_kinect_layout()};
  return formats;
}

std::vector<std::string> layout_names() {
  std::vector<std::string> names = {"auto"};
  for (const LayoutFormat* format : layout_formats()) names.emplace_back(format->name);
  return names;
}

const LayoutFormat* layout_of(const fs::path& folder) {
  for (const LayoutFormat* format : layout_formats()) {
    if (format->recognises(folder)) return format;
  }
  return nullptr;
}

bool is_part_of_recording(const fs::path& file) {
  std::error_code ec;
  const fs::path real = fs::weakly_canonical(file, ec);
  if (ec || !fs::exists(real, ec)) return false;

  // Parts are at most three folders deep
  std::string part = real.filename().string();  // the folder or file below `folder`
  fs::path folder = real.parent_path();
  constexpr int kDepth = 3;

  for (int i = 0; i < kDepth; ++i) {
    if (const LayoutFormat* format = layout_of(folder)) {
      // Names that every layout may have, then its own
      std::vector<std::string> names{
          "camera.yaml", "groundtruth.txt", "rgb.txt", "depth.txt", "associations.txt", "rgb", "depth"};
      for (const std::string& alternatives : format->parts) {
        for (const std::string& name : split_words(alternatives, "|/")) names.push_back(name);
      }
      if (std::find(names.begin(), names.end(), part) != names.end()) return true;
    }

    part = folder.filename().string();
    folder = folder.parent_path();
  }
  return false;
}

std::string not_a_recording_file(const fs::path& file) {
  if (core::is_lfs_pointer(file)) return fmt::format("{}: {}", file.string(), core::kLfsPointer);
  std::array<char, 4> magic{};
  std::ifstream(file, std::ios::binary).read(magic.data(), magic.size());
  const bool zip = magic == std::array<char, 4>{'P', 'K', '\x03', '\x04'};

  // Record3D can export a readable format
  if (file.extension() == ".r3d") {
    return fmt::format(
        "{}: is a recording of Record3D, whose depth is packed with LZFSE, which is not read; export it on "
        "the phone as 'EXR + JPG sequence' and give that folder",
        file.string());
  }
  if (zip) return fmt::format("{}: is an archive; unpack it and give the recording's folder", file.string());
  return fmt::format(
      "{}: is a file, and no bag (MCAP, rosbag2's .db3, ROS 1's .bag) by its content; give a bag or the "
      "recording's folder",
      file.string());
}

std::string not_a_recording(const fs::path& folder) {
  std::string looked_for;
  for (const LayoutFormat* format : layout_formats()) {
    looked_for +=
        fmt::format("{}{} ({})", looked_for.empty() ? "" : ", ", format->looked_for, format->program);
  }

  // An LFS pointer explains the missing files
  if (const fs::path pointer = lfs_pointer_in(folder); !pointer.empty())
    return fmt::format("{}: {}", pointer.string(), core::kLfsPointer);

  // The user sees what the folder holds
  const std::string seen = what_is_there(folder);
  std::string text = fmt::format("{}: {}; looked for {}", folder.string(),
                                 seen.empty() ? "the folder is empty" : "no recording found", looked_for);
  if (!seen.empty()) text += "; seen: " + seen;
  if (const std::string nearest = nearest_layout(folder); !nearest.empty()) text += "; " + nearest;
  return text;
}

}  // namespace plumbline::dataset
