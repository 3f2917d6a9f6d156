// SPDX-License-Identifier: BSD-3-Clause
// Measures a trajectory against the truth that comes with a recording.
//
//   evaluate_trajectory TRAJECTORY.txt INPUT PIPELINES
#include <cstdio>

#include "plumbline/core/error.hpp"
#include "plumbline/dataset/trajectory_io.hpp"
#include "plumbline/evaluate/trajectory.hpp"
#include "plumbline/pipeline/input.hpp"

using namespace plumbline;

namespace {

/// Prints the message; returns the exit code that the program uses for this kind of error.
int fail(const core::Error& error) {
  std::fprintf(stderr, "%s\n", error.message.c_str());
  return static_cast<int>(error.kind);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fprintf(stderr, "usage: evaluate_trajectory TRAJECTORY.txt INPUT PIPELINES\n");
    return 2;
  }

  const std::filesystem::path pipelines = argv[3];
  const core::Executor executor;
  const auto log = core::stderr_log(core::LogLevel::kWarning);
  dataset::OpenOptions options;
  options.cameras_folder = pipelines / "cameras";
  const auto estimate = dataset::read_trajectory(argv[1]);
  if (!estimate) return fail(estimate.error());

  const auto source = pipeline::open_input(argv[2], options, pipelines / "scenes", executor, *log);
  if (!source) return fail(source.error());

  const auto truth = (*source)->truth();
  if (!truth) {
    std::fprintf(stderr, "%s: comes without truth (groundtruth.txt)\n", argv[2]);
    return static_cast<int>(core::ErrorKind::kInput);
  }

  const auto report = evaluate::evaluate_trajectory(*estimate, *truth);
  if (!report) return fail(report.error());
  std::printf("%s\n", evaluate::to_text(*report).c_str());
  std::printf("%zu poses, ATE %.4f m\n", report->matched, report->ate_m.rmse);
}
