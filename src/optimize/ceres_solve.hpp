// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ceres/problem.h>
#include <ceres/solver.h>
#include <glog/logging.h>

namespace plumbline::optimize {

/// ceres::Solve on one thread, so that sums keep their order, and in silence: libraries do not print, and a
/// step that cannot be solved for is tried again with more damping.
inline ceres::Solver::Summary solve(ceres::Solver::Options options, ceres::Problem& problem) {
  static const int quiet = FLAGS_minloglevel = google::GLOG_FATAL;
  static_cast<void>(quiet);
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  return summary;
}

}  // namespace plumbline::optimize
