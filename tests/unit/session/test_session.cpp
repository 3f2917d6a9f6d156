// SPDX-License-Identifier: BSD-3-Clause
// The calls of plumbline.hpp: what they give is what the run writes, and failures are values.
#include <gtest/gtest.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <fstream>
#include <iterator>

#include "plumbline/dataset/convert.hpp"
#include "plumbline/dataset/live_frames.hpp"
#include "plumbline/pipeline/input.hpp"
#include "plumbline/pipeline/map_recording.hpp"
#include "plumbline/plumbline.hpp"

namespace plumbline {
namespace {

namespace fs = std::filesystem;

const char* const kWorld = "synth:room?frames=20&width=240&height=180&seed=3";
const std::vector<std::string> kPlain{"output.views=", "output.pcd=off"};

std::string bytes_of(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  EXPECT_TRUE(stream) << file;
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// The result of the call that the program makes.
fs::path mapped(const std::string& input, const fs::path& output) {
  pipeline::MapRequest request;
  request.input = input;
  request.replace = true;
  request.output = output;
  request.pipelines_folder = fs::path(PLUMBLINE_SOURCE_DIR) / "pipelines";
  request.overrides = kPlain;
  const auto run = pipeline::map_recording(request, core::Executor(1), *core::null_log(), {}, {});
  EXPECT_TRUE(run) << run.error().message;
  return output;
}

/// A frame as the camera gave it.
Frame stored(const dataset::FrameSource& source, std::size_t index) {
  const dataset::LiveFrame frame = *dataset::stored_frame(source, index);
  return {frame.stamp, frame.depth_stamp, frame.color, frame.depth, frame.odometry};
}

TEST(FrontDoor, MapsInATemporaryFolderWhatTheProgramMaps) {
  MapOptions options;
  options.set = kPlain;
  std::size_t shown = 0;
  options.progress = [&](std::size_t done, std::size_t) { shown = done; };
  fs::path folder;

  {
    const auto result = map(kWorld, {}, options);
    ASSERT_TRUE(result) << result.error().message;
    folder = result->folder();
    const fs::path expected = mapped(kWorld, fs::temp_directory_path() / "expected");
    for (const char* file : {"map.ply", "trajectory.txt", "keyframes.csv"})
      EXPECT_TRUE(bytes_of(folder / file) == bytes_of(expected / file)) << file;
    EXPECT_EQ(shown, 20U);

    const auto cloud = result->cloud();
    ASSERT_TRUE(cloud) << cloud.error().message;
    EXPECT_GT(cloud->cloud->size(), 1000U);
    EXPECT_EQ(cloud->columns.confidence.size(), cloud->cloud->size());
    const auto path = result->path();
    ASSERT_TRUE(path) << path.error().message;
    EXPECT_EQ(path->size(), 20U);
    EXPECT_EQ(result->camera()->color.width, 240);
    EXPECT_EQ(result->robots(), std::vector<std::string>{""});

    EXPECT_TRUE(result->verdict().trustworthy) << result->verdict().reason;
    EXPECT_NE(result->verdict().sentence.find("Shape"), std::string::npos) << result->verdict().sentence;
    EXPECT_DOUBLE_EQ(result->verdict().tracked, 1.0);
  }
  EXPECT_FALSE(fs::exists(folder)) << "the folder goes with the result";
}

TEST(FrontDoor, KeyframesHaveCovariancesOrAReasonAndPictures) {
  MapOptions options;
  options.set = kPlain;
  const auto result = map(kWorld, {}, options);
  ASSERT_TRUE(result) << result.error().message;
  const auto keyframes = result->keyframes();
  ASSERT_TRUE(keyframes) << keyframes.error().message;
  ASSERT_FALSE(keyframes->empty());

  const auto path = result->path();
  for (const Keyframe& keyframe : *keyframes) {
    EXPECT_EQ(keyframe.robot, "room");
    EXPECT_NE(keyframe.covariance.has_value(), !keyframe.no_covariance.empty());
    const auto at = geometry::pose_at(*path, keyframe.stamp);
    ASSERT_TRUE(at);
    EXPECT_LT((at->translation - keyframe.world_from_camera.translation).norm(), 1e-6);
  }

  // From the recording, as large as its frames.
  const auto picture = result->picture(keyframes->back());
  ASSERT_TRUE(picture) << picture.error().message;
  EXPECT_EQ(picture->size(), cv::Size(240, 180));
}

TEST(FrontDoor, FedFramesGiveTheBytesOfTheRecording) {
  const fs::path pipelines = *find_pipelines();
  const fs::path folder = fs::temp_directory_path() / "room";
  const core::Executor executor(1);
  const auto log = core::null_log();
  dataset::OpenOptions open;
  open.cameras_folder = pipelines / "cameras";
  const auto world = pipeline::open_input(kWorld, open, pipelines / "scenes", executor, *log);
  ASSERT_TRUE(world) << world.error().message;
  ASSERT_TRUE(dataset::convert_recording(**world, folder, {}, *log));
  const auto source = dataset::open_recording(folder, open, *log);
  ASSERT_TRUE(source) << source.error().message;

  MapperOptions options;
  options.set = kPlain;
  options.name = "room";
  auto mapper = Mapper::start((*source)->camera(), fs::temp_directory_path() / "fed", options);
  ASSERT_TRUE(mapper) << mapper.error().message;
  for (std::size_t i = 0; i < (*source)->size(); ++i) {
    const auto pushed = mapper->push(stored(**source, i));
    ASSERT_TRUE(pushed) << pushed.error().message;
    EXPECT_EQ(**pushed, i);
  }

  // A frame from the past is left out, and says so.
  const auto again = mapper->push(stored(**source, 0));
  ASSERT_FALSE(again);
  EXPECT_EQ(again.error().kind, core::ErrorKind::kInput);

  const auto result = mapper->finish();
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_EQ(mapper->dropped(), 0U);
  EXPECT_EQ(mapper->pose(19)->state, "tracked");
  const fs::path expected = mapped(folder, fs::temp_directory_path() / "expected");
  for (const char* file : {"map.ply", "trajectory.txt"})
    EXPECT_TRUE(bytes_of(result->folder() / file) == bytes_of(expected / file)) << file;

  // The recording of fed frames is gone; the store has their pictures.
  const auto keyframes = result->keyframes();
  ASSERT_TRUE(keyframes) << keyframes.error().message;
  EXPECT_EQ(result->picture(keyframes->front())->size(), cv::Size(240, 180));
}

TEST(FrontDoor, DropsLateFramesOnRequest) {
  sensor::Camera camera;
  camera.color = {320, 240, 260.0, 260.0, 159.5, 119.5};
  MapperOptions options;
  options.queue = 1;
  options.drop_late = true;
  auto mapper = Mapper::start(camera, {}, options);
  ASSERT_TRUE(mapper) << mapper.error().message;

  const cv::Mat color(240, 320, CV_8UC3, cv::Scalar(90, 90, 90));
  const cv::Mat depth(240, 320, CV_16UC1, cv::Scalar(10000));
  std::size_t kept = 0;
  for (int i = 0; i < 100; ++i) {
    const auto pushed = mapper->push({i / 30.0, {}, color, depth, {}});
    ASSERT_TRUE(pushed) << pushed.error().message;
    kept += pushed->has_value() ? 1U : 0U;
  }
  EXPECT_GT(mapper->dropped(), 0U);
  EXPECT_EQ(kept + mapper->dropped(), 100U);
  mapper->cancel();
  EXPECT_TRUE(mapper->wait(30.0));
}

TEST(FrontDoor, StopsBetweenFramesAndBeforeTheFirst) {
  MapOptions options;
  options.set = kPlain;
  options.progress = [stop = options.stop](std::size_t done, std::size_t) {
    if (done == 8) stop.request_stop();
  };
  const auto part = map(kWorld, {}, options);
  ASSERT_TRUE(part) << part.error().message;
  EXPECT_GE(part->path()->size(), 8U);
  EXPECT_LT(part->path()->size(), 20U);

  const auto nothing = map(kWorld, {}, options);  // the token stays set
  ASSERT_FALSE(nothing);
  EXPECT_EQ(nothing.error().kind, core::ErrorKind::kStopped);
}

TEST(FrontDoor, FiltersByNameAndByList) {
  auto wall = std::make_shared<cloud::Cloud>();
  for (int i = 0; i < 10000; ++i) {
    wall->emplace_back();
    wall->back().getVector3fMap() << 0.01F * static_cast<float>(i % 100), 0.01F * static_cast<float>(i / 100),
        1.0F;
  }
  const auto thin = filter(wall, "[{type: voxel_grid, leaf: 10 cm}]");
  ASSERT_TRUE(thin) << thin.error().message;
  EXPECT_LT((*thin)->size(), 150U);
  EXPECT_TRUE(filter(wall, "map"));

  const auto wrong = filter(wall, "[{type: voxel_grid, leaf: 10 km}, {type: voxle_grid}]");
  ASSERT_FALSE(wrong);
  EXPECT_EQ(wrong.error().kind, core::ErrorKind::kUsage);
  EXPECT_NE(wrong.error().message.find("voxle_grid"), std::string::npos) << wrong.error().message;
}

TEST(FrontDoor, FailuresAreValues) {
  const auto kind_of = [](const auto& result) {
    return result ? core::ErrorKind::kInternal : result.error().kind;
  };
  EXPECT_EQ(kind_of(map("nowhere/at/all")), core::ErrorKind::kInput);
  MapOptions options;
  options.pipeline = "rgbdd";
  EXPECT_EQ(kind_of(map(kWorld, {}, options)), core::ErrorKind::kUsage);
  options.pipeline.clear();
  options.poses = "sometimes";
  EXPECT_EQ(kind_of(map(kWorld, {}, options)), core::ErrorKind::kUsage);
  options.poses = "prior";
  options.topics["colour"] = "/image";
  EXPECT_EQ(kind_of(map(kWorld, {}, options)), core::ErrorKind::kUsage);

  EXPECT_EQ(kind_of(fuse({"nowhere"})), core::ErrorKind::kInput);
  EXPECT_EQ(kind_of(Result::open("nowhere")), core::ErrorKind::kInput);
  EXPECT_EQ(kind_of(find_camera("tum_fr9")), core::ErrorKind::kUsage);
  EXPECT_EQ(kind_of(find_pipelines("nowhere")), core::ErrorKind::kUsage);
  EXPECT_EQ(kind_of(Mapper::start(sensor::Camera())), core::ErrorKind::kUsage);

  // What a callback throws does not leave either.
  options.topics.clear();
  options.progress = [](std::size_t, std::size_t) { throw std::runtime_error("a guest's fault"); };
  const auto thrown = map(kWorld, {}, options);
  ASSERT_FALSE(thrown);
  EXPECT_NE(thrown.error().message.find("a guest's fault"), std::string::npos) << thrown.error().message;
}

}  // namespace
}  // namespace plumbline
