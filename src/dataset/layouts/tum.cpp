// SPDX-License-Identifier: BSD-3-Clause
// TUM RGB-D benchmark layout: associations.txt, or rgb.txt and depth.txt; groundtruth.txt.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "layout.hpp"
#include "plumbline/core/numbers.hpp"
#include "plumbline/dataset/trajectory_io.hpp"
#include "text_lines.hpp"

namespace plumbline::dataset {
namespace {

namespace fs = std::filesystem;

/// A list's name for a file as a path; lists from Windows separate folders by backslashes.
std::string listed_file(const fs::path& list, std::string name) {
  std::replace(name.begin(), name.end(), '\\', '/');
  return (list.parent_path() / name).string();
}

core::Result<double> read_stamp(const std::string& list, const TextLine& line, std::size_t word) {
  const std::optional<double> stamp = core::to_number(line.words[word]);
  if (stamp && std::isfinite(*stamp)) return *stamp;
  return core::input_error(
      fmt::format("{}:{}: '{}' is not a time in seconds", list, line.number, line.words[word]));
}

/// "1300000000,066667 rgb/1.png": commas separate words here, so that the stamp falls in two.
core::Result<void> no_decimal_comma(const fs::path& list) {
  auto lines = read_raw_lines(list);
  if (!lines) return {};
  for (const RawLine& line : *lines) {
    if (line.text.empty() || line.text[0] == '#') continue;
    if (core::has_decimal_comma(split_words(line.text, " \t\r\n;\v\f"))) {
      return core::input_error(
          fmt::format("{}:{}: decimal comma; write stamps with a point", list.string(), line.number));
    }
  }
  return {};
}

/// Sorts by stamp and drops files with a repeated stamp, with a warning.
void sort_and_unique(const std::string& list, std::vector<StampedFile>& files, core::Log& log) {
  if (!std::is_sorted(files.begin(), files.end(), kByStamp)) {
    log.warning(fmt::format("{}: the stamps are not in order; sorted", list));
    std::stable_sort(files.begin(), files.end(), kByStamp);
  }
  const auto same = [](const StampedFile& a, const StampedFile& b) { return a.stamp == b.stamp; };
  const auto end = std::unique(files.begin(), files.end(), same);
  if (end != files.end()) {
    log.warning(
        fmt::format("{}: {} lines repeat a stamp; the first of each is used", list, files.end() - end));
    files.erase(end, files.end());
  }
}

/// "stamp file" per line.
core::Result<std::vector<StampedFile>> read_list(const fs::path& list, core::Log& log) {
  if (auto plain = no_decimal_comma(list); !plain) return tl::unexpected(plain.error());
  auto lines = read_lines(list);
  if (!lines) return tl::unexpected(lines.error());
  std::vector<StampedFile> files;

  // Stamps, and names that may hold blanks.
  for (const TextLine& line : *lines) {
    if (line.words.size() < 2) {
      return core::input_error(
          fmt::format("{}:{}: expected 'stamp file', found one word", list.string(), line.number));
    }

    const auto stamp = read_stamp(list.string(), line, 0);
    if (!stamp) return tl::unexpected(stamp.error());
    std::string name = line.words[1];
    for (std::size_t i = 2; i < line.words.size(); ++i) name += " " + line.words[i];  // a name with blanks
    files.push_back({*stamp, listed_file(list, name), line.number});
  }

  if (files.empty()) return core::input_error(fmt::format("{}: names no image", list.string()));
  sort_and_unique(list.string(), files, log);
  if (auto there = check_files(list.string(), files); !there) return tl::unexpected(there.error());

  return files;
}

core::Result<Layout> read_two_lists(const fs::path& folder, const LayoutOptions& options, core::Log& log) {
  for (const char* name : {"rgb.txt", "depth.txt"}) {
    if (is_file(folder / name)) continue;
    return core::input_error(
        fmt::format("{}: {} is missing (a TUM recording needs rgb.txt and depth.txt, or associations.txt)",
                    folder.string(), name));
  }

  auto color = read_list(folder / "rgb.txt", log);
  if (!color) return tl::unexpected(color.error());
  auto depth = read_list(folder / "depth.txt", log);
  if (!depth) return tl::unexpected(depth.error());

  // Each colour image with the depth nearest in time.
  Layout layout{"tum"};
  layout.pairs = pair_by_stamp(*color, *depth, options.max_pair_gap_s, options.depth_delay_s);
  layout.images = images_of(*color, *depth);
  if (layout.pairs.empty()) {
    return core::input_error(no_common_time((folder / "rgb.txt").string(), *color,
                                            (folder / "depth.txt").string(), *depth, options.max_pair_gap_s));
  }
  return layout;
}

/// True if the first file of a line of four words is the depth image. TUM's own tool writes colour first; the
/// lists of ICL-NUIM begin with depth.
bool depth_first(const std::string& first, const std::string& second) {
  const auto says_depth = [](const std::string& name) { return name.find("depth") != std::string::npos; };
  const auto says_color = [](const std::string& name) {
    const std::string extension = fs::path(name).extension().string();
    return name.find("rgb") != std::string::npos || name.find("color") != std::string::npos ||
           extension == ".jpg" || extension == ".jpeg";
  };
  if (says_depth(first) != says_depth(second)) return says_depth(first);
  return says_color(second) && !says_color(first);
}

/// "stamp file stamp file" per line. Every image is used once; the pairs are trusted, however far apart.
core::Result<Layout> read_associations(const fs::path& list, core::Log& log) {
  if (auto plain = no_decimal_comma(list); !plain) return tl::unexpected(plain.error());
  auto lines = read_lines(list);
  if (!lines) return tl::unexpected(lines.error());

  std::vector<StampedFile> color;
  std::vector<StampedFile> depth;
  std::set<std::string> used;
  for (const TextLine& line : *lines) {
    if (line.words.size() != 4) {
      return core::input_error(fmt::format("{}:{}: expected 'stamp file stamp file', found {} words",
                                           list.string(), line.number, line.words.size()));
    }

    // Each image has a stamp before it
    const auto first = read_stamp(list.string(), line, 0);
    if (!first) return tl::unexpected(first.error());
    const auto second = read_stamp(list.string(), line, 2);
    if (!second) return tl::unexpected(second.error());

    StampedFile a{*first, listed_file(list, line.words[1]), line.number};
    StampedFile b{*second, listed_file(list, line.words[3]), line.number};
    if (used.count(a.file) + used.count(b.file) > 0) continue;
    used.insert({a.file, b.file});

    // Depth may be named before colour
    if (depth_first(line.words[1], line.words[3])) std::swap(a, b);
    color.push_back(std::move(a));
    depth.push_back(std::move(b));
  }
  if (color.empty()) return core::input_error(fmt::format("{}: names no pair of images", list.string()));

  // Repeated images are reported
  if (color.size() < lines->size()) {
    log.warning(fmt::format("{}: {} of {} lines name an image a second time; not used", list.string(),
                            lines->size() - color.size(), lines->size()));
  }

  // The files that are listed must exist
  for (const auto* files : {&color, &depth}) {
    if (auto there = check_files(list.string(), *files); !there) return tl::unexpected(there.error());
  }

  Layout layout{"tum"};
  layout.images = images_of(color, depth);
  std::vector<PairInfo>& pairs = layout.pairs;
  for (std::size_t i = 0; i < color.size(); ++i)
    pairs.push_back({color[i].stamp, depth[i].stamp, {ImageList::kColor, i}, {ImageList::kDepth, i}});

  // Tracking needs the stamps in order
  if (!std::is_sorted(pairs.begin(), pairs.end(), kByStamp)) {
    log.warning(fmt::format("{}: the stamps are not in order; sorted", list.string()));
    std::stable_sort(pairs.begin(), pairs.end(), kByStamp);
  }
  return layout;
}

bool looks_like_tum(const fs::path& folder) {
  return is_file(folder / "associations.txt") || is_file(folder / "rgb.txt") || is_file(folder / "depth.txt");
}

core::Result<Layout> read_tum(const fs::path& folder, const LayoutOptions& options, core::Log& log) {
  const fs::path associations = folder / "associations.txt";
  auto layout =
      is_file(associations) ? read_associations(associations, log) : read_two_lists(folder, options, log);
  if (!layout) return layout;

  // A damaged truth does not prevent tracking
  if (is_file(folder / "groundtruth.txt")) {
    std::vector<std::string> notes;
    auto truth = read_trajectory(folder / "groundtruth.txt", &notes);
    for (const std::string& note : notes) log.warning(note);
    if (truth) {
      layout->truth = std::move(*truth);
    } else {
      log.warning(truth.error().message + "; the recording is used without truth");
    }
  }
  return layout;
}

}  // namespace

const LayoutFormat& tum_layout() {
  static const LayoutFormat format = {"tum",
                                      "TUM RGB-D, ETH3D",
                                      "associations.txt or rgb.txt and depth.txt",
                                      {"associations.txt|rgb.txt", "associations.txt|depth.txt"},
                                      &looks_like_tum,
                                      &read_tum};
  return format;
}

}  // namespace plumbline::dataset
