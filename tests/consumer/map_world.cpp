// SPDX-License-Identifier: BSD-3-Clause
// Maps a generated world as `plumbline map` does, which takes every layer below: map_world OUT PIPELINES
#include <cstdio>

#include "plumbline/pipeline/map_recording.hpp"

using namespace plumbline;

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  pipeline::MapRequest request;
  request.input = "synth:room?frames=20&width=160&height=120";
  request.output = argv[1];
  request.pipelines_folder = argv[2];
  request.open.cameras_folder = request.pipelines_folder / "cameras";

  const core::Executor executor;
  const auto log = core::stderr_log(core::LogLevel::kWarning);
  const auto summary = pipeline::map_recording(request, executor, *log, core::StopToken(), {});
  if (!summary) {
    std::fprintf(stderr, "%s\n", summary.error().message.c_str());
    return static_cast<int>(summary.error().kind);
  }

  std::printf("%s", summary->text.c_str());
  return 0;
}
