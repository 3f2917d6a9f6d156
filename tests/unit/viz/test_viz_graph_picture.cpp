// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <sstream>

#include "plumbline/viz/graph_picture.hpp"

namespace plumbline::viz {
namespace {

namespace fs = std::filesystem;

class GraphPicture : public testing::Test {
 protected:
  GraphPicture() : folder_(fs::path(testing::TempDir()) / "plumbline_graph_picture") {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  ~GraphPicture() override { fs::remove_all(folder_); }
  fs::path folder_;
};

TEST_F(GraphPicture, GrowsWithTheGraph) {
  ASSERT_TRUE(draw_graph("digraph { rankdir=LR; node [shape=box]; a -> b }", folder_ / "two.png"));
  ASSERT_TRUE(draw_graph("digraph { rankdir=LR; node [shape=box]; a -> b -> c -> d }", folder_ / "four.png"));
  const cv::Mat two = cv::imread((folder_ / "two.png").string());
  const cv::Mat four = cv::imread((folder_ / "four.png").string());
  ASSERT_FALSE(two.empty());
  EXPECT_EQ(two.rows, four.rows);
  EXPECT_GT(four.cols, two.cols * 3 / 2);
  double darkest = 255.0;
  cv::minMaxLoc(two.reshape(1), &darkest);
  EXPECT_LT(darkest, 50.0);  // something is drawn
}

TEST_F(GraphPicture, VectorGraphicsHoldTheText) {
  ASSERT_TRUE(draw_graph("digraph { first -> second }", folder_ / "g.svg"));
  std::ostringstream text;
  text << std::ifstream(folder_ / "g.svg").rdbuf();
  EXPECT_NE(text.str().find("second</text>"), std::string::npos);
}

TEST_F(GraphPicture, WhatCannotBeDrawnIsRefused) {
  EXPECT_EQ(draw_graph("digraph {}", folder_ / "g.jpg").error().kind, core::ErrorKind::kUsage);
  EXPECT_EQ(draw_graph("no graph at all", folder_ / "g.png").error().kind, core::ErrorKind::kUsage);
  EXPECT_EQ(draw_graph("digraph {}", folder_ / "none" / "g.png").error().kind, core::ErrorKind::kOutput);
  EXPECT_TRUE(fs::is_empty(folder_));
}

}  // namespace
}  // namespace plumbline::viz
