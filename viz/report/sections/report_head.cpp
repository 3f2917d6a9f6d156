// SPDX-License-Identifier: BSD-3-Clause
// The head of a report: what it is and whether to trust it.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "report_fill.hpp"
#include "report_sections.hpp"

namespace plumbline::report {
namespace {

std::string duration_text(double seconds) {
  if (!(seconds >= 60.0)) return number_text(seconds, 1, "s");
  const auto whole = static_cast<long>(std::lround(seconds));
  return fmt::format("{} min {:02} s", whole / 60, whole % 60);
}

std::string banner(const char* kind, const std::string& title, const std::string& text) {
  return fmt::format("<div class=\"verdict {}\"><b>{}</b>{}</div>\n", kind, viz::markup_text(title),
                     text.empty() ? text : paragraph(text));
}

/// "; shows nothing: 9, a direction is free: 3"
std::string reasons_text(const nlohmann::ordered_json& summary) {
  const nlohmann::ordered_json::json_pointer place("/frames/lost_by");
  if (!summary.contains(place)) return {};

  std::string text;
  for (const auto& [reason, count] : summary.at(place).items())
    text += (text.empty() ? "; " : ", ") + reason + ": " + count_text(count.get<double>());
  return text;
}

std::string verdict_html(const ReportData& data) {
  const auto& s = data.summary;
  const double without = number_at(s, "/frames/lost") + number_at(s, "/frames/unreadable");
  const std::string sentence = text_at(s, "/verdict/sentence");

  // The verdict, then what limits it.
  std::string out;
  if (!flag_at(s, "/trustworthy")) {
    const std::string reason = text_at(s, "/reason");
    out += banner("bad", "Not trustworthy (exit code 4)",
                  reason.empty() ? "The run gave no reason." : "Reason: " + reason + ".");

  } else if (without > 0.0) {
    out += banner("warn", "Trustworthy, with gaps (exit code 0)",
                  fmt::format("{} {} of {} frames have no pose; the longest loss is {} frames{}.", sentence,
                              count_text(without),
                              count_text(number_at(s, "/frames/read") + number_at(s, "/frames/unreadable")),
                              count_at(s, "/frames/longest_loss"), reasons_text(s)));

  } else {
    out += banner("good", "Trustworthy (exit code 0)",
                  sentence +
                      " The run found no reason to doubt this result; ± is of its shape, as a scale that is "
                      "wrong changes nothing but lengths.");
  }

  // Limits that hold for any verdict.
  if (flag_at(s, "/stopped")) {
    out += banner("warn", "Stopped early",
                  fmt::format("The run was ended after {} of {} frames; this is what was mapped by then.",
                              count_text(number_at(s, "/frames/read") + number_at(s, "/frames/unreadable")),
                              count_at(s, "/frames/available")));
  }

  if (!data.kind.empty()) out += banner("warn", "Only map.db", "The " + data.kind + ".");

  // Parts that could not be read.
  if (!data.missing.empty()) {
    std::string list;
    for (const std::string& line : data.missing) list += "<li>" + viz::markup_text(line) + "</li>";
    out += "<div class=\"verdict warn\"><b>Missing in this report</b><ul>" + list + "</ul></div>\n";
  }

  return out;
}

std::string extent_text(const ReportData& data) {
  if (!data.extent) return number_text(NAN, 0);
  const Eigen::Vector3d size = data.extent->central_size();
  return fmt::format("{:.1f} × {:.1f} × {:.1f} m", size.x(), size.y(), size.z());
}

std::string figures_html(const ReportData& data) {
  const auto& s = data.summary;
  double length_m = 0.0;
  for (const ReportPath& path : data.paths) length_m += path.length_m();
  return tiles_html({{"of the frames tracked", number_text(number_at(s, "/frames/tracked_percent"), 1, "%")},
                     {"path", number_text(length_m, 2, "m")},
                     {"keyframes", count_at(s, "/keyframes")},
                     {"cloud points", count_at(s, "/cloud/points")},
                     {"extent without the outer 0.5 %", extent_text(data)},
                     data.fused_afterwards
                         ? std::pair{std::string("to fuse"), filled(s, "{/timing/wall_s:1 s}")}
                         : std::pair{std::string("frames a second"), filled(s, "{/timing/fps:1}")}});
}

/// Frames read and tracked, with exceptions if there are any.
std::string frames_text(const ReportData& data) {
  const auto& s = data.summary;
  std::string text = filled(s, "{/frames/read} of {/frames/available} read, {/frames/tracked} tracked");
  if (number_at(s, "/frames/lost") > 0) text += filled(s, ", {/frames/lost} lost");
  if (number_at(s, "/frames/unreadable") > 0) text += filled(s, ", {/frames/unreadable} unreadable");
  if (number_at(s, "/frames/missing") > 0) text += filled(s, ", {/frames/missing} missing in the recording");
  if (number_at(s, "/frames/resumed") > 0)
    text += filled(s, "; {/frames/resumed} of them by the run that this one continued");
  return text;
}

/// Axes and origin of the results.
std::string frame_of_results(const ReportData& data) {
  const std::string up = text_at(data.summary, "/frame/up");
  const std::string x =
      text_at(data.summary, "/frame/yaw") == "walls" ? ", x along the walls; metres" : "; metres";
  if (up == "floor") return "z up, 0 on the floor" + x;
  if (up == "camera") return "z up as the cameras were held" + x;
  return up.empty() ? up : "that of the first camera: x right, y down, z forward; metres";
}

/// Robots in the result, and those that were mapped but left out.
std::string robots_text(const ReportData& data) {
  std::string in, out;
  const auto is_in = [&](const std::string& name) {
    return std::any_of(data.paths.begin(), data.paths.end(), [&](const auto& p) { return p.robot == name; });
  };
  for (const ReportPath& path : data.paths) in += (in.empty() ? "" : ", ") + path.robot;
  for (const ReportFrames& frames : data.frames) {
    if (!is_in(frames.robot)) out += (out.empty() ? "" : ", ") + frames.robot;
  }
  return out.empty() ? in : in + "; mapped, but not in the result: " + out;
}

/// Mistakes that the run looked for, and what is not checked.
std::string mistakes_text(const nlohmann::ordered_json& s) {
  std::string found, unchecked;
  std::size_t tested = 0;
  for (const auto& sign : list_at(s, "/signs")) {
    ++tested;
    const std::string text = text_at(sign, "/text"), certainty = text_at(sign, "/certainty");
    if (!text.empty()) found += fmt::format("{} ({}); ", text, certainty);
  }
  for (const auto& what : list_at(s, "/unchecked"))
    unchecked += (unchecked.empty() ? "" : ", ") + text_at(what, "");
  if (found.empty()) found = fmt::format("none of {} that were looked for; ", tested);
  return found + "unchecked: " + (unchecked.empty() ? "nothing" : unchecked);
}

std::string facts(const ReportData& data) {
  const auto& s = data.summary;
  return facts_html({{"Input", text_at(s, "/input")},
                     {"Robots", robots_text(data)},
                     {"Frames", frames_text(data)},
                     {"Mistakes", mistakes_text(s)},
                     {"Duration of the recording", duration_text(data.end_s - data.start_s)},
                     {"Pipeline", text_at(s, "/pipeline")},
                     {"Frame of the results", frame_of_results(data)},
                     {"Landmarks", filled(s, "{/landmarks/points} points, {/landmarks/lines} lines")},
                     {"Threads", filled(s, "{/timing/threads}")},
                     {"Version", "plumbline " + text_at(s, "/version")}});
}

/// The logo as a part of the page.
core::Result<std::string> logo_html(const std::filesystem::path& file) {
  if (file.empty()) return std::string();
  const std::string bytes = read_bytes(file);
  const std::string kind = bytes.rfind("\x89PNG", 0) == 0              ? "png"
                           : bytes.rfind("\xFF\xD8", 0) == 0           ? "jpeg"
                           : bytes.find("</svg>") != std::string::npos ? "svg+xml"
                                                                       : "";
  if (kind.empty())
    return core::input_error(
        fmt::format("{}: is not a PNG, JPEG or SVG picture, which a logo must be", file.string()));
  return fmt::format("<img class=\"logo\" alt=\"\" src=\"data:image/{};base64,{}\"/>\n", kind, base64(bytes));
}

}  // namespace

std::string lost_html(const ReportData& data) {
  constexpr std::size_t kMost = 20;
  std::vector<LostStretch> stretches = data.lost;
  const auto longer = [](const LostStretch& a, const LostStretch& b) {
    return a.lost + a.unreadable > b.lost + b.unreadable;
  };

  // Longest first, up to a limit.
  std::stable_sort(stretches.begin(), stretches.end(), longer);
  std::string columns = ">from (s)|>to (s)|>frames|>lost|>unreadable|>between the poses around (m)";
  const bool several = data.frames.size() > 1;
  if (several) columns += "|robot";

  // One row per stretch.
  HtmlTable table(columns);
  for (std::size_t i = 0; i < std::min(kMost, stretches.size()); ++i) {
    const LostStretch& l = stretches[i];
    const auto number = [](std::size_t n) { return count_text(static_cast<double>(n)); };
    table.row({number_text(l.from_s, 2), number_text(l.to_s, 2), number(l.lost + l.unreadable),
               number(l.lost), number(l.unreadable), number_text(l.gap_m, 3), l.robot});
  }

  // The rest is only counted.
  std::string out = table.html();
  if (stretches.size() > kMost)
    out += note(fmt::format("The {} longest of {} stretches.", kMost, stretches.size()));
  return out;
}

std::string run_html(const ReportData& data) {
  const std::string lost = lost_html(data);
  return (lost.empty() ? "" : "<h3>Stretches without a pose, the longest first</h3>\n" + lost) +
         figures_html(data) + facts(data);
}

core::Result<std::string> head_html(const ReportData& data, const ReportRequest& request) {
  auto logo = logo_html(request.logo);
  if (!logo) return logo;
  const std::string title = request.title.empty() ? data.name : request.title;
  return "<header>" + *logo + "<p class=\"kicker\">Plumbline report</p><h1>" + viz::markup_text(title) +
         "</h1>\n" +
         facts_html({{"Client", request.client}, {"Address", request.address}, {"Recorded", request.date}}) +
         verdict_html(data) + data.plan_html + "</header>\n";
}

}  // namespace plumbline::report
