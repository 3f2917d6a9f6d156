// SPDX-License-Identifier: BSD-3-Clause
// A run that is continued reads the rows that it wrote, and no others.
#include <gtest/gtest.h>

#include "../../../src/pipeline/results/frame_rows.hpp"

namespace plumbline::pipeline {
namespace {

TEST(FrameRows, AreReadAsTheyWereWritten) {
  mapping::FrameReport report;
  report.stamp = 1305031102.175304;
  for (const auto state : {tracking::TrackState::kTracked, tracking::TrackState::kLost}) {
    report.state = state;
    report.loss = state == tracking::TrackState::kLost ? tracking::Loss::kFewAgree : tracking::Loss::kNone;
    for (const bool shows_nothing : {true, false}) {
      for (const char* robot : {"", "one, two"}) {
        const FrameRow row = row_of(17, report, shows_nothing, robot);
        const auto read = read_line(to_line(row));
        ASSERT_TRUE(read);
        EXPECT_EQ(read->frame, 17U);
        EXPECT_EQ(read->state, row.state);
        EXPECT_EQ(read->shows_nothing, shows_nothing);
        EXPECT_EQ(read->reason, row.reason);
        const bool lost = state == tracking::TrackState::kLost;
        EXPECT_EQ(row.reason, !lost           ? ""
                              : shows_nothing ? "shows nothing"
                                              : "too few features and surfaces agree");
        EXPECT_EQ(to_line(*read), to_line(row));
      }
    }
  }
}

TEST(FrameRows, DamagedLinesAreRefused) {
  for (const char* line :
       {"", "17", "17,tracked", "x,tracked,1", "-1,tracked,1", "17 ,tracked,1", "17,found,1"})
    EXPECT_FALSE(read_line(line)) << line;
}

}  // namespace
}  // namespace plumbline::pipeline
