// SPDX-License-Identifier: BSD-3-Clause
// Every shipped pipeline tracks: whatever it switches off, the rules that judge a pose allow for it.
#include <algorithm>
#include <map>
#include <vector>

#include "program.hpp"

namespace plumbline::integration {
namespace {

const fs::path kPipelines = fs::path(PLUMBLINE_SOURCE_DIR) / "pipelines";
const char* const kNoPictures = " --force -q --threads 2 --set output.views= --set output.pcd=off";

/// Names of the pipelines that map recordings.
std::vector<std::string> mapping_pipelines() {
  std::vector<std::string> names;
  for (const fs::directory_entry& file : fs::directory_iterator(kPipelines)) {
    const std::string name = file.path().stem().string();
    if (file.path().extension() == ".yaml" && name != "fuse" && name != "localize") names.push_back(name);
  }
  std::sort(names.begin(), names.end());
  return names;
}

/// Part of a recording that PLUMBLINE_DATA may hold.
struct Cut {
  std::string recording;
  std::string part;  ///< options
};
const std::vector<Cut> kCuts{{"icl_nuim_of_kt0_a", ""},
                             {"tum_fr1_rpy_a", ""},
                             {"tum_fr1_rpy_a", " --from 0.1"},
                             {"tum_fr1_rpy_a", " --from 0.2"},
                             {"tum_fr3_structure_notexture_far_a", " --to 2"},
                             {"7scenes_redkitchen_a", " --to 3"}};

/// Largest share of frames without a pose, where that is not none: surfaces alone lose fast turns over a
/// desk, and the truth of fr3 begins later than its pictures.
const std::map<std::pair<std::string, std::string>, double> kMostLost{
    {{"depth_only", "tum_fr1_rpy_a"}, 0.5}, {{"known_poses", "tum_fr3_structure_notexture_far_a"}, 0.1}};

class ShippedPipelines : public ProgramTest, public testing::WithParamInterface<std::string> {
 protected:
  void expect_tracked(const std::string& input, const std::string& options, double most_lost) const {
    // robot.yaml has no output.
    const std::string lean = GetParam() == "robot" ? " --force -q --threads 2" : kNoPictures;
    const Outcome o = run("map '" + input + "' -p " + GetParam() + " -o out" + options + lean);
    ASSERT_TRUE(o.code == 0 || (o.code == 4 && most_lost > 0.0)) << input << options << "\n" << o;
    const auto frames = read_json(path("out/summary.json"))["frames"];
    const auto read = frames["read"].get<double>();
    EXPECT_GE(read, 20.0) << input << options;
    EXPECT_GE(frames["tracked"].get<double>(), (1.0 - most_lost) * read) << input << options << "\n"
                                                                         << frames;
  }
};

TEST_P(ShippedPipelines, TrackEveryFrameOfAGeneratedRoom) {
  const Outcome made =
      run("synth room -o room --frames 30 --width 320 --height 240 --reference-spacing 0.5 -q");
  ASSERT_EQ(made.code, 0) << made;
  expect_tracked(path("room/robot0").string(), "", 0.0);
}

TEST_P(ShippedPipelines, TrackEveryFrameOfRealRecordings) {
  const char* data = std::getenv("PLUMBLINE_DATA");
  if (data == nullptr) GTEST_SKIP() << "PLUMBLINE_DATA names no folder of recordings";
  int tried = 0;
  for (const Cut& cut : kCuts) {
    const fs::path recording = fs::path(data) / cut.recording;
    if (!fs::is_directory(recording)) continue;
    const auto lost = kMostLost.find({GetParam(), cut.recording});
    expect_tracked(recording.string(), cut.part, lost == kMostLost.end() ? 0.0 : lost->second);
    ++tried;
  }
  if (tried == 0) GTEST_SKIP() << data << " has none of the recordings";
}

INSTANTIATE_TEST_SUITE_P(All, ShippedPipelines, testing::ValuesIn(mapping_pipelines()),
                         [](const auto& one) { return one.param; });

}  // namespace
}  // namespace plumbline::integration
