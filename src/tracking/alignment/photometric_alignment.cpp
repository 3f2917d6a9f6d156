// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/tracking/photometric_alignment.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "alignment/photometric_view.hpp"
#include "plumbline/sensor/depth_noise.hpp"

namespace plumbline::tracking {
namespace {

using geometry::Rigid3;

constexpr double kMinCorrelation = 0.3;  // noise alone has 0.02 of 2000 samples
constexpr double kMinSigma = 0.3;        // grey values: rounding error
constexpr double kLargestGain = 4.0;

/// core::median() of numbers that are not negative. Their bits are in the same order as they are: most are
/// left out by a histogram of the leading ones.
float median_size(const std::vector<float>& sizes) {
  constexpr unsigned kMantissaShift = 20;
  const auto bin_of = [](float size) {
    std::uint32_t bits = 0;
    std::memcpy(&bits, &size, sizeof bits);
    return bits >> kMantissaShift;
  };

  // Histogram of the leading bits
  std::array<std::uint32_t, 1U << (32 - kMantissaShift)> counts{};
  for (const float size : sizes) ++counts[bin_of(size)];
  std::size_t rank = sizes.size() / 2;
  std::uint32_t bin = 0;
  for (; rank >= counts[bin]; ++bin) rank -= counts[bin];

  // Exact among the numbers of the median's bin
  std::vector<float> alike;
  alike.reserve(counts[bin]);
  for (const float size : sizes) {
    if (bin_of(size) == bin) alike.push_back(size);
  }

  const auto place = alike.begin() + static_cast<std::ptrdiff_t>(rank);
  std::nth_element(alike.begin(), place, alike.end());
  return *place;
}

/// True if the depth image measured something in front of the point.
bool hidden(const PhotometricView& view, const Eigen::Vector3f& in_depth) {
  const Eigen::Vector2d pixel = view.camera.project(in_depth.cast<double>());
  if (!view.camera.contains(pixel)) return false;
  const float z = view.depth->at<float>(static_cast<int>(pixel.y() + 0.5), static_cast<int>(pixel.x() + 0.5));
  return z > 0.0F &&
         z < in_depth.z() - 0.03F -
                 4.0F * static_cast<float>(sensor::depth_sigma(static_cast<double>(in_depth.z())));
}

/// Weakens terms by the depth noise: with inexact depth a steep edge is off by a fraction of a pixel once the
/// camera has moved, the whole edge in the same direction.
void weigh_by_depth(const Rigid3& camera_from_reference, optimize::PhotometricFamily& family) {
  constexpr float kCommon = 2.0F;  // neighbours have their noise in common
  const Eigen::Matrix3f rotation = camera_from_reference.rotation.cast<float>();
  const Eigen::Vector3f translation = camera_from_reference.translation.cast<float>();
  const auto fx = static_cast<float>(family.camera.fx), fy = static_cast<float>(family.camera.fy);

  const auto per_sigma = static_cast<float>(family.gain / family.sigma);
  for (optimize::PhotometricTerm& term : family.terms) {
    const float z = term.point.z();
    const Eigen::Vector3f along = rotation * (term.point / z);
    const Eigen::Vector3f p = along * z + translation;
    const float per_z = 1.0F / p.z();

    // Derivative of the pixel with respect to the sample's depth.
    const Eigen::Vector2f shift(fx * (along.x() - p.x() * per_z * along.z()) * per_z,
                                fy * (along.y() - p.y() * per_z * along.z()) * per_z);

    // by_point = gradient times focal length over depth
    const Eigen::Vector2f gradient(term.derivative(0) * z / fx, term.derivative(1) * z / fy);
    const float grey = kCommon * gradient.dot(shift) *
                       static_cast<float>(sensor::depth_sigma(static_cast<double>(z))) * per_sigma;
    term.weight = 1.0F / std::sqrt(1.0F + grey * grey);
  }
}

}  // namespace

void PhotometricKeyframes::add(core::KeyframeId id,
                               std::shared_ptr<const features::PhotometricSamples> samples) {
  if (kept_.size() >= kMost) kept_.erase(kept_.begin());
  kept_.emplace_back(id, std::move(samples));
}

void PhotometricKeyframes::recalibrate(const sensor::Recalibration& change) {
  for (auto& [id, samples] : kept_) {
    // Others may hold the samples: a copy is changed
    auto moved = std::make_shared<features::PhotometricSamples>(*samples);
    for (std::vector<features::PhotometricSample>& level : *moved) {
      for (features::PhotometricSample& s : level)
        s.point = change.point(s.point.cast<double>()).cast<float>();
    }
    samples = std::move(moved);
  }
}

std::shared_ptr<const features::PhotometricSamples> PhotometricKeyframes::find(core::KeyframeId id) const {
  for (auto it = kept_.rbegin(); it != kept_.rend(); ++it) {
    if (it->first == id) return it->second;
  }
  return nullptr;
}

std::optional<optimize::PhotometricFamily> PhotometricKeyframes::associate(
    const maps::Map& map, const std::vector<core::KeyframeId>& keyframes, std::size_t level,
    const PhotometricView& view, const Rigid3& camera_from_world) const {
  if (view.image == nullptr) return std::nullopt;

  // The first keyframe that shares enough of the image
  for (const core::KeyframeId id : keyframes) {
    const auto samples = find(id);
    if (samples == nullptr) continue;
    auto family = associate_photometric(*samples, level, view, map.camera_from_world(id), camera_from_world);
    if (family) return family;
  }
  return std::nullopt;
}

std::optional<optimize::PhotometricFamily> associate_photometric(const features::PhotometricSamples& samples,
                                                                 std::size_t level,
                                                                 const PhotometricView& view,
                                                                 const Rigid3& reference_from_world,
                                                                 const Rigid3& camera_from_world) {
  auto family = photometric_in_view(samples, level, view, reference_from_world, camera_from_world);
  return family && update_photometric(*family, camera_from_world) ? std::move(family) : std::nullopt;
}

std::optional<optimize::PhotometricFamily> photometric_in_view(const features::PhotometricSamples& samples,
                                                               std::size_t level, const PhotometricView& view,
                                                               const Rigid3& reference_from_world,
                                                               const Rigid3& camera_from_world) {
  const cv::Mat& image = (*view.image)[level];
  if (image.empty() || static_cast<int>(samples[level].size()) < kMinPhotometric) return std::nullopt;

  optimize::PhotometricFamily family;
  family.image = image;
  family.camera = features::photometric_camera(view.camera, level);
  family.reference_from_world = reference_from_world;

  // From the reference to this camera, in single precision
  const Rigid3 camera_from_reference = camera_from_world * reference_from_world.inverse();
  const Eigen::Matrix3f rotation = camera_from_reference.rotation.cast<float>();
  const Eigen::Vector3f translation = camera_from_reference.translation.cast<float>();
  const Eigen::Matrix3f depth_rotation = view.depth_from_camera.rotation.cast<float>();
  const Eigen::Vector3f depth_translation = view.depth_from_camera.translation.cast<float>();
  const auto fx = static_cast<float>(family.camera.fx), fy = static_cast<float>(family.camera.fy);
  const bool with_depth = view.depth != nullptr && !view.depth->empty();
  family.terms.reserve(samples[level].size());

  // Samples in view that no other surface hides
  for (const features::PhotometricSample& s : samples[level]) {
    const Eigen::Vector3f p = rotation * s.point + translation;
    if (!(p.z() > 0.1F)) continue;
    if (!family.camera.contains(family.camera.project(p.cast<double>()), 2.0)) continue;
    if (with_depth && hidden(view, depth_rotation * p + depth_translation)) continue;

    optimize::PhotometricTerm term;
    term.point = s.point;
    term.value = s.value;

    // Image gradient times the derivatives of the projection
    const float per_z = 1.0F / s.point.z();
    const Eigen::Vector3f by_point(
        s.gradient.x() * fx * per_z, s.gradient.y() * fy * per_z,
        -(s.gradient.x() * fx * s.point.x() + s.gradient.y() * fy * s.point.y()) * per_z * per_z);
    term.derivative.head<3>() = by_point;
    term.derivative.tail<3>() = s.point.cross(by_point);
    family.terms.push_back(term);
  }

  if (static_cast<int>(family.terms.size()) < kMinPhotometric) return std::nullopt;
  return family;
}

bool update_photometric(optimize::PhotometricFamily& family, const Rigid3& camera_from_world) {
  family.gain = 0.0;  // residuals are the observed grey values
  family.sigma = 1.0;
  for (optimize::PhotometricTerm& term : family.terms) term.weight = 1.0F;
  const std::vector<float> seen = optimize::photometric_residuals(family, camera_from_world);
  std::vector<float> sizes, expected;
  sizes.reserve(seen.size());
  expected.reserve(seen.size());

  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (std::isnan(seen[i])) continue;
    sizes.push_back(std::abs(seen[i]));
    expected.push_back(std::abs(family.terms[i].value));
  }

  // Gain between both images, by medians
  if (static_cast<int>(sizes.size()) < kMinPhotometric) return false;
  family.gain = std::clamp(
      static_cast<double>(median_size(sizes)) / std::max(static_cast<double>(median_size(expected)), 1e-3),
      1.0 / kLargestGain, kLargestGain);
  sizes.clear();

  // Noise from the median absolute residual
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (!std::isnan(seen[i]))
      sizes.push_back(std::abs(seen[i] - static_cast<float>(family.gain) * family.terms[i].value));
  }

  family.sigma = std::max(kMinSigma, 1.4826 * static_cast<double>(median_size(sizes)));
  weigh_by_depth(camera_from_world * family.reference_from_world.inverse(), family);
  return true;
}

ShiftedPose search_shift(const optimize::PhotometricFamily& family, const Rigid3& camera_from_world) {
  constexpr int kReach = 6;  // pixels
  const Rigid3 camera_from_reference = camera_from_world * family.reference_from_world.inverse();

  // The mean distance converts pixels to metres
  double distance = 0.0;
  for (const optimize::PhotometricTerm& term : family.terms)
    distance += (camera_from_reference * term.point.cast<double>()).z();
  distance /= static_cast<double>(std::max<std::size_t>(1, family.terms.size()));

  // The shift of the highest correlation
  ShiftedPose best;
  for (int dy = -kReach; dy <= kReach; ++dy) {
    for (int dx = -kReach; dx <= kReach; ++dx) {
      Rigid3 pose = camera_from_world;
      pose.translation +=
          Eigen::Vector3d(dx * distance / family.camera.fx, dy * distance / family.camera.fy, 0.0);
      const double correlation = optimize::photometric_correlation(family, pose, kMinPhotometric);
      if (correlation > best.correlation) best = {pose, correlation};
    }
  }
  return best;
}

bool photometric_agrees(const optimize::PhotometricFamily& family, const Rigid3& camera_from_world) {
  return optimize::photometric_correlation(family, camera_from_world, kMinPhotometric) >= kMinCorrelation;
}

std::size_t best_hypothesis(const std::vector<std::optional<double>>& agreement) {
  std::size_t best = 0;
  for (std::size_t i = 1; i < agreement.size(); ++i) {
    if (!agreement[i]) continue;

    // A later hypothesis must be clearly better
    const double least = agreement[best] ? *agreement[best] + kBetterAgreement : kGoodAgreement;
    if (*agreement[i] >= least) best = i;
  }
  return best;
}

}  // namespace plumbline::tracking
