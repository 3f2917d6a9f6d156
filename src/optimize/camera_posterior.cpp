// SPDX-License-Identifier: BSD-3-Clause
// The camera as a mixture: which groups of its file are right, and by how much the others are wrong.
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "plumbline/optimize/camera_calibration.hpp"

namespace plumbline::optimize {
namespace {

constexpr int kLeastBlocks = 8;      // for a covariance from their scatter
constexpr double kFewBlocks = 4.0;   // times the formal covariance, if there are fewer
constexpr double kOwnScatter = 0.5;  // weight of the blocks' scatter beside the formal covariance
constexpr double kSofter = 1e-4;     // information, in units of wrong_sigma, of what nothing else measures

/// Errors that the evidence does not show in its own scatter: what tracking with a slightly wrong camera and
/// the noise model leave. Measured on generated worlds (docs/notes).
CameraChange model_sigma() {
  CameraChange sigma;
  sigma[kFocal] = 0.001;
  sigma[kReadout] = 0.0003;
  sigma[kSlopeX] = sigma[kSlopeY] = 0.0005;
  sigma[kCentreX] = sigma[kCentreY] = 0.7;
  sigma[kK1] = sigma[kK2] = 0.0015;
  sigma[kDelay] = 0.0008;
  return sigma;
}

/// A normal distribution of the change, as the evidence alone has it.
struct Measured {
  CameraChange mean;
  CameraCovariance covariance;
};

/// The minimum of the evidence and its covariance: S^-1 M S^-1, where S is the second derivative and M the
/// scatter of the blocks' gradients at the minimum, drawn towards the formal one (M = S) times the mean
/// chi-square.
Measured measured_by(const std::vector<CameraEvidence>& evidence, const CameraPrior& prior) {
  const auto unit = prior.wrong_sigma.asDiagonal();

  // Sum of all evidence, in units of the prior
  CameraCovariance information = kSofter * CameraCovariance::Identity();
  CameraChange gradient = CameraChange::Zero();  // at the prior's mean
  for (const CameraEvidence& e : evidence) {
    information += unit * e.all.information * unit;
    gradient += unit * (e.all.gradient + e.all.information * (prior.mean - e.at));
  }
  const Eigen::LLT<CameraCovariance> factor(information);
  const CameraChange found = -factor.solve(gradient);

  // Scatter of the blocks' gradients at the minimum
  CameraCovariance scatter = CameraCovariance::Zero();
  int blocks = 0;
  for (const CameraEvidence& e : evidence) {
    for (const EvidenceBlock& b : e.blocks) {
      const CameraChange here = unit * (b.gradient + b.information * (prior.mean + unit * found - e.at));
      scatter += here * here.transpose();
      ++blocks;
    }
  }

  // Few blocks do not show their scatter
  CameraCovariance middle = kFewBlocks * information;
  if (blocks >= kLeastBlocks) {
    scatter *= static_cast<double>(blocks) / (blocks - 1);
    const double chi2 = std::max(1.0, factor.solve(scatter).trace() / kCameraUnknowns);
    middle = kOwnScatter * scatter + (1.0 - kOwnScatter) * chi2 * information;
  }

  // Sandwich covariance, plus errors of the model
  const CameraCovariance half = factor.solve(middle);
  const CameraCovariance covariance = factor.solve(CameraCovariance(half.transpose()));
  const CameraCovariance model = model_sigma().cwiseAbs2().asDiagonal();
  return {prior.mean + unit * found, unit * covariance * unit + model};
}

/// One choice of the groups that are wrong.
struct Case {
  double log_weight = 0.0;
  std::array<bool, kCameraGroups> wrong{};
  CameraChange mean;
  CameraCovariance covariance;
};

double log_normal_cdf(double x) {
  return x < -8.0 ? -0.5 * x * x - std::log(-x * 2.5066) : std::log(0.5 * std::erfc(-x / std::sqrt(2.0)));
}

/// The evidence combined with the prior of one choice, and how likely that makes it.
Case combined(const Measured& measured, const CameraPrior& prior,
              const std::array<bool, kCameraGroups>& wrong) {
  Case one;
  one.wrong = wrong;
  CameraChange variance;
  for (std::size_t u = 0; u < kCameraUnknowns; ++u) {
    const bool is_wrong = wrong[group_of(static_cast<CameraUnknown>(u))];
    variance[static_cast<Eigen::Index>(u)] =
        std::pow((is_wrong ? prior.wrong_sigma : prior.right_sigma)[static_cast<Eigen::Index>(u)], 2);
  }

  // Kalman update of the prior by the evidence
  const CameraCovariance spread = measured.covariance + CameraCovariance(variance.asDiagonal());
  const Eigen::LLT<CameraCovariance> factor(spread);
  const CameraChange off = measured.mean - prior.mean;
  const CameraChange answer = factor.solve(off);
  one.mean = prior.mean + variance.asDiagonal() * answer;
  one.covariance = variance.asDiagonal();
  one.covariance -= variance.asDiagonal() * factor.solve(CameraCovariance(variance.asDiagonal()));

  one.log_weight = -0.5 * off.dot(answer) - CameraCovariance(factor.matrixL()).diagonal().array().log().sum();
  for (std::size_t g = 0; g < kCameraGroups; ++g)
    one.log_weight += std::log(std::max(1e-300, wrong[g] ? prior.wrong[g] : 1.0 - prior.wrong[g]));

  // A readout time is not negative: the prior of a wrong one is half a normal distribution.
  double& readout = one.mean[kReadout];
  if (wrong[kReadoutGroup])
    one.log_weight += std::log(2.0) + log_normal_cdf(readout / std::sqrt(one.covariance(kReadout, kReadout)));
  readout = std::max(0.0, readout);
  return one;
}

}  // namespace

CameraGroup group_of(CameraUnknown unknown) {
  switch (unknown) {
    case kFocal:
      return kFocalGroup;
    case kReadout:
      return kReadoutGroup;
    case kSlopeX:
    case kSlopeY:
      return kSlopeGroup;
    case kCentreX:
    case kCentreY:
      return kCentreGroup;
    case kDelay:
      return kDelayGroup;
    default:
      return kLensGroup;
  }
}

CameraPosterior camera_posterior(const std::vector<CameraEvidence>& evidence, const CameraPrior& prior) {
  const Measured measured = measured_by(evidence, prior);

  // Every choice of groups whose prior is wrong
  std::vector<Case> cases;
  for (unsigned choice = 0; choice < 1U << kCameraGroups; ++choice) {
    std::array<bool, kCameraGroups> wrong{};
    for (std::size_t g = 0; g < kCameraGroups; ++g) wrong[g] = (choice >> g & 1U) != 0;
    cases.push_back(combined(measured, prior, wrong));
  }

  // Weights relative to the largest, against underflow
  double most = cases.front().log_weight;
  for (const Case& one : cases) most = std::max(most, one.log_weight);
  double sum = 0.0;
  for (Case& one : cases) sum += std::exp(one.log_weight - most);

  // Mean and covariance of the mixture
  CameraPosterior posterior;
  for (const Case& one : cases) {
    const double weight = std::exp(one.log_weight - most) / sum;
    posterior.mean += weight * one.mean;
    for (std::size_t g = 0; g < kCameraGroups; ++g) posterior.wrong[g] += one.wrong[g] ? weight : 0.0;
  }

  for (const Case& one : cases) {
    const double weight = std::exp(one.log_weight - most) / sum;
    const CameraChange off = one.mean - posterior.mean;
    posterior.covariance += weight * (one.covariance + off * off.transpose());
  }

  return posterior;
}

}  // namespace plumbline::optimize
