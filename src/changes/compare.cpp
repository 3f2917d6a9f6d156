// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/changes/compare.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <optional>

#include "output.hpp"
#include "plumbline/core/text.hpp"
#include "plumbline/evaluate/cloud_fit.hpp"
#include "plumbline/exports/view.hpp"
#include "plumbline/maps/output_folder.hpp"
#include "point_search.hpp"
#include "seen_space.hpp"

namespace plumbline::changes {
namespace {

using geometry::Rigid3;

bool is_comparison(const std::filesystem::path& folder) {
  std::error_code ec;
  return std::filesystem::is_regular_file(folder / "changes.csv", ec);
}

const maps::FolderKind& comparison_kind() {
  static const maps::FolderKind kind{
      is_comparison,
      {"changes.ply", "changes.csv", "changes.html", "summary.json", "top.png", "iso.png", "distance.png"}};
  return kind;
}

/// Normals of points that have none: of the plane through the nearest ones, towards either side.
void estimate_normals(Surface& surface, const core::Executor& executor) {
  constexpr std::size_t kNeighbors = 16, kBlock = 1024;
  const PointSearch search(surface.points);
  surface.oriented = false;
  surface.normals.resize(surface.points.size());
  executor.parallel_for((surface.points.size() + kBlock - 1) / kBlock, [&](std::size_t block) {
    PointSearch::Found found;
    for (std::size_t i = block * kBlock; i < std::min(surface.points.size(), (block + 1) * kBlock); ++i) {
      search.nearest(surface.points[i], kNeighbors, found);
      Eigen::Vector3f mean(0, 0, 0);
      for (const auto& [k, squared] : found) mean += surface.points[k] / static_cast<float>(found.size());
      Eigen::Matrix3f sum = Eigen::Matrix3f::Zero();
      for (const auto& [k, squared] : found)
        sum += (surface.points[k] - mean) * (surface.points[k] - mean).transpose();
      surface.normals[i] = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3f>(sum).eigenvectors().col(0);
    }
  });
}

/// The points of a scene's cloud, less `shift`. Of a cloud with normals those without one are left out.
Surface surface_of(const viewer::Points& points, const Eigen::Vector3d& shift,
                   const core::Executor& executor) {
  const Eigen::Vector3d more = Eigen::Vector3d(points.shift[0], points.shift[1], points.shift[2]) - shift;
  Surface surface;
  for (std::size_t i = 0; i < points.positions.size(); ++i) {
    Eigen::Vector3f normal(0, 0, 1);
    if (!points.normals.empty()) normal = Eigen::Map<const Eigen::Vector3f>(points.normals[i].data());
    if (!normal.allFinite() || normal.squaredNorm() < 0.25F) continue;
    surface.points.emplace_back(Eigen::Map<const Eigen::Vector3f>(points.positions[i].data()) +
                                more.cast<float>());
    surface.normals.push_back(normal.normalized());
  }
  if (points.normals.empty()) estimate_normals(surface, executor);
  return surface;
}

/// ICP of the surfaces from where places or cameras put them; stays there if they do not fix all directions.
Rigid3 settled(const Surface& before, const Surface& after, const core::Executor& executor) {
  constexpr double kReach_m = 0.05;
  const evaluate::SurfaceSamples reference{before.points, before.normals, {}},
      cloud{after.points, after.normals, {}};
  const evaluate::CloudFit fit = evaluate::fit_cloud(cloud, reference, Rigid3(), kReach_m, executor);
  return fit.found ? fit.reference_from_cloud : Rigid3();
}

/// Moves a cloud's points and normals by `motion`, which is given in coordinates less `shift`.
void move(viewer::Points& points, const Rigid3& motion, const Eigen::Vector3d& shift) {
  const Eigen::Vector3d own = Eigen::Vector3d(points.shift[0], points.shift[1], points.shift[2]) - shift;
  for (auto& p : points.positions) {
    Eigen::Map<Eigen::Vector3f> at(p.data());
    at = (motion * (at.cast<double>() + own) - own).cast<float>();
  }
  for (auto& n : points.normals) {
    Eigen::Map<Eigen::Vector3f> normal(n.data());
    normal = (motion.rotation * normal.cast<double>()).cast<float>();
  }
}

/// True if the stamps say that what was given as the later map is the earlier one: both have the time of day.
bool stamps_disagree(const std::optional<SeenSpace>& before, const std::optional<SeenSpace>& after) {
  constexpr double kDated_s = 1e8;  // 1973; what is less counts from the start of something
  return before && after && after->first_stamp_s() > kDated_s &&
         before->first_stamp_s() > after->last_stamp_s();
}

/// Refuses maps of different places, or maps that are not aligned well enough to be compared.
core::Result<void> check_fit(const Comparison& comparison, const CompareRequest& request) {
  constexpr double kLeastAgreement = 0.5;
  constexpr std::size_t kFewest = 100;
  constexpr double kWorst_m = 0.02;
  const std::size_t both = comparison.counts[static_cast<std::size_t>(PlaceKind::kSame)] +
                           comparison.counts[static_cast<std::size_t>(PlaceKind::kShifted)];
  if (both >= kFewest && comparison.agreement >= kLeastAgreement && comparison.registration_m < kWorst_m)
    return {};
  return tl::unexpected<core::Error>(
      core::Error{core::ErrorKind::kUntrustworthy,
                  fmt::format("{} and {} do not fit: of what both show, {:.0f} % lies within 3 cm, and "
                              "surfaces are {:.0f} mm apart "
                              "(1 sigma); is it the same place, and are both maps whole?",
                              request.before.string(), request.after.string(), 100.0 * comparison.agreement,
                              1000.0 * comparison.registration_m)});
}

/// The summary that the terminal shows, with the largest changes only.
std::string terminal_text(const Comparison& comparison, const std::string& placing) {
  constexpr std::size_t kMost = 20;
  std::string text = placing + ".\n";
  const auto count = [&](PlaceKind kind) { return comparison.counts[static_cast<std::size_t>(kind)]; };
  text += fmt::format(
      "places     {} same, {} shifted, {} appeared, {} vanished, {} not seen before, {} not seen after\n",
      count(PlaceKind::kSame), count(PlaceKind::kShifted), count(PlaceKind::kAppeared),
      count(PlaceKind::kVanished), count(PlaceKind::kNotSeenBefore), count(PlaceKind::kNotSeenAfter));

  // Accuracy of the comparison
  text +=
      fmt::format("limit      {:.1f} mm in the median (95 %), {:.1f} mm of it how the maps lie (1 sigma)\n",
                  1000.0 * comparison.median_limit_m, 1000.0 * comparison.registration_m);
  text += fmt::format("changes    {}\n", comparison.changes.size());

  // The largest changes, which come first
  for (std::size_t i = 0; i < std::min(kMost, comparison.changes.size()); ++i) {
    const Eigen::Vector3d at = comparison.changes[i].box().center();
    text += fmt::format("  {:<3} {} at {:.2f} {:.2f} {:.2f}\n", i + 1, text_of(comparison.changes[i]), at.x(),
                        at.y(), at.z());
  }
  if (comparison.changes.size() > kMost) text += "  ... changes.csv lists all\n";
  return text;
}

/// The two maps in one frame, with what is known of the space that their cameras saw.
struct Pair {
  exports::MapView view;
  Surface before, after;
  std::optional<SeenSpace> space_before, space_after;
  Shown shown;
};

/// Reads both maps, aligns the later with the earlier and finds the free space of each.
core::Result<Pair> lay_together(const CompareRequest& request, const core::Executor& executor, core::Log& log,
                                const exports::ExportProgress& progress) {
  exports::ExportRequest first;
  first.open = request.open;
  first.options.points = request.points;
  exports::ExportRequest second = first;
  first.input = request.before;
  second.input = request.after;
  auto view = exports::view_of_two(first, second, executor, log, progress, false);
  if (!view) return tl::unexpected<core::Error>(view.error());

  Pair pair;
  pair.view = std::move(*view);
  viewer::Scene& scene = pair.view.scene;

  // Single precision needs coordinates near the origin
  Shown& shown = pair.shown;
  shown.shift = {scene.clouds[0].shift[0], scene.clouds[0].shift[1], scene.clouds[0].shift[2]};
  pair.before = surface_of(scene.clouds[0], shown.shift, executor);
  pair.after = surface_of(scene.clouds[1], shown.shift, executor);

  // ICP refines the alignment of the second cloud
  const Rigid3 finer = settled(pair.before, pair.after, executor);
  move(scene.clouds[1], finer, shown.shift);
  pair.after = surface_of(scene.clouds[1], shown.shift, executor);

  // From each map's own frame into that of the comparison, whose coordinates are less the shift.
  Rigid3 less;
  less.translation = -shown.shift;
  auto space = SeenSpace::open(request.before, less * pair.view.world_from_map[0], executor);
  if (!space) return tl::unexpected<core::Error>(space.error());
  pair.space_before = std::move(*space);
  space = SeenSpace::open(request.after, finer * less * pair.view.world_from_map[1], executor);
  if (!space) return tl::unexpected<core::Error>(space.error());
  pair.space_after = std::move(*space);

  // Facts that the tables and pages show
  shown.before = scene.clouds[0].name;
  shown.after = scene.clouds[1].name;
  shown.placing = scene.placing;
  shown.before_from_after = less.inverse() * finer * less * pair.view.first_from_second;
  shown.free_space_before = pair.space_before.has_value();
  shown.free_space_after = pair.space_after.has_value();
  shown.frame = cloud::frame_with(scene.z_up ? cloud::Up::kZ : cloud::Up::kMinusY);
  shown.up = scene.z_up ? Eigen::Vector3d(0, 0, 1) : Eigen::Vector3d(0, -1, 0);
  return pair;
}

LookedThrough function_of(const std::optional<SeenSpace>& space, const core::Executor& executor) {
  if (!space) return nullptr;
  return [&](const std::vector<Eigen::Vector3f>& points) { return space->looked_through(points, executor); };
}

}  // namespace

core::Result<CompareSummary> compare_maps(const CompareRequest& request, const core::Executor& executor,
                                          core::Log& log, const exports::ExportProgress& progress) {
  auto folder = maps::OutputFolder::prepare(request.output, request.replace, false, comparison_kind());
  if (!folder) return tl::unexpected<core::Error>(folder.error());
  auto pair = lay_together(request, executor, log, progress);
  if (!pair) return tl::unexpected<core::Error>(pair.error());

  // Stamps decide which map is the earlier one
  CompareSummary summary;
  if (request.order == Order::kStamps && stamps_disagree(pair->space_before, pair->space_after)) {
    CompareRequest turned = request;
    std::swap(turned.before, turned.after);
    log.info(
        fmt::format("{} was recorded before {}: it is taken as the earlier map; --order given keeps yours",
                    request.after.string(), request.before.string()));

    // The earlier map gives the frame, so both are read again
    pair = lay_together(turned, executor, log, progress);
    if (!pair) return tl::unexpected<core::Error>(pair.error());
    pair->shown.swapped = summary.swapped = true;
  }

  // Maps that do not fit have no changes to list
  summary.placing = pair->shown.placing;
  summary.comparison =
      find_changes({pair->before, pair->after}, function_of(pair->space_before, executor),
                   function_of(pair->space_after, executor), pair->shown.up, request.options, executor);
  if (auto fits = check_fit(summary.comparison, request); !fits)
    return tl::unexpected<core::Error>(fits.error());

  // Appeared and vanished need a record of free space
  for (const auto* known : {&pair->shown.free_space_before, &pair->shown.free_space_after}) {
    if (!*known)
      log.info(fmt::format(
          "{} has no map.db: what its cameras looked through is not known, so nothing is told to have {}",
          known == &pair->shown.free_space_before ? pair->shown.before : pair->shown.after,
          known == &pair->shown.free_space_before ? "appeared" : "vanished"));
  }

  // The folder appears only when it is complete
  auto written = write_tables(folder->path(), summary.comparison, pair->shown);
  if (written) written = write_pictures(folder->path(), summary.comparison, pair->shown, executor);
  if (written)
    written = write_page(folder->path(), summary.comparison, pair->shown, pair->view.scene, executor);
  if (written) written = folder->commit();
  if (!written) return tl::unexpected<core::Error>(folder->explained(written.error()));
  summary.text = terminal_text(summary.comparison, summary.placing);
  return summary;
}

}  // namespace plumbline::changes
