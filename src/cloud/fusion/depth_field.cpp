// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/cloud/depth_field.hpp"

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "plumbline/cloud/free_space.hpp"
#include "plumbline/cloud/sensor_pose.hpp"
#include "plumbline/core/numbers.hpp"
#include "plumbline/sensor/depth_noise.hpp"

namespace plumbline::cloud {
namespace {

constexpr int kCell_px = 8;
constexpr float kReach_m = 3.5F;   // farther away noise is larger than what is looked for
constexpr float kApart_m = 0.06F;  // farther apart are two surfaces
constexpr float kSameWay = 0.95F;  // cosine between the normals of one surface
constexpr float kSteep = 0.5F;     // cosine: along grazing rays depth says little
constexpr double kFarthestPartner_m = 1.5;
constexpr double kLeastAxisCosine = 0.64;  // 50 degrees between the views
constexpr std::size_t kLeastSamples = 5000;
constexpr std::size_t kBlocks = 8;  // of consecutive views, dealt out to the parts
constexpr std::size_t kParts = 4;
constexpr std::size_t kLeastViews = 6;
constexpr int kFitRounds = 8;
constexpr double kRobust_sigmas = 2.0;  // standard deviations
constexpr double kPrior_per_m = 0.02;   // of beta: 8 cm at 2 m
constexpr double kCorrelation = 0.01;   // samples count by this much against the prior: neighbours err alike

struct Sample {
  Eigen::Vector3f point = Eigen::Vector3f::Zero();  // z = 0: none
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();
};

/// One sample per cell of 8 x 8 pixels: the point nearest to its middle.
struct View {
  int width = 0;
  int height = 0;
  std::vector<Sample> cells;

  [[nodiscard]] const Sample* at(const Eigen::Vector2d& pixel) const {
    const int i = static_cast<int>(std::floor((pixel.x() + 0.5) / kCell_px));
    const int j = static_cast<int>(std::floor((pixel.y() + 0.5) / kCell_px));
    if (i < 0 || j < 0 || i >= width || j >= height) return nullptr;
    const Sample& sample =
        cells[static_cast<std::size_t>(j) * static_cast<std::size_t>(width) + static_cast<std::size_t>(i)];
    return sample.point.z() > 0.0F ? &sample : nullptr;
  }
};

View sampled(const Cloud& cloud, const sensor::Pinhole& camera) {
  View view;
  view.width = (camera.width + kCell_px - 1) / kCell_px;
  view.height = (camera.height + kCell_px - 1) / kCell_px;
  view.cells.resize(static_cast<std::size_t>(view.width) * static_cast<std::size_t>(view.height));
  std::vector<double> best(view.cells.size(), 1e9);
  for (const Point& p : cloud.points) {
    if (!(p.z > 0.0F) || p.z > kReach_m || !std::isfinite(p.normal_x)) continue;
    if (std::abs(p.getNormalVector3fMap().dot(p.getVector3fMap().normalized())) < kSteep) continue;
    const Eigen::Vector2d pixel = camera.project(p.getVector3fMap().cast<double>());
    const int i = static_cast<int>(std::floor((pixel.x() + 0.5) / kCell_px));
    const int j = static_cast<int>(std::floor((pixel.y() + 0.5) / kCell_px));
    if (i < 0 || j < 0 || i >= view.width || j >= view.height) continue;
    const Eigen::Vector2d middle((i + 0.5) * kCell_px - 0.5, (j + 0.5) * kCell_px - 0.5);
    const double off = (pixel - middle).squaredNorm();
    const std::size_t cell =
        static_cast<std::size_t>(j) * static_cast<std::size_t>(view.width) + static_cast<std::size_t>(i);
    if (off >= best[cell]) continue;
    best[cell] = off;
    view.cells[cell] = {p.getVector3fMap(), p.getNormalVector3fMap()};
  }
  return view;
}

/// One surface point as two views saw it: residual + (gain_a B(ray_a) + gain_b B(ray_b)) . coefficients.
struct Row {
  std::array<float, 2> a;  // slopes of the ray
  std::array<float, 2> b;
  float gain_a;  // m^2
  float gain_b;
  float residual;  // m, along the normal
  float sigma;     // m
};
using Rows = std::vector<Row>;

Rows compared(const View& a, const View& b, const geometry::Rigid3& b_from_a, const sensor::Pinhole& camera) {
  Rows rows;
  const Eigen::Matrix3d turn = b_from_a.rotation;
  for (const Sample& sample : a.cells) {
    if (!(sample.point.z() > 0.0F)) continue;
    const Eigen::Vector3d p = b_from_a * sample.point.cast<double>();
    if (p.z() < 0.2) continue;
    const Sample* other = b.at(camera.project(p));
    if (other == nullptr) continue;
    const Eigen::Vector3d q = other->point.cast<double>();
    const Eigen::Vector3d normal = other->normal.cast<double>();
    if (normal.dot(turn * sample.normal.cast<double>()) < kSameWay) continue;
    const double residual = normal.dot(p - q);
    if (std::abs(residual) > kApart_m) continue;
    const double z_a = sample.point.z();
    const Eigen::Vector3d ray_a = sample.point.cast<double>() / z_a;
    const Eigen::Vector3d ray_b = q / q.z();
    const double sigma_a = sensor::depth_sigma(z_a);
    const double sigma_b = sensor::depth_sigma(q.z());
    rows.push_back({{static_cast<float>(ray_a.x()), static_cast<float>(ray_a.y())},
                    {static_cast<float>(ray_b.x()), static_cast<float>(ray_b.y())},
                    static_cast<float>(-z_a * z_a * normal.dot(turn * ray_a)),
                    static_cast<float>(q.z() * q.z() * normal.dot(ray_b)),
                    static_cast<float>(residual),
                    static_cast<float>(std::sqrt(sigma_a * sigma_a + sigma_b * sigma_b))});
  }
  return rows;
}

DepthField::Terms jacobian(const Row& row) {
  return row.gain_a * DepthField::monomials(row.a[0], row.a[1]) +
         row.gain_b * DepthField::monomials(row.b[0], row.b[1]);
}

/// Robust least squares over the pairs that `use` names.
DepthField fitted(const std::vector<const Rows*>& use, const sensor::Pinhole& camera,
                  const core::Executor& executor) {
  using Matrix = Eigen::Matrix<double, DepthField::kTerms, DepthField::kTerms>;
  struct Sum {
    Matrix h = Matrix::Zero();
    DepthField::Terms g = DepthField::Terms::Zero();
  };
  // Monomials at the rim of the image: a coefficient is held near zero by what it does there.
  const DepthField::Terms rim =
      DepthField::monomials(0.5 * camera.width / camera.fx, 0.5 * camera.height / camera.fy);
  DepthField::Terms c = DepthField::Terms::Zero();
  for (int round = 0; round < kFitRounds; ++round) {
    std::vector<Sum> sums(use.size());
    executor.parallel_for(use.size(), [&](std::size_t k) {
      for (const Row& row : *use[k]) {
        const DepthField::Terms j = jacobian(row);
        const double e = (row.residual + j.dot(c)) / row.sigma;
        const double pull = 1.0 + e * e / (kRobust_sigmas * kRobust_sigmas);
        const double weight = 1.0 / (pull * pull * row.sigma * row.sigma);
        sums[k].h.noalias() += weight * j * j.transpose();
        sums[k].g.noalias() -= weight * row.residual * j;
      }
    });
    Sum all;
    for (const Sum& sum : sums) {
      all.h += sum.h;
      all.g += sum.g;
    }
    for (int i = 0; i < DepthField::kTerms; ++i) {
      const double held = rim[i] / kPrior_per_m;
      all.h(i, i) += held * held / kCorrelation;
    }
    c = all.h.ldlt().solve(all.g);
  }
  return DepthField(c);
}

/// In standard deviations, of every row.
void add_disagreement(const std::vector<const Rows*>& of, const DepthField& field, std::vector<double>& all) {
  for (const Rows* rows : of) {
    for (const Row& row : *rows) {
      all.push_back(std::abs(row.residual + jacobian(row).dot(field.coefficients())) / row.sigma);
    }
  }
}

/// The largest change of a depth of 2 m along any ray that was compared, metres.
double most_at_2m(const std::vector<const Rows*>& of, const DepthField& field) {
  double most = 0.0;
  for (const Rows* rows : of) {
    for (const Row& row : *rows)
      most = std::max(most, std::abs(1.0 / (0.5 + field.beta(row.a[0], row.a[1])) - 2.0));
  }
  return most;
}

std::size_t count_of(const std::vector<const Rows*>& of) {
  std::size_t count = 0;
  for (const Rows* rows : of) count += rows->size();
  return count;
}

/// Which views each is compared with: near ones that look the same way, from hardly turned to far turned.
std::vector<std::pair<std::size_t, std::size_t>> partners(const std::vector<geometry::Rigid3>& poses,
                                                          int most) {
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    std::vector<std::pair<double, std::size_t>> near;  // by how far off
    for (std::size_t j = 0; j < poses.size(); ++j) {
      if (j == i) continue;
      const geometry::Rigid3 apart = poses[j].inverse() * poses[i];
      const double cosine = (apart.rotation * Eigen::Vector3d::UnitZ()).z();
      if (apart.translation.norm() > kFarthestPartner_m || cosine < kLeastAxisCosine) continue;
      near.emplace_back(apart.translation.norm() / kFarthestPartner_m + std::acos(std::min(1.0, cosine)), j);
    }
    std::sort(near.begin(), near.end());
    const std::size_t count = std::min(near.size(), static_cast<std::size_t>(most));
    for (std::size_t k = 0; k < count; ++k)
      pairs.emplace_back(i, near[(k + 1) * near.size() / count - 1].second);
  }
  return pairs;
}

/// Views spread evenly over the run; depth-only views have no samples.
core::Result<std::vector<View>> sample_views(const std::vector<std::size_t>& views, std::size_t count,
                                             const std::vector<geometry::Rigid3>& world_from_camera,
                                             const ReadView& read, const sensor::Pinhole& camera,
                                             const core::Executor& executor,
                                             std::vector<geometry::Rigid3>& poses) {
  std::vector<View> result(count);
  std::vector<core::Result<void>> done(count);
  poses.resize(count);
  executor.parallel_for(count, [&](std::size_t i) {
    const std::size_t view = views[i * views.size() / count];
    const auto cloud = read(view);
    if (!cloud) {
      done[i] = tl::unexpected<core::Error>(cloud.error());
      return;
    }
    poses[i] = world_from_camera[view] * sensor_pose(**cloud);
    if (!is_depth_view(**cloud, camera)) result[i] = sampled(**cloud, camera);
  });
  for (const auto& one : done) {
    if (!one) return tl::unexpected<core::Error>(one.error());
  }
  return result;
}

/// Two views that were compared, and what that gave.
struct Comparison {
  std::size_t a;
  std::size_t b;
  Rows rows;
};

/// Disagreement between views, with a field that those of other parts of the run gave and without; none: a
/// part is left with too few samples.
struct Disagreement {
  std::vector<double> before, after;
};
std::optional<Disagreement> cross_validate(const std::vector<Comparison>& comparisons, std::size_t views,
                                           const sensor::Pinhole& camera, const core::Executor& executor) {
  const auto part = [&](std::size_t view) { return view * kBlocks / views % kParts; };
  std::vector<std::optional<Disagreement>> parts(kParts);
  executor.parallel_for(kParts, [&](std::size_t k) {
    std::vector<const Rows*> own;
    std::vector<const Rows*> others;
    for (const Comparison& c : comparisons) {
      if (part(c.a) == k) own.push_back(&c.rows);
      if (part(c.a) != k && part(c.b) != k) others.push_back(&c.rows);
    }
    if (count_of(others) < kLeastSamples) return;
    parts[k].emplace();
    add_disagreement(own, DepthField(), parts[k]->before);
    add_disagreement(own, fitted(others, camera, executor), parts[k]->after);
  });
  Disagreement all;
  for (const auto& one : parts) {
    if (!one) return std::nullopt;
    all.before.insert(all.before.end(), one->before.begin(), one->before.end());
    all.after.insert(all.after.end(), one->after.begin(), one->after.end());
  }
  return all;
}

}  // namespace

DepthField::Terms DepthField::monomials(double x, double y) {
  const double xx = x * x;
  const double xy = x * y;
  const double yy = y * y;
  Terms terms;
  terms << xx, xy, yy, xx * x, xx * y, x * yy, yy * y, xx * xx, xx * xy, xx * yy, xy * yy, yy * yy;
  return terms;
}

void DepthField::correct(const Eigen::Matrix<float, kTerms, 1>& c, Eigen::Vector3f& p,
                         Eigen::Vector3f& normal) {
  const float x = p.x() / p.z();
  const float y = p.y() / p.z();
  // The polynomial and its slopes, by powers of x.
  const float of_1 = y * y * (c[2] + y * (c[6] + y * c[11]));
  const float of_x = y * (c[1] + y * (c[5] + y * c[10]));
  const float of_xx = c[0] + y * (c[4] + y * c[9]);
  const float of_xxx = c[3] + y * c[8];
  const float exact = of_1 + x * (of_x + x * (of_xx + x * (of_xxx + x * c[7])));
  const float b = std::clamp(exact, -0.5F / p.z(), 0.5F / p.z());
  if (std::isfinite(normal.x())) {
    // A plane is a x + b y + c = 1 / z; its normal lies along (a, b, c).
    const float along = normal.dot(p);
    if (std::abs(along) > 1e-3F * p.z()) {
      const float slope_x = of_x + x * (2.0F * of_xx + x * (3.0F * of_xxx + x * 4.0F * c[7]));
      const float slope_y =
          y * (2.0F * c[2] + y * (3.0F * c[6] + y * 4.0F * c[11])) +
          x * (c[1] + y * (2.0F * c[5] + y * 3.0F * c[10]) + x * (c[4] + y * 2.0F * c[9] + x * c[8]));
      const Eigen::Vector3f turned =
          normal / along + Eigen::Vector3f(slope_x, slope_y, b - x * slope_x - y * slope_y);
      normal = turned * ((along > 0.0F ? 1.0F : -1.0F) / turned.norm());
    }
  }
  p *= 1.0F / (1.0F + b * p.z());
}

void DepthField::correct(Cloud& camera_cloud) const {
  if (identity()) return;
  const Eigen::Matrix<float, kTerms, 1> c = coefficients_.cast<float>();
  for (Point& p : camera_cloud.points) {
    if (!(p.z > 0.0F)) continue;
    Eigen::Vector3f at = p.getVector3fMap();
    Eigen::Vector3f normal = p.getNormalVector3fMap();
    correct(c, at, normal);
    p.getVector3fMap() = at;
    p.getNormalVector3fMap() = normal;
  }
}

void DepthFieldOptions::declare(core::OptionTable& table) {
  table.integer("depth_field.views", views, {kLeastViews, 10000}, "", "Views that are compared at most");
  table.integer("depth_field.views_per_view", partners, {1, 100}, "", "Views that each is compared with");
  table.number("depth_field.min_gain", least_gain, {0.0, 1.0}, "",
               "Share of the disagreement between views that a correction must take away to be used");
}

core::Result<DepthField> find_depth_field(const std::vector<std::size_t>& views,
                                          const std::vector<geometry::Rigid3>& world_from_camera,
                                          const ReadView& read, const sensor::Pinhole& camera,
                                          const DepthFieldOptions& options, const core::Executor& executor,
                                          DepthFieldReport* report) {
  DepthFieldReport unused;
  DepthFieldReport& found = report == nullptr ? unused : *report;
  found = {};
  const std::size_t count = std::min(views.size(), static_cast<std::size_t>(options.views));
  std::vector<geometry::Rigid3> poses;
  const auto samples = sample_views(views, count, world_from_camera, read, camera, executor, poses);
  if (!samples) return tl::unexpected<core::Error>(samples.error());
  if (count < kLeastViews) return DepthField();

  std::vector<Comparison> comparisons;
  for (const auto& [a, b] : partners(poses, options.partners)) comparisons.push_back({a, b, {}});
  executor.parallel_for(comparisons.size(), [&](std::size_t k) {
    Comparison& c = comparisons[k];
    c.rows = compared((*samples)[c.a], (*samples)[c.b], poses[c.b].inverse() * poses[c.a], camera);
  });
  std::vector<const Rows*> all;
  for (const Comparison& c : comparisons) all.push_back(&c.rows);
  found.samples = count_of(all);
  if (found.samples < kLeastSamples) return DepthField();

  auto disagreement = cross_validate(comparisons, count, camera, executor);
  if (!disagreement) return DepthField();
  found.before = core::median(std::move(disagreement->before));
  found.after = core::median(std::move(disagreement->after));
  found.used = found.after <= (1.0 - options.least_gain) * found.before;
  if (!found.used) return DepthField();
  const DepthField field = fitted(all, camera, executor);
  found.most_at_2m = most_at_2m(all, field);
  return field;
}

}  // namespace plumbline::cloud
