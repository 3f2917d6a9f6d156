// SPDX-License-Identifier: BSD-3-Clause
#include "recording_opener.hpp"

#include "plumbline/pipeline/input.hpp"

namespace plumbline::cli {

/// Opens recordings of a result with the shipped calibrations.
exports::OpenRecording recording_opener(Session& session) {
  return [&session](
             const exports::RecordingName& name) -> core::Result<std::unique_ptr<dataset::FrameSource>> {
    const auto folder = session.pipelines_folder();
    if (!folder) return tl::unexpected<core::Error>(folder.error());
    dataset::OpenOptions open;
    open.camera = name.camera;
    open.format = name.format.empty() ? "auto" : name.format;
    open.cameras_folder = *folder / "cameras";
    return pipeline::open_input(name.input, open, *folder / "scenes", session.executor(), session.console());
  };
}

}  // namespace plumbline::cli
