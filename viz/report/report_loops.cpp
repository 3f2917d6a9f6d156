// SPDX-License-Identifier: BSD-3-Clause
// Loops and merges of robots' maps, with the evidence and why others were refused; refinement.
#include <fmt/format.h>

#include <cmath>
#include <map>

#include "report_sections.hpp"

namespace plumbline::report {
namespace {

using Json = nlohmann::ordered_json;
constexpr std::size_t kMostRows = 300;
constexpr std::size_t kShownMerges = 3;  ///< so few need not be folded
constexpr double kDegrees = 180.0 / M_PI;

/// "found 0.61": a share in percent.
std::string percent(double share) { return number_text(100.0 * share, 0, "%"); }

HtmlTable trials_table(bool closed) {
  std::string columns =
      ">keyframe|>looks like|>score|>matches|>points + lines|>rms (σ)|>found|>overlap|>contradiction"
      "|>correction (m)|>(deg)|>way (m)";
  if (!closed) columns += "|why it was refused";
  return HtmlTable(columns);
}

void add_trial(const Json& trial, HtmlTable& table) {
  const auto number = [&](const char* place, int decimals) {
    return number_text(number_at(trial, place), decimals);
  };
  table.row({number("/query", 0), number("/match", 0), number("/score", 3), number("/matches", 0),
             number("/points", 0) + " + " + number("/lines", 0), number("/rms", 2),
             percent(number_at(trial, "/found")), percent(number_at(trial, "/overlap")),
             percent(number_at(trial, "/contradiction")), number("/correction_m", 3),
             number_text(kDegrees * number_at(trial, "/correction_rad"), 2), number("/path_m", 2),
             text_at(trial, "/reason")});
}

/// "no pose from 106 points and 18 lines" and the like are one reason.
std::string kind_of_reason(const std::string& reason) {
  const std::size_t end = reason.find_first_of("0123456789:;,(");
  std::string kind = reason.substr(0, end);
  while (!kind.empty() && kind.back() == ' ') kind.pop_back();
  if (kind.size() > 5 && kind.substr(kind.size() - 5) == " from") kind.resize(kind.size() - 5);
  return kind.empty() ? "passed, but not confirmed" : kind;
}

std::string merge_evidence(const Json& m) {
  const auto overlay = [&](const std::string& at) {
    return fmt::format("{} expected, {} found again ({} by chance), {} seen through",
                       count_at(m, at + "/expected"), count_at(m, at + "/matched"),
                       count_at(m, at + "/chance"), count_at(m, at + "/seen_through"));
  };

  Facts facts{
      {"Decision", flag_at(m, "/accepted") ? "merged" : "not merged: " + text_at(m, "/reason")},
      {"Keyframes that look alike",
       fmt::format("{}; {} verified or refused, {} show the same place", count_at(m, "/candidates"),
                   count_at(m, "/tried"), count_at(m, "/verified"))},
      {"Keyframes that agree",
       fmt::format("{}; {} in the best other answer", count_at(m, "/agreeing"), count_at(m, "/alternative"))},
      {"Asked for confirmation",
       fmt::format("{}, of which {} confirmed", count_at(m, "/expected"), count_at(m, "/confirmed"))},
      {"Landmarks laid over each other", overlay("/overlay")},
      {"Matches", fmt::format("{} by descriptor; {} points and lines fit, rms {}", count_at(m, "/matches"),
                              count_at(m, "/inliers"), number_text(number_at(m, "/rms"), 2, "σ"))},
      {"Surfaces overlap", percent(number_at(m, "/overlap"))},
      {"Spread of the keyframes",
       fmt::format("{} and {} apart; they agree to {}", number_text(number_at(m, "/span_m"), 2, "m"),
                   number_text(kDegrees * number_at(m, "/span_rad"), 0, "deg"), mm_at(m, "/spread_m"))},
      {"Pairs of the pose graph",
       fmt::format("{}, of which {} were taken for wrong", count_at(m, "/pairs"), count_at(m, "/rejected"))}};

  if (number_at(m, "/alternative_m") > 0.0) {
    facts.emplace_back("Best other answer", number_text(number_at(m, "/alternative_m"), 2, "m") + " off; " +
                                                overlay("/alternative_overlay"));
  }

  if (number_at(m, "/time_s") >= 0.0) {
    facts.emplace_back("Certain after", number_text(number_at(m, "/time_s"), 1, "s of the recordings"));
  }

  if (!list_at(m, "/sigma").empty()) {
    facts.emplace_back("Standard deviation of the placement",
                       fmt::format("{}, {}, {} along x, y, z; {}, {}, {} about them", mm_at(m, "/sigma/0"),
                                   mm_at(m, "/sigma/1"), mm_at(m, "/sigma/2"),
                                   number_text(kDegrees * number_at(m, "/sigma/3"), 2, "deg"),
                                   number_text(kDegrees * number_at(m, "/sigma/4"), 2, "deg"),
                                   number_text(kDegrees * number_at(m, "/sigma/5"), 2, "deg")));
  }

  return facts_html(facts);
}

std::string refused_pairs(const Json& merge) {
  const Json& refused = list_at(merge, "/refused");
  HtmlTable table("why pairs of keyframes were refused|>pairs");
  for (const auto& [why, count] : refused.items()) {
    if (count.is_number()) table.row({why, count_text(count.get<double>())});
  }
  return table.html();
}

/// Before and after all keyframes and landmarks were adjusted together.
std::string adjustment_html(const Json& s) {
  HtmlTable table("adjusted together|>in all|>fitting before|>after|>rms of these before (σ)|>after (σ)");
  for (const auto& [name, what] :
       {std::pair{"points", "points"}, std::pair{"lines", "lines"},
        std::pair{"edges", "keyframes to each other: surfaces, alignments, loops"}}) {
    const Json& before = list_at(s, std::string("/refine/before/") + name);
    const Json& after = list_at(s, std::string("/refine/after/") + name);
    if (after.empty()) continue;
    const double all = number_at(after, "/all");
    table.row({what, count_text(all), percent(number_at(before, "/fitting") / all),
               percent(number_at(after, "/fitting") / all), number_text(number_at(before, "/rms"), 2),
               number_text(number_at(after, "/rms"), 2)});
  }
  return table.html();
}

/// Distances of what the keyframes saw from where the finished map has it.
std::string fit_html(const ReportData& data) {
  if (!data.fit) return {};
  HtmlTable table("what the keyframes saw|>observations|>off by, median|>nine of ten within");
  const auto add = [&](const char* name, const FamilyFit& fit, int decimals, const char* unit) {
    if (fit.observations == 0) return;
    table.row({name, count_text(static_cast<double>(fit.observations)),
               number_text(fit.median, decimals, unit), number_text(fit.p90, decimals, unit)});
  };
  add("Points, in the picture", data.fit->points_px, 2, "px");
  add("Points, depth", data.fit->depths_mm, 1, "mm");
  add("Ends of lines, across the line", data.fit->lines_px, 2, "px");
  return table.rows() == 0 ? "" : "<h3>How well the finished map fits</h3>\n" + table.html();
}

std::string sigma_text(const Json& s) {
  const double median_m = number_at(s, "/refine/sigma_position_m/median");
  if (!(median_m > 0.0)) return "not known";
  return fmt::format("{} in the middle, below {} for 90 % of them", number_text(1e3 * median_m, 1, "mm"),
                     mm_at(s, "/refine/sigma_position_m/p90"));
}

std::string closings_html(const ReportData& data) {
  const Json& list = list_at(data.summary, "/loops/list");
  if (data.fused_afterwards && list.empty()) return {};  // closed when each map was made
  if (number_at(data.summary, "/loops/candidates") == 0.0 && list.empty()) {
    return paragraph("No keyframe looked like a place seen before: there was no loop to close.");
  }

  HtmlTable closed = trials_table(true), refused = trials_table(false);
  std::map<std::string, std::size_t> reasons;
  for (const Json& trial : list) {
    if (flag_at(trial, "/closed")) {
      add_trial(trial, closed);
      continue;
    }
    ++reasons[kind_of_reason(text_at(trial, "/reason"))];
    if (refused.rows() < kMostRows) add_trial(trial, refused);
  }

  std::string out = paragraph(fmt::format(
      "{} candidates, {} verified; loops moved the map {} times; the pose graph took {} for wrong.",
      count_at(data.summary, "/loops/candidates"), count_at(data.summary, "/loops/verified"),
      count_at(data.summary, "/loops/accepted"), count_at(data.summary, "/loops/rejected")));
  if (closed.rows() > 0) out += "<h3>Closed</h3>\n" + closed.html();

  HtmlTable why("why candidates were refused|>times");
  for (const auto& [reason, times] : reasons) why.row({reason, count_text(static_cast<double>(times))});
  out += why.html();
  if (refused.rows() > 0)
    out += folded(fmt::format("Each refused candidate ({})", refused.rows()), refused.html());
  if (list.empty()) return out;

  return out +
         note(
             "Found: landmarks of the match that are where they should be. Overlap and contradiction: of the "
             "surfaces. Correction: how far closing the loop would move the keyframe, after the way since.");
}

/// Report of a robot that received the maps of others.
std::string feedback_html(const Json& summary) {
  if (!flag_at(summary, "/feedback/on")) return {};
  return "<h3>By maps of other robots</h3>\n" +
         facts_html({{"Keyframes received", count_at(summary, "/feedback/keyframes_received")},
                     {"Frames relocalised", count_at(summary, "/feedback/relocalised")},
                     {"Loops that moved the map", count_at(summary, "/feedback/loops")}}) +
         note(text_at(summary, "/feedback/note"));
}

}  // namespace

std::string loops_html(const ReportData& data) { return closings_html(data) + feedback_html(data.summary); }

std::string merges_html(const ReportData& data) {
  const Json& list = list_at(data.summary, "/merges");
  if (list.empty()) return {};
  HtmlTable overview("maps||>look alike|>verified|>agreeing|>confirmed|>landmarks found again|why not");
  std::string details;
  for (const Json& m : list) {
    const bool accepted = flag_at(m, "/accepted");
    const std::string names = text_at(m, "/a") + " and " + text_at(m, "/b");
    overview.row(
        {names, accepted ? "merged" : "not merged", count_at(m, "/candidates"), count_at(m, "/verified"),
         count_at(m, "/agreeing"), count_at(m, "/confirmed") + " of " + count_at(m, "/expected"),
         count_at(m, "/overlay/matched") + " of " + count_at(m, "/overlay/expected"), text_at(m, "/reason")},
        accepted ? "yes" : "bad");
    details +=
        folded("Evidence: " + names, merge_evidence(m) + refused_pairs(m), list.size() <= kShownMerges);
  }
  return overview.html() + details;
}

/// Report of camera refinement; empty: it was not done, or found nothing.
static std::string cameras_html(const Json& s) {
  HtmlTable table("camera of|parameter|>given|>found|>±|>gain|");
  for (const Json& camera : list_at(s, "/camera")) {
    const double from = number_at(camera, "/from_frame");
    const std::string used = from > 0.0 ? fmt::format("used from frame {:.0f} on", from) : "used";
    for (const Json& n : list_at(camera, "/numbers")) {
      const auto number = [&](const char* place) { return fmt::format("{:.5g}", number_at(n, place)); };
      table.row({text_at(camera, "/robot"), text_at(n, "/name"), number("/given"), number("/found"),
                 fmt::format("{:.2g}", number_at(n, "/sigma")),
                 number_text(100.0 * number_at(n, "/gain"), 1, "%"),
                 flag_at(n, "/used") ? used : "not used"});
    }
  }
  return table.rows() > 0 ? "<h3>Cameras</h3>\n" + table.html() : "";
}

std::string refinement_html(const ReportData& data) {
  const Json& s = data.summary;
  const double maps = number_at(s, "/refine/local_maps");
  if (!(maps > 0.0) && !(number_at(s, "/refine/max_shift_m") > 0.0)) {
    return paragraph(
               "The map was not refined as a whole: there was nothing to align, or the stage was off.") +
           cameras_html(s) + fit_html(data);
  }

  std::string out = facts_html(
      {{"Local maps", count_at(s, "/refine/local_maps")},
       {"Alignments of their surfaces",
        fmt::format("{} tried, {} used; the pose graph took {} of them for wrong",
                    count_at(s, "/refine/tried"), count_at(s, "/refine/accepted"),
                    count_at(s, "/refine/rejected"))},
       {"Mean rms of the surfaces aligned",
        number_text(number_at(s, "/refine/mean_rms"), 2, "σ of the depth noise")},
       {"Keyframes moved", fmt::format("{} on average, {} at most", mm_at(s, "/refine/mean_shift_m"),
                                       mm_at(s, "/refine/max_shift_m"))},
       {"Standard deviation of keyframes beside the first", sigma_text(s)}});

  out += adjustment_html(s);
  return out + cameras_html(s) + fit_html(data);
}

}  // namespace plumbline::report
