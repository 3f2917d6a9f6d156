// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Record of robots that meet while they map: lines in the log (Fig. 3 of the paper), and for each meeting a
// folder meetings/0001_A_B with poses, evidence and a picture of the maps in one frame. These are previews:
// the finished maps decide.
#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "plumbline/core/log.hpp"
#include "plumbline/mapping/merging/merge_server.hpp"
#include "plumbline/viz/scene.hpp"

namespace plumbline::pipeline {

/// Two robots that met while they mapped, or a meeting that was taken back.
struct Meeting {
  int number = 0;  ///< from 1 on
  std::string a;
  std::string b;
  double time_s = 0.0;     ///< time in the recordings
  std::int64_t frame = 0;  ///< number of the frame in the run; of a hub: of the search
  bool taken_back = false;
};

class MeetingLog {
 public:
  /// Folders are made below `output`/meetings.
  MeetingLog(std::filesystem::path output, core::Log& log) : output_(std::move(output)), log_(&log) {}

  /// `names`: by robot. `when`: text such as "after 3.2 s"; `time_s`: time in the recordings, negative:
  /// there is none. Errors (kOutput): the meeting's folder cannot be written.
  core::Result<void> note(const mapping::MeetingEvent& event, const std::vector<std::string>& names,
                          const std::string& when, double time_s);
  /// Pictures of all meetings, map.png in their folders; when there is time. Errors (kOutput): as note().
  core::Result<void> draw();
  [[nodiscard]] const std::vector<Meeting>& meetings() const { return meetings_; }

 private:
  core::Result<void> write(const mapping::MeetingEvent& event, const std::vector<std::string>& names,
                           const std::string& when);

  std::filesystem::path output_;
  core::Log* log_;
  std::vector<Meeting> meetings_;
  std::vector<std::pair<std::filesystem::path, viz::Scene>> pictures_;
};

}  // namespace plumbline::pipeline
