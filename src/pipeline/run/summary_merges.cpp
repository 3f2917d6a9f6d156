// SPDX-License-Identifier: BSD-3-Clause
// What summary.json says of several robots' maps: those held against each other, and where robots met.
#include "run/summary_json.hpp"

namespace plumbline::pipeline {
namespace {

Json laid(const mapping::OverlayFit& fit) {
  return {{"expected", fit.expected},
          {"matched", fit.matched},
          {"chance", rounded(fit.chance)},
          {"seen_through", fit.contradicted}};
}

/// Standard deviations, the whole matrix, and where the maps lie.
void add_alignment(const mapping::Alignment& alignment, Json& entry) {
  Json sigma = Json::array();
  Json covariance = Json::array();
  for (int row = 0; row < 6; ++row) {
    sigma.push_back(rounded(std::sqrt(alignment.covariance(row, row))));
    Json line = Json::array();
    for (int column = 0; column < 6; ++column) line.push_back(alignment.covariance(row, column));
    covariance.push_back(line);
  }
  entry["sigma"] = sigma;
  entry["covariance"] = covariance;
  entry["a_from_b"] = rows(alignment.a_from_b);
}

}  // namespace

Json merge_of(const RunSummary::Merge& merge) {
  const mapping::MergeEvidence& e = merge.evidence;
  const mapping::PairTotals totals = e.totals();
  Json refused = Json::object();
  for (const auto& [why, count] : e.refused_pairs) refused[why] = count;
  Json entry = {{"a", merge.a},
                {"b", merge.b},
                {"accepted", e.accepted},
                {"reason", e.refused},
                {"candidates", e.candidates},
                {"tried", e.tried},
                {"verified", e.consistency.verified},
                {"refused", refused},
                {"agreeing", e.consistency.agreeing},
                {"alternative", e.ambiguity.alternative},
                {"overlay", laid(e.ambiguity.overlap)},
                {"expected", e.validation.expected},
                {"confirmed", e.validation.confirmed},
                {"pairs", e.pairs.size()},
                {"rejected", e.rejected},
                {"matches", totals.matches},
                {"inliers", totals.inliers},
                {"rms", rounded(totals.rms_px)},
                {"overlap", rounded(totals.overlap)},
                {"span_m", rounded(e.consistency.span_m)},
                {"span_rad", rounded(e.consistency.span_rad)},
                {"spread_m", rounded(e.alignment.spread_m)}};
  if (e.ambiguity.alternative_m > 0.0) {
    entry["alternative_m"] = rounded(e.ambiguity.alternative_m);
    entry["alternative_overlay"] = laid(e.ambiguity.alternative_overlap);
  }
  if (e.accepted) add_alignment(e.alignment, entry);
  if (merge.time_s >= 0.0) entry["time_s"] = rounded(merge.time_s);
  if (merge.evident_s >= 0.0) entry["evident_s"] = rounded(merge.evident_s);
  return entry;
}

Json merges_of(const RunSummary& summary) {
  Json list = Json::array();
  for (const RunSummary::Merge& merge : summary.merges) list.push_back(merge_of(merge));
  return list;
}

Json meetings_of(const RunSummary& summary) {
  Json list = Json::array();
  for (const RunSummary::Meeting& meeting : summary.meetings) {
    list.push_back({{"number", meeting.number},
                    {"a", meeting.a},
                    {"b", meeting.b},
                    {"time_s", rounded(meeting.time_s)},
                    {"frame", meeting.frame},
                    {"taken_back", meeting.taken_back}});
  }
  return list;
}

}  // namespace plumbline::pipeline
