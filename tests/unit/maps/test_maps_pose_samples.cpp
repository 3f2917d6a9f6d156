// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "plumbline/maps/pose_samples.hpp"

namespace plumbline::maps {
namespace {

TEST(PoseSamples, AreReadBackAndADamagedFileIsRefused) {
  std::vector<KeyframeSamples> samples(3);
  for (int i = 0; i < 3; ++i) {
    auto& one = samples[static_cast<std::size_t>(i)];
    one.keyframe = {i / 2, 7 + i};
    for (std::size_t s = 0; s < one.in_camera.size(); ++s)
      one.in_camera[s].setLinSpaced(0.25 * i, static_cast<double>(s));
  }
  const auto folder = std::filesystem::temp_directory_path();
  const auto file = folder / kPoseSamplesFile;
  ASSERT_TRUE(write_pose_samples(file, samples));

  const auto read = read_pose_samples(file);
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_EQ(read->size(), 3U);
  EXPECT_EQ((*read)[2].keyframe, samples[2].keyframe);
  EXPECT_TRUE((*read)[2].in_camera[31].isApprox(samples[2].in_camera[31], 1e-6));

  // Too short, and another kind of file.
  std::filesystem::resize_file(file, std::filesystem::file_size(file) - 5);
  EXPECT_FALSE(read_pose_samples(file));
  std::ofstream(file) << "no array";
  EXPECT_FALSE(read_pose_samples(file));
  EXPECT_FALSE(read_pose_samples(folder / "none.npy"));
}

}  // namespace
}  // namespace plumbline::maps
