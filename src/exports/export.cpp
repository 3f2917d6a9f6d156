// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/exports/export.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "formats.hpp"
#include "plumbline/core/config.hpp"
#include "plumbline/core/text.hpp"
#include "plumbline/maps/output_check.hpp"
#include "source/georeference.hpp"

namespace plumbline::exports {
namespace {

/// Name of the content for `--what` and `--mesh`.
std::string content_name(Content content) {
  switch (content) {
    case Content::kCloud:
      return "cloud";
    case Content::kMesh:
      return "mesh";
    case Content::kTrajectory:
      return "trajectory";
    case Content::kKeyframes:
      return "keyframes";
    case Content::kLines:
      return "lines";
  }
  return "";
}

bool holds(const Format& format, Content content) {
  return std::find(format.contents.begin(), format.contents.end(), content) != format.contents.end();
}

/// Length of the format's longest ending that the name has; 0: none.
std::size_t fitting_ending(const Format& format, const std::string& name) {
  std::size_t longest = 0;
  for (const std::string& ending : format.endings) {
    const bool ends =
        name.size() >= ending.size() && name.compare(name.size() - ending.size(), ending.size(), ending) == 0;
    if (ends) longest = std::max(longest, ending.size());
  }
  return longest;
}

/// A format, and the part of the map that it will hold.
struct Choice {
  const Format* format = nullptr;
  Content content = Content::kCloud;
};

/// The format with this name, and the content that it will hold.
core::Result<Choice> chosen_by_name(const ExportRequest& request) {
  std::vector<std::string> names;
  for (const Format& format : formats()) {
    names.push_back(format.name);
    if (format.name != request.format) continue;
    if (holds(format, request.content)) return Choice{&format, request.content};
    if (request.content == Content::kCloud) return Choice{&format, format.contents.front()};
    return core::usage_error(
        fmt::format("--format {}: cannot hold the map's {}", format.name, content_name(request.content)));
  }
  return core::usage_error(fmt::format("--format {}: there is no such format{}", request.format,
                                       core::hint(request.format, names)));
}

core::Result<Choice> chosen_by_ending(const ExportRequest& request) {
  const std::string name = core::lower(request.output.filename().string());
  Choice best;
  std::size_t longest = 0;
  std::vector<std::string> endings;

  const bool folder = !request.output.has_extension();
  for (const Format& format : formats()) {
    if (folder && format.endings.empty() && holds(format, request.content))
      return Choice{&format, request.content};

    const std::size_t length = fitting_ending(format, name);
    const bool fits = holds(format, request.content);
    if (fits) endings.insert(endings.end(), format.endings.begin(), format.endings.end());

    // The requested content outweighs the content that the ending suggests.
    const std::size_t rank = length == 0 ? 0 : 2 * length + (fits ? 1 : 0);
    if (rank <= longest || (!fits && request.content != Content::kCloud)) continue;
    longest = rank;
    best = {&format, fits ? request.content : format.contents.front()};
  }

  const bool text_of_a_path = best.content != request.content && core::ending_of(request.output) == ".txt";
  if (best.format != nullptr && !text_of_a_path) return best;
  const bool path = request.content == Content::kTrajectory || request.content == Content::kKeyframes;
  if (folder && path) {
    return core::usage_error(
        fmt::format("{}: has no ending; for a folder with the path of each robot name the format too: "
                    "--format kitti -o {}",
                    request.output.string(), request.output.string()));
  }

  std::sort(endings.begin(), endings.end());
  endings.erase(std::unique(endings.begin(), endings.end()), endings.end());
  return core::usage_error(fmt::format(
      "{}: this ending is not that of a format for the map's {} (allowed: {}); or choose with --format",
      request.output.string(), content_name(request.content), fmt::join(endings, ", ")));
}

core::Result<Choice> chosen(const ExportRequest& request) {
  if (request.output.empty()) return core::usage_error("no output is named; name a file or a folder with -o");
  return request.format.empty() ? chosen_by_ending(request) : chosen_by_name(request);
}

std::string flag_of(std::string key) {
  std::replace(key.begin(), key.end(), '_', '-');
  return "--" + key;
}

/// Refuses options that the format does not take or that have no effect.
core::Result<void> check_options(const ExportRequest& request, const Choice& choice) {
  const Format& format = *choice.format;
  for (const std::string& key : request.given) {
    const auto in = [&](const std::vector<std::string>& keys) {
      return std::find(keys.begin(), keys.end(), key) != keys.end();
    };
    const bool of_meshes = key == "resolution" || key == "reach";
    const bool idle = of_meshes && holds(format, Content::kMesh) && choice.content != Content::kMesh;
    if ((in(format.options) || in(common_options())) && !idle) continue;
    std::vector<std::string> flags;
    for (const std::string& own : format.options) flags.push_back(flag_of(own));
    return core::usage_error(fmt::format(
        "{}: is not an option of {}{} (which takes {}{}--box, --z, --storey)", flag_of(key), format.name,
        idle ? " without --mesh" : "", fmt::join(flags, ", "), flags.empty() ? "" : ", "));
  }
  return {};
}

/// Endings as the table of formats shows them.
std::string ending_text(const Format& format) {
  return format.endings.empty() ? "folder" : fmt::format("{}", fmt::join(format.endings, " "));
}

}  // namespace

core::Result<void> check_export(const ExportRequest& request) {
  const auto choice = chosen(request);
  return choice ? check_options(request, *choice) : tl::unexpected(choice.error());
}

core::Result<ExportSummary> write_export(const ExportRequest& given, const core::Executor& executor,
                                         core::Log& log, const ExportProgress& progress) {
  const auto choice = chosen(given);
  if (!choice) return tl::unexpected(choice.error());
  if (auto fits = check_options(given, *choice); !fits) return tl::unexpected(fits.error());

  // Inputs must not be overwritten
  std::vector<std::filesystem::path> inputs(given.recordings.begin(), given.recordings.end());
  inputs.push_back(given.input);
  if (auto free = maps::check_output(given.output, inputs); !free) return tl::unexpected(free.error());

  // The format decides on the content
  ExportRequest request = given;
  request.content = choice->content;
  auto source = MapSource::open(request, executor, log, progress);
  if (!source) return tl::unexpected(source.error());
  auto summary = choice->format->write(*source, request.output);
  if (!summary) return summary;

  // A georeference of an earlier export would mislead
  if (request.options.datum.empty() && request.options.epsg == 0) remove_georeference(request.output);
  summary->format = choice->format->name;
  return summary;
}

/// The formats as users see them.
std::vector<FormatInfo> export_formats() {
  std::vector<FormatInfo> infos;
  for (const Format& format : formats()) {
    std::vector<std::string> contents;
    for (const Content content : format.contents) contents.push_back(content_name(content));
    infos.push_back({format.name, ending_text(format), fmt::format("{}", fmt::join(contents, ", ")),
                     format.needs, format.title, format.description, format.options});
  }
  return infos;
}

}  // namespace plumbline::exports
