// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "plumbline/core/json.hpp"
#include "plumbline/evaluate/cloud.hpp"

namespace plumbline::evaluate {
namespace {

using Json = nlohmann::ordered_json;

Json distances_json(const Statistics& s) {
  return {{"mean", s.mean}, {"median", s.median}, {"rmse", s.rmse}, {"p90", s.p90}, {"max", s.max}};
}

/// Alignment as JSON; trajectory and ICP only if they were used.
Json json_of(const CloudAlignmentReport& a) {
  const Eigen::Quaterniond q = a.reference_from_cloud.quaternion();
  const Eigen::Vector3d& t = a.reference_from_cloud.translation;
  Json out = {{"type", a.align == CloudAlignment::kSe3 ? "se3" : "none"},
              {"translation_m", {t.x(), t.y(), t.z()}},
              {"quaternion_xyzw", {q.x(), q.y(), q.z(), q.w()}}};
  if (a.align == CloudAlignment::kNone) return out;
  if (a.trajectory_poses > 0) {
    out["trajectory"] = {{"poses", a.trajectory_poses}, {"rmse_m", a.trajectory_rmse_m}};
  }
  out["icp"] = {{"iterations", a.icp_iterations},
                {"rmse_mm", a.icp_rmse_mm},
                {"overlap", a.icp_overlap},
                {"converged", a.icp_converged}};
  return out;
}

/// Null if no patch was measured.
Json json_of(const WallThickness& w) {
  Json out = {{"rms", nullptr}, {"mean", nullptr}, {"median", nullptr}, {"p90", nullptr}};
  if (w.patches > 0)
    out = {{"rms", w.rms_mm}, {"mean", w.mean_mm}, {"median", w.median_mm}, {"p90", w.p90_mm}};
  out["patches"] = w.patches;
  out["layered_percent"] = w.layered_percent;
  return out;
}

/// One plane of the table of walls.
Json json_of(const WallPlane& p) {
  return {{"area_m2", p.area_m2},
          {"normal", {p.normal.x(), p.normal.y(), p.normal.z()}},
          {"offset_m", p.offset_m},
          {"thickness_mm", json_of(p.thickness)},
          {"straightness_mm", p.straightness_mm},
          {"slab_rms_mm", p.slab_rms_mm},
          {"points", p.points}};
}

/// A line a plane; nothing without planes.
std::string table_of(const std::vector<WallPlane>& planes) {
  if (planes.empty()) return "";
  std::string out = fmt::format("{:<14} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9}  {}\n", "largest planes", "m2",
                                "thick RMS", "median", "straight", "all", "doubled %", "normal");
  for (std::size_t i = 0; i < planes.size(); ++i) {
    const WallPlane& p = planes[i];
    out += fmt::format("{:<14} {:>9.2f} {:>9.2f} {:>9.2f} {:>9.2f} {:>9.2f} {:>9.1f}  {:.2f} {:.2f} {:.2f}\n",
                       i + 1, p.area_m2, p.thickness.rms_mm, p.thickness.median_mm, p.straightness_mm,
                       p.slab_rms_mm, p.thickness.layered_percent, p.normal.x(), p.normal.y(), p.normal.z());
  }
  return out;
}

std::string row(const char* name, const Statistics& s) {
  return fmt::format("{:<14} {:>9.3f} {:>9.3f} {:>9.3f} {:>9.3f} {:>9.3f}  mm\n", name, s.mean, s.median,
                     s.rmse, s.p90, s.max);
}

}  // namespace

std::string to_json(const CloudReport& r) {
  // Both directions, only with a reference
  Json out;
  if (r.has_reference) {
    out["accuracy_mm"] = distances_json(r.accuracy_mm);
    out["completeness_mm"] = distances_json(r.completeness_mm);

    // Precision, recall and F by threshold
    for (const ThresholdScore& s : r.at) {
      out["at"][fmt::format("{:g}mm", s.threshold_mm)] = {
          {"precision", s.precision}, {"recall", s.recall}, {"f", s.f}};
    }
    out["normal_consistency"] = r.normal_consistency ? Json(*r.normal_consistency) : Json(nullptr);
  }

  // Walls and density of the cloud alone
  out["wall_thickness_mm"] = json_of(r.wall);
  out["planes"] = Json::array();
  for (const WallPlane& plane : r.planes) out["planes"].push_back(json_of(plane));
  out["density"] = {{"points_per_m2", r.density_per_m2}, {"spacing_mm", r.spacing_mm}};
  out["points"] = r.points;
  out["points_not_finite"] = r.not_finite;

  // The reference and its alignment
  if (r.has_reference) {
    out["reference_points"] = r.reference_points;
    out["reference_hidden"] = r.reference_hidden;
    out["visible_only"] = r.visibility_used;
    out["alignment"] = json_of(r.alignment);
  }
  out["warnings"] = r.warnings;
  return core::json_text(out);
}

std::string to_text(const CloudReport& r) {
  // The cloud by itself
  std::string out =
      fmt::format("{} points, {:.0f} per m2, {:.2f} mm apart\n", r.points, r.density_per_m2, r.spacing_mm);

  // Comparison with the reference
  if (r.has_reference) {
    out += fmt::format("{} reference points{}\n", r.reference_points,
                       r.visibility_used
                           ? fmt::format(" that cameras could see, {} others left out", r.reference_hidden)
                           : "");

    // Steps of the alignment
    if (r.alignment.align == CloudAlignment::kSe3) {
      out +=
          fmt::format("aligned by {}ICP: {} iterations, {:.3f} mm RMS, overlap {:.1f} %\n",
                      r.alignment.trajectory_poses > 0 ? "trajectory and " : "", r.alignment.icp_iterations,
                      r.alignment.icp_rmse_mm, 100.0 * r.alignment.icp_overlap);
    }

    // Both directions as a table
    out += fmt::format("{:<14} {:>9} {:>9} {:>9} {:>9} {:>9}\n", "", "mean", "median", "rmse", "p90", "max");
    out += row("accuracy", r.accuracy_mm);
    out += row("completeness", r.completeness_mm);
    out += fmt::format("{:<14} {:>9} {:>9} {:>9}\n", "", "precision", "recall", "F");
    for (const ThresholdScore& s : r.at) {
      out += fmt::format("{:<14} {:>9.4f} {:>9.4f} {:>9.4f}\n", fmt::format("at {:g} mm", s.threshold_mm),
                         s.precision, s.recall, s.f);
    }

    // Only clouds with normals have a consistency
    if (r.normal_consistency) out += fmt::format("normal consistency {:.4f}\n", *r.normal_consistency);
  }

  // Walls and warnings
  if (r.wall.patches > 0) {
    out += fmt::format(
        "wall thickness {:.2f} mm RMS, median {:.2f}, p90 {:.2f} over {} patches, {:.1f} % doubled\n",
        r.wall.rms_mm, r.wall.median_mm, r.wall.p90_mm, r.wall.patches, r.wall.layered_percent);
  }

  out += table_of(r.planes);
  for (const std::string& warning : r.warnings) out += "warning: " + warning + "\n";
  return out;
}

}  // namespace plumbline::evaluate
