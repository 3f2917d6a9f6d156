// SPDX-License-Identifier: BSD-3-Clause
// Loops and merges of robots' maps, with the evidence and why others were refused; refinement.
#include <fmt/format.h>

#include <cmath>
#include <map>

#include "report_fill.hpp"
#include "report_sections.hpp"

namespace plumbline::report {
namespace {

using Json = nlohmann::ordered_json;
constexpr std::size_t kMostRows = 300;
constexpr std::size_t kShownMerges = 3;  ///< so few need not be folded

/// Attempts to close a loop, one per row.
JsonTable trials_table(bool closed) {
  std::vector<std::pair<const char*, const char*>> columns{{">keyframe", "{/query:0}"},
                                                           {">looks like", "{/match:0}"},
                                                           {">score", "{/score:3}"},
                                                           {">matches", "{/matches:0}"},
                                                           {">points + lines", "{/points:0} + {/lines:0}"},
                                                           {">rms (σ)", "{/rms:2}"},
                                                           {">found", "{/found:0 %}"},
                                                           {">overlap", "{/overlap:0 %}"},
                                                           {">contradiction", "{/contradiction:0 %}"},
                                                           {">correction (m)", "{/correction_m:3}"},
                                                           {">(deg)", "{/correction_rad:2deg}"},
                                                           {">way (m)", "{/path_m:2}"}};
  if (!closed) columns.emplace_back("why it was refused", "{/reason:text}");
  return JsonTable(columns);
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
  Facts facts = filled_facts(
      m, {{"Keyframes that look alike",
           "{/candidates}; {/tried} verified or refused, {/verified} show the same place"},
          {"Keyframes that agree", "{/agreeing}; {/alternative} in the best other answer"},
          {"Asked for confirmation", "{/expected}, of which {/confirmed} confirmed"},
          {"Landmarks of the aligned maps",
           "{/overlay/expected} expected, {/overlay/matched} found again ({/overlay/chance} by chance), "
           "{/overlay/seen_through} seen through"},
          {"Matches", "{/matches} by descriptor; {/inliers} points and lines fit, rms {/rms:2 σ}"},
          {"Surfaces overlap", "{/overlap:0 %}"},
          {"Spread of the keyframes",
           "{/span_m:2 m} and {/span_rad:0 deg} apart; they agree to {/spread_m:1 mm}"},
          {"Pairs of the pose graph", "{/pairs}, of which {/rejected} were rejected"}});

  // The decision comes first.
  facts.insert(facts.begin(),
               {"Decision", flag_at(m, "/accepted") ? "merged" : "not merged: " + text_at(m, "/reason")});

  // The best alternative, for places that are alike.
  if (number_at(m, "/alternative_m") > 0.0) {
    facts.emplace_back("Best other answer",
                       filled(m,
                              "{/alternative_m:2 m} off; {/alternative_overlay/expected} expected, "
                              "{/alternative_overlay/matched} found again ({/alternative_overlay/chance} by "
                              "chance), {/alternative_overlay/seen_through} seen through"));
  }

  // Time and accuracy of the merge.
  if (number_at(m, "/time_s") >= 0.0)
    facts.emplace_back("Certain after", filled(m, "{/time_s:1 s of the recordings}"));
  if (!list_at(m, "/sigma").empty()) {
    facts.emplace_back("Standard deviation of the placement",
                       filled(m,
                              "{/sigma/0:1 mm}, {/sigma/1:1 mm}, {/sigma/2:1 mm} along x, y, z; "
                              "{/sigma/3:2 deg}, {/sigma/4:2 deg}, {/sigma/5:2 deg} about them"));
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
    const auto fitting = [all](const Json& family) {
      return number_text(100.0 * number_at(family, "/fitting") / all, 0, "%");
    };
    table.row({what, count_text(all), fitting(before), fitting(after), filled(before, "{/rms:2}"),
               filled(after, "{/rms:2}")});
  }
  return table.html();
}

/// Distances of the keyframes' observations from the landmarks of the finished map.
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
  return table.rows() == 0 ? "" : "<h3>Fit of the finished map</h3>\n" + table.html();
}

/// Standard deviation of the keyframes, and why that of some or all is not known.
std::string sigma_text(const Json& s) {
  const std::string why = text_at(s, "/refine/sigma_note");
  if (!(number_at(s, "/refine/sigma_position_m/median") > 0.0))
    return why.empty() ? "not known" : "not known: " + why;
  const std::string known = filled(s,
                                   "{/refine/sigma_position_m/median:1 mm} in the middle, below "
                                   "{/refine/sigma_position_m/p90:1 mm} for 90 % of them");
  return why.empty() ? known : known + "; not known of all: " + why;
}

/// Loops that agree with one another against the path.
std::string disputes_html(const ReportData& data) {
  JsonTable table({{">loops that agree", "{/loops}"},
                   {">keyframe", "{/query}"},
                   {">beside keyframe", "{/match}"},
                   {">points", "{/points}"},
                   {">lines", "{/lines}"},
                   {">off", "{/correction_m:2 m}"},
                   {">after", "{/path_m:1 m}"}});
  for (const Json& dispute : list_at(data.summary, "/loops/disputes")) table.row(dispute, {}, "bad");
  return "<h3>Against the path</h3>\n" + table.html() +
         note(
             "These loops are more than drift explains, and agree with one another: the path is wrong "
             "between the two keyframes, or two places look alike.");
}

std::string closings_html(const ReportData& data) {
  const Json& list = list_at(data.summary, "/loops/list");
  if (data.fused_afterwards && list.empty()) return {};  // closed when each map was made
  if (number_at(data.summary, "/loops/candidates") == 0.0 && list.empty()) {
    return paragraph("No keyframe looked like a place seen before: there was no loop to close.");
  }

  // Closed loops, and reasons of the others.
  JsonTable closed = trials_table(true), refused = trials_table(false);
  std::map<std::string, std::size_t> reasons;
  for (const Json& trial : list) {
    if (flag_at(trial, "/closed")) {
      closed.row(trial);
      continue;
    }

    // Reasons are counted by kind.
    ++reasons[kind_of_reason(text_at(trial, "/reason"))];
    if (refused.rows() < kMostRows) refused.row(trial);
  }

  // Counts first, then disputes and closed loops.
  std::string out =
      paragraph(filled(data.summary,
                       "{/loops/candidates} candidates, {/loops/verified} verified; loops moved the map "
                       "{/loops/accepted} times; the pose graph rejected {/loops/rejected}."));
  if (!list_at(data.summary, "/loops/disputes").empty()) out += disputes_html(data);
  if (closed.rows() > 0) out += "<h3>Closed</h3>\n" + closed.html();

  // Counts of reasons, then each trial.
  HtmlTable why("why candidates were refused|>times");
  for (const auto& [reason, times] : reasons) why.row({reason, count_text(static_cast<double>(times))});
  out += why.html();
  if (refused.rows() > 0)
    out += folded(fmt::format("Each refused candidate ({})", refused.rows()), refused.html());
  if (list.empty()) return out;

  // Terms of the tables.
  return out +
         note(
             "Found: landmarks of the match that are where they should be. Overlap and contradiction: of the "
             "surfaces. Correction: how far closing the loop would move the keyframe, after the way since.");
}

/// Report of a robot that received the maps of others.
std::string feedback_html(const Json& summary) {
  if (!flag_at(summary, "/feedback/on")) return {};
  return "<h3>By maps of other robots</h3>\n" +
         facts_html(filled_facts(summary, {{"Keyframes received", "{/feedback/keyframes_received}"},
                                           {"Frames relocalised", "{/feedback/relocalised}"},
                                           {"Loops that moved the map", "{/feedback/loops}"}})) +
         note(text_at(summary, "/feedback/note"));
}

/// Cameras that are fixed to each other on one robot: their poses, and the evidence of those that were found.
std::string rig_html(const Json& summary) {
  const Json& cameras = list_at(summary, "/rig/cameras");
  if (cameras.empty()) return {};
  JsonTable table({{"camera", "{/name:text}"},
                   {"pose", "{/pose:text}"},
                   {">x", "{/position/0:1 mm}"},
                   {">y", "{/position/1:1 mm}"},
                   {">z", "{/position/2:1 mm}"},
                   {">± x", "{/sigma_position_m/0:1 mm}"},
                   {">± y", "{/sigma_position_m/1:1 mm}"},
                   {">± z", "{/sigma_position_m/2:1 mm}"},
                   {">motions", "{/motions}"},
                   {">off", "{/residual_m:1 mm}"},
                   {">pairs", "{/pairs}"}});

  for (const Json& camera : cameras) table.row(camera);
  return "<h3>Cameras of one robot</h3>\n" + table.html() +
         note(filled(summary,
                     "Places are in the axes of {/rig/reference:text} (x right, y down, z ahead). Off: "
                     "by which the motions of both over 1 s differ. Pairs: keyframes that are tied."));
}

}  // namespace

std::string loops_html(const ReportData& data) { return closings_html(data) + feedback_html(data.summary); }

std::string merges_html(const ReportData& data) {
  const Json& list = list_at(data.summary, "/merges");
  if (list.empty()) return {};

  // One row per merge.
  JsonTable overview({{"maps", ""},
                      {"", ""},
                      {">look alike", "{/candidates}"},
                      {">verified", "{/verified}"},
                      {">agreeing", "{/agreeing}"},
                      {">confirmed", "{/confirmed} of {/expected}"},
                      {">landmarks found again", "{/overlay/matched} of {/overlay/expected}"},
                      {">log-odds: one place", "{/overlay/log_odds:1}"},
                      {">no like place", "{/log_odds_like:1}"},
                      {"why not", "{/reason:text}"}});

  // Evidence, unfolded if there are few merges.
  std::string details;
  for (const Json& m : list) {
    const bool accepted = flag_at(m, "/accepted");
    const std::string names = filled(m, "{/a:text} and {/b:text}");
    const char* how = text_at(m, "/by") == "rig" ? "one robot" : "merged";
    overview.row(m, {names, accepted ? how : "not merged"}, accepted ? "yes" : "bad");
    details +=
        folded("Evidence: " + names, merge_evidence(m) + refused_pairs(m), list.size() <= kShownMerges);
  }

  return rig_html(data.summary) + overview.html() + details +
         note(
             "Log-odds (natural logarithm) of the aligned keyframes' pictures: that both maps "
             "show one place rather than two, and that it is this place rather than one like it.");
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
  if (table.rows() == 0) return "";
  std::string shared;
  for (const Json& pair : list_at(s, "/camera_pairs")) shared += note(text_at(pair, "/text") + ".");
  return "<h3>Cameras</h3>\n" + table.html() + shared;
}

std::string refinement_html(const ReportData& data) {
  const Json& s = data.summary;
  const double maps = number_at(s, "/refine/local_maps");
  if (!(maps > 0.0) && !(number_at(s, "/refine/max_shift_m") > 0.0)) {
    return paragraph(
               "The map was not refined as a whole: there was nothing to align, or the stage was off.") +
           cameras_html(s) + fit_html(data);
  }

  // Alignment of surfaces, motion of keyframes.
  Facts facts = filled_facts(
      s,
      {{"Local maps", "{/refine/local_maps}"},
       {"Alignments of their surfaces",
        "{/refine/tried} tried, {/refine/accepted} used; the pose graph rejected {/refine/rejected} of them"},
       {"Mean rms of the surfaces aligned", "{/refine/mean_rms:2 σ of the depth noise}"},
       {"Keyframes moved", "{/refine/mean_shift_m:1 mm} on average, {/refine/max_shift_m:1 mm} at most"}});
  facts.emplace_back("Standard deviation of keyframes relative to the first", sigma_text(s));

  // Accuracy and adjustment of the whole.
  std::string out = facts_html(facts);
  if (number_at(s, "/refine/sigma_position_m/median") > 0.0) out += note(kSigmaNote);
  out += adjustment_html(s);
  return out + cameras_html(s) + fit_html(data);
}

}  // namespace plumbline::report
