// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The map store, map.db: an SQLite file that holds a map exactly, written as the run goes
// (docs/reference/store.md). A process that is killed leaves a file that opens and holds every keyframe that
// was added.
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "plumbline/cloud/types.hpp"
#include "plumbline/core/error.hpp"
#include "plumbline/maps/frame_pose.hpp"
#include "plumbline/maps/map.hpp"
#include "plumbline/sensor/camera.hpp"

namespace plumbline::maps {

/// Stores of other formats are refused.
constexpr int kStoreFormat = 11;
constexpr const char* kStoreFile = "map.db";  ///< in a result folder

/// A robot's refined camera, found while its map grew or when it was finished.
struct CameraVersion {
  sensor::Camera camera;
  std::int32_t first_keyframe = 0;  ///< keyframes from this number on were read as this camera's
  std::int32_t first_frame = 0;     ///< frames of the robot's path, likewise
};

/// Knowledge of a robot's camera in a run: when it was asked for, and its posterior.
struct CameraEstimate {
  std::int64_t asked_at = -1;  ///< frame of the run whose maps it is estimated from while mapping; -1: none
  std::int64_t used_from = 0;  ///< frame of the run from which `found` is used; 0: the first, or it is not
  std::int32_t answers = 0;    ///< number of estimates that have ended
  std::int32_t views = 0;      ///< most views of one of them
  bool better = false;         ///< `found` replaces the file's
  double gain = 0.0;           ///< improvement of the fit, share
  std::string note;            ///< why there is no estimate; empty: there is one
  std::string doubt;           ///< why the camera must not be trusted; empty: it may be
  sensor::Camera found;
  /// Covariance of changes of `found`, in the order of optimize::CameraUnknown.
  Eigen::Matrix<double, 9, 9> covariance = Eigen::Matrix<double, 9, 9>::Zero();
  std::array<double, 6> wrong{};  ///< probability that the file is, 0 to 1, by optimize::CameraGroup
};

/// A robot of a map. All images are rectified to the pinhole of `camera`, also after refinement. Keyframes
/// and landmarks are those of the latest version; clouds and their surfaces are stored as they were read, and
/// CameraHistory converts them to the latest version.
struct RobotInfo {
  std::int32_t number = 0;  ///< number in the map's ids
  std::string name;
  sensor::Camera camera;                     ///< the given one
  std::vector<CameraVersion> versions = {};  ///< refined versions in order; empty: none
  std::optional<CameraEstimate> estimate = {};
};

/// Header of a store, written once when it is made.
struct StoreHeader {
  std::vector<RobotInfo> robots;  ///< by number
  std::string configuration;      ///< the effective one, YAML
  std::string input;              ///< input as text, to check that a resumed run is given the same
  std::string program_version;    ///< core::version() of the program that made the file
  int format = kStoreFormat;      ///< set by the reader; the writer always writes kStoreFormat
};

/// The camera of a robot; for a robot that does not exist the first one's, or none.
sensor::Camera camera_of(const std::vector<RobotInfo>& robots, std::int32_t robot);

/// The frame that results are written in, as far as it is known.
struct ResultFrame {
  geometry::Rigid3 output_from_map;
  bool upright = false;  ///< z is up in it
};

/// Everything in a store except clouds; if the robots' maps are not merged yet, of one robot.
struct StoredMap {
  StoreHeader header;
  bool complete = false;    ///< save_final was the last thing that happened
  std::int32_t robot = -1;  ///< robot whose own map this is; -1: the map is the only one
  Map map;
  std::vector<FramePose> frames;  ///< by robot, in order
  std::vector<std::string> log;   ///< a line a frame of the run, as frames.csv has it, by robot
  ResultFrame result;             ///< of a store that is not complete: the map's own frame
};

/// Contents of a store, without reading it all.
struct StoreContents {
  bool complete = false;
  std::size_t keyframes = 0;
  std::size_t points = 0;  ///< landmarks
  std::size_t lines = 0;
  std::size_t edges = 0;
  std::size_t loops = 0;
  std::size_t frames = 0;
  std::size_t keyframe_clouds = 0;
  std::size_t frame_clouds = 0;
  std::uint64_t cloud_bytes = 0;  ///< of both
  std::vector<std::string> attachments;
};

/// Part of a keyframe's cloud that is needed whenever its map is read: the cloud thinned to one sample per
/// voxel and direction, in the frame of the keyframe's camera.
struct StoredSurface {
  double voxel_m = 0.0;
  std::vector<SurfaceSample> samples;
};

/// A cloud on its way into a store: bytes of cloud::encode_cloud.
struct StoreCloud {
  KeyframeId keyframe;  ///< keyframe of the cloud; invalid: it is a frame's
  FrameId frame;        ///< frame of a cloud between keyframes
  std::shared_ptr<const std::vector<std::uint8_t>> bytes;
  std::shared_ptr<const StoredSurface> surface = nullptr;  ///< of a keyframe's cloud; null: none is kept
};

/// A keyframe's picture on its way into a store: the bytes of JPEG files.
struct StorePicture {
  KeyframeId keyframe;
  std::vector<std::uint8_t> small;  ///< 160 pixels wide
  std::vector<std::uint8_t> whole;  ///< rectified to RobotInfo::camera; empty: not kept
};

/// Additions of a run in one transaction.
struct StoreStep {
  /// Robot whose own map this is, besides those of others; -1: the map is the only one.
  std::int32_t robot = -1;
  std::shared_ptr<const MapChanges> map;  ///< since the last step's of this robot
  std::vector<FramePose> frames;          ///< frames since then
  bool frames_anew = false;               ///< `frames` are all of `robot`: its map was made anew
  std::vector<std::string> log;           ///< lines that came since
  std::vector<StoreCloud> clouds;
  std::vector<StorePicture> pictures = {};
  /// All robots, if there are news of a camera. If that of one was replaced, keyframes and edges of `map`,
  /// which is whole in that case, were recomputed. Null: no news.
  std::shared_ptr<const std::vector<RobotInfo>> robots = nullptr;
};

/// Ways to make a new store.
enum class StoreUse {
  kGrowing,  ///< during a run: however the program ends, the file holds everything added
  kInOneGo,  ///< at the end of a run, quicker: nothing can be relied on before save_final()
};

/// One writer per file at a time; not thread-safe. A call that fails leaves the file as it was before the
/// call, and may be tried again.
class StoreWriter {
 public:
  /// Makes a new file. Errors (kOutput): it exists already, its folder does not exist, disk full.
  static core::Result<StoreWriter> create(const std::filesystem::path& file, const StoreHeader& header,
                                          StoreUse use = StoreUse::kGrowing);
  /// Continues the file of an earlier run. Errors (kInput) as StoreReader::open; (kOutput): it is in use.
  static core::Result<StoreWriter> resume(const std::filesystem::path& file);
  StoreWriter(StoreWriter&& other) noexcept;
  StoreWriter& operator=(StoreWriter&&) = delete;
  /// Closes the store as a single file without a log beside it, unless another program is reading it.
  ~StoreWriter();

  /// One transaction: brings the file up to `map` and `frames`, in which `keyframe` is new, and adds the
  /// keyframe's cloud (bytes of cloud::encode_cloud; may be empty). Only what changed since the last call is
  /// written, but all landmarks are looked at: 20 to 40 ms for 100 000. Errors (kOutput): disk full, I/O.
  core::Result<void> add_keyframe(const Map& map, KeyframeId keyframe, const std::vector<std::uint8_t>& cloud,
                                  const std::vector<FramePose>& frames = {});
  /// The same at a bounded cost: one transaction that adds what came since the last step. What the map had
  /// before must be in the file. Errors (kOutput): disk full, I/O; the next step must be of a whole map then.
  core::Result<void> add(const StoreStep& step);
  /// A cloud that comes without a keyframe, or replaces one. One transaction.
  core::Result<void> add_cloud(const StoreCloud& cloud);
  /// Stores further data, such as a vocabulary, under a name; replaces earlier data of that name. One
  /// transaction.
  core::Result<void> attach(const std::string& name, const std::vector<std::uint8_t>& bytes);
  /// The finished map, in one transaction: poses, landmarks and edges after all optimisation, all frames. It
  /// is the only one then, of the robots that `robots` lists (empty: those of the header). Marks the store as
  /// complete and leaves one file, as the destructor does. Of `rest`, logs, clouds and
  /// pictures are added.
  core::Result<void> save_final(const Map& map, const std::vector<FramePose>& frames,
                                const ResultFrame& result = {}, const std::vector<StoreStep>& rest = {},
                                const std::vector<RobotInfo>& robots = {});

 private:
  struct Impl;
  explicit StoreWriter(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// Reads a store, also one that is being written: then each call sees the keyframes committed by then. Clouds
/// may be read from several threads at a time; several readers may read one file.
class StoreReader {
 public:
  /// Errors (kInput): it does not exist, is not a map store, is damaged or of another format.
  static core::Result<StoreReader> open(const std::filesystem::path& file);
  StoreReader(StoreReader&& other) noexcept;
  StoreReader& operator=(StoreReader&&) = delete;
  ~StoreReader();

  [[nodiscard]] const StoreHeader& header() const;
  /// Asks the system to read the whole file from disk ahead.
  void read_ahead() const;
  /// The map as it was committed: equal in every bit, order and id. The points' look-up grid is rebuilt for
  /// images of the camera's size. `robot`: whose map, if those of several are not merged yet. Errors
  /// (kInput): damaged, or there are several maps and none of that name.
  [[nodiscard]] core::Result<StoredMap> load(const std::string& robot = {}) const;
  /// The same for every map in the store: by robot, if their maps are not merged yet.
  [[nodiscard]] core::Result<std::vector<StoredMap>> load_each() const;
  /// Errors (kInput): damaged.
  [[nodiscard]] core::Result<StoreContents> contents() const;
  /// Keyframes that have a cloud, by id; also those that left the map.
  [[nodiscard]] core::Result<std::vector<KeyframeId>> cloud_ids() const;
  /// A keyframe's cloud, in its camera frame. Errors (kInput): it has none, damaged.
  [[nodiscard]] core::Result<cloud::CloudPtr> cloud(KeyframeId keyframe) const;
  [[nodiscard]] core::Result<std::vector<std::uint8_t>> cloud_bytes(KeyframeId keyframe) const;
  /// The coarse surface of a keyframe's cloud, for unpack_surface; empty: none was kept. Errors (kInput):
  /// damaged.
  [[nodiscard]] core::Result<std::vector<std::uint8_t>> surface_bytes(KeyframeId keyframe) const;
  /// Frames between keyframes that have a cloud.
  [[nodiscard]] core::Result<std::vector<FrameId>> frame_cloud_ids() const;
  [[nodiscard]] core::Result<cloud::CloudPtr> cloud(FrameId frame) const;
  [[nodiscard]] core::Result<std::vector<std::uint8_t>> cloud_bytes(FrameId frame) const;
  /// A keyframe's picture of 160 pixels, a JPEG file; empty: none was kept.
  [[nodiscard]] core::Result<std::vector<std::uint8_t>> small_picture(KeyframeId keyframe) const;
  /// The whole picture, a JPEG file, rectified to RobotInfo::camera; empty: none was kept.
  [[nodiscard]] core::Result<std::vector<std::uint8_t>> whole_picture(KeyframeId keyframe) const;
  /// Keyframes whose whole picture was kept, by id; also those that left the map.
  [[nodiscard]] core::Result<std::vector<KeyframeId>> whole_picture_ids() const;
  /// Empty if nothing has this name. Errors (kInput): damaged.
  [[nodiscard]] core::Result<std::optional<std::vector<std::uint8_t>>> attachment(
      const std::string& name) const;

 private:
  struct Impl;
  explicit StoreReader(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// A surface as it was kept, rounded. Errors (kInput): damaged.
core::Result<StoredSurface> unpack_surface(const std::vector<std::uint8_t>& bytes);

/// True if a file is a store whose run ended before anything was committed. Errors (kInput): the file does
/// not exist or is no SQLite file.
core::Result<bool> is_blank_store(const std::filesystem::path& file);

/// StoreReader::open and load.
core::Result<StoredMap> load_map(const std::filesystem::path& file);

}  // namespace plumbline::maps
