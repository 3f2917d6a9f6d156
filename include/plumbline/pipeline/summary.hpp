// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// What is said of a finished run: summary.json and timing.csv.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "plumbline/core/error.hpp"
#include "plumbline/core/numbers.hpp"
#include "plumbline/dataset/frame_source.hpp"
#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/mapping/camera_calibration.hpp"
#include "plumbline/mapping/loop_closer.hpp"
#include "plumbline/mapping/map_fusion.hpp"
#include "plumbline/mapping/refinement.hpp"
#include "plumbline/maps/frame_pose.hpp"
#include "plumbline/pipeline/run.hpp"

namespace plumbline::pipeline {

/// Of many standard deviations the middle one and the one that nine of ten do not pass; 0: not known.
struct Sigma {
  double median = 0.0;
  double p90 = 0.0;
};
template <typename T>
Sigma sigma_of(const std::vector<T>& values) {
  return {static_cast<double>(core::quantile(values, 0.5, T(0))),
          static_cast<double>(core::quantile(values, 0.9, T(0)))};
}

struct RunSummary {
  std::string input;
  std::string pipeline;
  std::string reason;  ///< why the result must not be trusted as it is; empty = nothing speaks against it
  std::string input_doubt;  ///< what the recording itself gives reason to doubt (FrameSource::doubt)
  bool stopped = false;     ///< ended early on request
  struct Frames {
    std::size_t available = 0;   ///< in the recording, after --from --to --every
    std::size_t read = 0;        ///< decoded
    std::size_t resumed = 0;     ///< of these, by the run that this one went on from
    std::size_t unreadable = 0;  ///< skipped
    std::size_t odometry =
        0;  ///< with a pose of the recorder's own odometry, from which they were looked for
    std::size_t tracked = 0;
    std::size_t lost = 0;  ///< read but not tracked
    std::size_t longest_loss = 0;
    [[nodiscard]] double tracked_percent() const;  ///< of read + unreadable
  } frames;
  std::size_t keyframes = 0;
  /// Keyframes by what they were made for; the first of each robot, and those of a run that this one went on
  /// from, are not among them.
  struct Causes {
    std::size_t cone = 0;
    std::size_t urgent = 0;
    std::size_t plain = 0;
  } causes;
  std::size_t points = 0;  ///< point landmarks
  std::size_t lines = 0;   ///< line landmarks
  struct Loops {
    std::size_t candidates = 0;
    std::size_t verified = 0;
    std::size_t accepted = 0;    ///< times that loops moved the map
    std::size_t rejected = 0;    ///< of the verified, taken for wrong by the pose graph
    std::size_t taken_back = 0;  ///< relocalisations that gave way to loops that agreed against them
    std::vector<mapping::LoopDispute> disputes;  ///< loops that agree against the path
    std::vector<mapping::LoopTrial> trials;
  } loops;
  /// What maps of other robots were used for.
  struct Feedback {
    bool on = false;
    std::size_t keyframes = 0;    ///< of others that came
    std::size_t relocalised = 0;  ///< frames
    std::size_t loops = 0;        ///< that moved the map
  } feedback;
  mapping::RefinementSummary refine;
  Sigma sigma_position_m;  ///< of keyframes beside the first one
  Sigma sigma_rotation_rad;
  /// What a robot's own map told about its camera.
  struct Camera {
    std::string robot;
    std::vector<mapping::CameraFinding> findings;
    double gain = 0.0;           ///< by which share parts of the map fit better that it was not found from
    std::string note;            ///< why nothing was found; empty: it was looked for
    std::string doubt;           ///< why the camera must not be trusted; empty: nothing speaks against it
    int asked = 0;               ///< times; the second time of a map made with what was found the first time
    std::size_t from_frame = 0;  ///< what was found is used from this frame on; 0: from the first
  };
  std::vector<Camera> cameras;
  /// Two maps that were held against each other.
  struct Merge {
    std::string a;
    std::string b;
    double time_s = -1.0;  ///< of the recordings, when it happened while mapping; negative: afterwards
    /// When the fifth keyframe of those that agree was there on both sides, or the last of fewer; negative:
    /// not known.
    double evident_s = -1.0;
    mapping::MergeEvidence evidence;
  };
  std::vector<Merge> merges;
  /// Two robots that met while they mapped, or a meeting that was taken back.
  struct Meeting {
    int number = 0;  ///< from 1 on
    std::string a;
    std::string b;
    double time_s = 0.0;     ///< of the recordings
    std::int64_t frame = 0;  ///< of the run
    bool taken_back = false;
  };
  std::vector<Meeting> meetings;
  /// The path as it was written beside what the tracker saw from frame to frame.
  struct Path {
    maps::PathCheck check;
    std::size_t refused = 0;  ///< adjustments of the map that would have torn it and were not used
  } path;
  struct Robot {
    std::string name;
    std::size_t keyframes = 0;
  };
  std::vector<Robot> robots;  ///< of several recordings
  /// A robot that lost itself goes on in another component of its map.
  struct Component {
    std::string name;        ///< of its folder, or of the robot and the keyframe that began it
    std::size_t frames = 0;  ///< tracked in it
    std::size_t keyframes = 0;
    bool joined = false;  ///< it is part of the result
    double joined_s =
        -1.0;             ///< of the recording, when that was found out while mapping; negative: at the end
    int agreeing = 0;     ///< keyframes that say so
    std::string why_not;  ///< empty: joined
  };
  std::vector<Component> components;  ///< empty: the map is in one piece from the first frame on
  /// Components of too few keyframes, whose frames have no pose.
  struct Dropped {
    std::size_t components = 0;
    std::size_t frames = 0;
  } dropped;
  std::string unconnected;  ///< maps of robots that are left out, and what was tried; empty: none
  std::size_t cloud_points = 0;
  double voxel_m = 0.0;             ///< of the merged cloud; 0: none was to be made
  Sigma cloud_sigma_m;              ///< of its points along their normals
  std::size_t measured_points = 0;  ///< depths on the grid of the keyframes' clouds; 0: not known
  /// What became no point of these clouds.
  struct LeftOut {
    std::string by;  ///< a filter's type, or "depth_limits": outside min_depth and max_depth
    std::size_t points = 0;
  };
  std::vector<LeftOut> left_out;         ///< in the order in which it was left out
  std::vector<LeftOut> left_out_of_map;  ///< points of the merged cloud that its filters left out
  std::string up = "none";               ///< what the output's frame stands on: floor, camera or none
  std::string yaw = "none";              ///< where its x points: walls, camera or none
  geometry::Rigid3 output_from_map;      ///< to that frame from the one that tracking began in
  double wall_s = 0.0;                   ///< the whole run
  double map_s = 0.0;                    ///< first frame read to last change of the map
  double export_s = 0.0;                 ///< clouds, pictures and tables
  double pace_hz = 0.0;                  ///< that recordings were played at; 0: as fast as that went
  double behind_s = 0.0;                 ///< how long after it was due the latest frame was done
  std::vector<StageTiming> stages;       ///< in graph order
  std::vector<StageTiming> parts;        ///< of stages, as "stage.part": by frame; NaN: nothing to do
  double peak_rss_mb = 0.0;
  int threads = 0;
  int seed = 0;

  [[nodiscard]] double fps() const;  ///< frames read over wall_s less export_s; 0 when nothing was read
};

/// Sets `reason` when tracking was lost for more than 10 % of the frames, the map has torn or the cloud that
/// was to be made is empty.
void judge(RunSummary& summary);

/// The one place that writes summary.json. Errors (kOutput) name the file.
core::Result<void> write_summary(const std::filesystem::path& file, const RunSummary& summary);

/// One line a frame: its number, stamp, the milliseconds of every stage and part (empty = nothing to do), and
/// the memory the process held when the frame was done, MB.
core::Result<void> write_timing(const std::filesystem::path& file, const RunReport& report,
                                const std::vector<StageTiming>& parts, const dataset::FrameSource& source);

/// A few lines for people.
std::string to_text(const RunSummary& summary);

/// Most memory this process ever held, MB.
double peak_rss_mb();

/// Memory this process holds now, MB; NaN where the system does not tell.
double rss_mb();

}  // namespace plumbline::pipeline
