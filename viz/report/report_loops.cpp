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

bool is_true(const Json& json, const char* key) {
  return json.is_object() && json.contains(key) && json[key].is_boolean() && json[key].get<bool>();
}

/// "found 0.61": a share in percent.
std::string percent(double share) { return number_text(100.0 * share, 0, "%"); }

HtmlTable trials_table(bool closed) {
  std::vector<Column> columns{{"keyframe", true},       {"looks like", true},     {"score", true},
                              {"matches", true},        {"points + lines", true}, {"rms (σ)", true},
                              {"found", true},          {"overlap", true},        {"contradiction", true},
                              {"correction (m)", true}, {"(deg)", true},          {"way (m)", true}};
  if (!closed) columns.push_back({"why it was refused"});
  return HtmlTable(std::move(columns));
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
  const auto count = [&](const std::string& place) { return count_text(number_at(m, place)); };
  const auto overlay = [&](const std::string& at) {
    return fmt::format("{} expected, {} found again ({} by chance), {} seen through", count(at + "/expected"),
                       count(at + "/matched"), count(at + "/chance"), count(at + "/seen_through"));
  };
  Facts facts{
      {"Decision", is_true(m, "accepted") ? "merged" : "not merged: " + text_at(m, "/reason")},
      {"Keyframes that look alike", fmt::format("{}; {} verified or refused, {} show the same place",
                                                count("/candidates"), count("/tried"), count("/verified"))},
      {"Keyframes that agree",
       fmt::format("{}; {} in the best other answer", count("/agreeing"), count("/alternative"))},
      {"Asked for confirmation",
       fmt::format("{}, of which {} confirmed", count("/expected"), count("/confirmed"))},
      {"Landmarks laid over each other", overlay("/overlay")},
      {"Matches", fmt::format("{} by descriptor; {} points and lines fit, rms {}", count("/matches"),
                              count("/inliers"), number_text(number_at(m, "/rms"), 2, "σ"))},
      {"Surfaces overlap", percent(number_at(m, "/overlap"))},
      {"Spread of the keyframes",
       fmt::format("{} and {} apart; they agree to {}", number_text(number_at(m, "/span_m"), 2, "m"),
                   number_text(kDegrees * number_at(m, "/span_rad"), 0, "deg"),
                   number_text(1e3 * number_at(m, "/spread_m"), 1, "mm"))},
      {"Pairs of the pose graph",
       fmt::format("{}, of which {} were taken for wrong", count("/pairs"), count("/rejected"))}};
  if (number_at(m, "/alternative_m") > 0.0) {
    facts.emplace_back("Best other answer", number_text(number_at(m, "/alternative_m"), 2, "m") + " off; " +
                                                overlay("/alternative_overlay"));
  }
  if (number_at(m, "/time_s") >= 0.0) {
    facts.emplace_back("Certain after", number_text(number_at(m, "/time_s"), 1, "s of the recordings"));
  }
  if (!list_at(m, "/sigma").empty()) {
    facts.emplace_back("Standard deviation of the placement",
                       fmt::format("{}, {}, {} along x, y, z; {}, {}, {} about them",
                                   number_text(1e3 * number_at(m, "/sigma/0"), 1, "mm"),
                                   number_text(1e3 * number_at(m, "/sigma/1"), 1, "mm"),
                                   number_text(1e3 * number_at(m, "/sigma/2"), 1, "mm"),
                                   number_text(kDegrees * number_at(m, "/sigma/3"), 2, "deg"),
                                   number_text(kDegrees * number_at(m, "/sigma/4"), 2, "deg"),
                                   number_text(kDegrees * number_at(m, "/sigma/5"), 2, "deg")));
  }
  return facts_html(facts);
}

std::string refused_pairs(const Json& merge) {
  const Json& refused = list_at(merge, "/refused");
  HtmlTable table({{"why pairs of keyframes were refused"}, {"pairs", true}});
  for (const auto& [why, count] : refused.items()) {
    if (count.is_number()) table.row({why, count_text(count.get<double>())});
  }
  return table.html();
}

/// Before and after all keyframes and landmarks were adjusted together.
std::string adjustment_html(const Json& s) {
  HtmlTable table({{"adjusted together"},
                   {"in all", true},
                   {"fitting before", true},
                   {"after", true},
                   {"rms of these before (σ)", true},
                   {"after (σ)", true}});
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
  HtmlTable table({{"what the keyframes saw"},
                   {"observations", true},
                   {"off by, median", true},
                   {"nine of ten within", true}});
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
                     number_text(1e3 * number_at(s, "/refine/sigma_position_m/p90"), 1, "mm"));
}

}  // namespace

std::string loops_html(const ReportData& data) {
  const Json& list = list_at(data.summary, "/loops/list");
  if (data.fused_afterwards && list.empty()) return {};  // closed when each map was made
  if (number_at(data.summary, "/loops/candidates") == 0.0 && list.empty()) {
    return paragraph("No keyframe looked like a place seen before: there was no loop to close.");
  }
  HtmlTable closed = trials_table(true), refused = trials_table(false);
  std::map<std::string, std::size_t> reasons;
  for (const Json& trial : list) {
    if (is_true(trial, "closed")) {
      add_trial(trial, closed);
      continue;
    }
    ++reasons[kind_of_reason(text_at(trial, "/reason"))];
    if (refused.rows() < kMostRows) add_trial(trial, refused);
  }
  const auto count = [&](const char* place) { return count_text(number_at(data.summary, place)); };
  std::string out = paragraph(fmt::format(
      "{} candidates, {} verified; loops moved the map {} times; the pose graph took {} for wrong.",
      count("/loops/candidates"), count("/loops/verified"), count("/loops/accepted"),
      count("/loops/rejected")));
  if (closed.rows() > 0) out += "<h3>Closed</h3>\n" + closed.html();
  HtmlTable why({{"why candidates were refused"}, {"times", true}});
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

std::string merges_html(const ReportData& data) {
  const Json& list = list_at(data.summary, "/merges");
  if (list.empty()) return {};
  HtmlTable overview({{"maps"},
                      {""},
                      {"look alike", true},
                      {"verified", true},
                      {"agreeing", true},
                      {"confirmed", true},
                      {"landmarks found again", true},
                      {"why not"}});
  std::string details;
  for (const Json& m : list) {
    const bool accepted = is_true(m, "accepted");
    const std::string names = text_at(m, "/a") + " and " + text_at(m, "/b");
    const auto count = [&](const char* place) { return count_text(number_at(m, place)); };
    overview.row({names, accepted ? "merged" : "not merged", count("/candidates"), count("/verified"),
                  count("/agreeing"), count("/confirmed") + " of " + count("/expected"),
                  count("/overlay/matched") + " of " + count("/overlay/expected"), text_at(m, "/reason")},
                 accepted ? "yes" : "bad");
    details +=
        folded("Evidence: " + names, merge_evidence(m) + refused_pairs(m), list.size() <= kShownMerges);
  }
  return overview.html() + details;
}

/// What the maps say of their cameras; empty: none was asked, or none could tell.
static std::string cameras_html(const Json& s) {
  HtmlTable table(
      {{"camera of"}, {"parameter"}, {"given", true}, {"found", true}, {"±", true}, {"gain", true}, {""}});
  for (const Json& camera : list_at(s, "/camera")) {
    const double from = number_at(camera, "/from_frame");
    const std::string used = from > 0.0 ? fmt::format("used from frame {:.0f} on", from) : "used";
    for (const Json& n : list_at(camera, "/numbers")) {
      const auto number = [&](const char* place) { return fmt::format("{:.5g}", number_at(n, place)); };
      table.row({text_at(camera, "/robot"), text_at(n, "/name"), number("/given"), number("/found"),
                 fmt::format("{:.2g}", number_at(n, "/sigma")),
                 number_text(100.0 * number_at(n, "/gain"), 1, "%"), is_true(n, "used") ? used : "not used"});
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
  const auto count = [&](const char* place) { return count_text(number_at(s, place)); };
  std::string out = facts_html(
      {{"Local maps", count("/refine/local_maps")},
       {"Alignments of their surfaces",
        fmt::format("{} tried, {} used; the pose graph took {} of them for wrong", count("/refine/tried"),
                    count("/refine/accepted"), count("/refine/rejected"))},
       {"Mean rms of the surfaces aligned",
        number_text(number_at(s, "/refine/mean_rms"), 2, "σ of the depth noise")},
       {"Keyframes moved", fmt::format("{} on average, {} at most",
                                       number_text(1e3 * number_at(s, "/refine/mean_shift_m"), 1, "mm"),
                                       number_text(1e3 * number_at(s, "/refine/max_shift_m"), 1, "mm"))},
       {"Standard deviation of keyframes beside the first", sigma_text(s)}});
  out += adjustment_html(s);
  HtmlTable depth({{"depth camera"},
                   {"correction"},
                   {"samples", true},
                   {"residual before (σ)", true},
                   {"after (σ)", true},
                   {"at most, at 2 m (mm)", true}});
  for (const Json& d : list_at(s, "/depth_fields")) {
    const std::string robot = text_at(d, "/robot");
    depth.row({robot.empty() ? "the only one" : robot, is_true(d, "used") ? "found and used" : "none needed",
               count_text(number_at(d, "/samples")), number_text(number_at(d, "/before"), 3),
               number_text(number_at(d, "/after"), 3), number_text(1e3 * number_at(d, "/most_at_2m"), 1)});
  }
  if (depth.rows() > 0) out += "<h3>Systematic error of the depth cameras</h3>\n" + depth.html();
  return out + cameras_html(s) + fit_html(data);
}

}  // namespace plumbline::report
