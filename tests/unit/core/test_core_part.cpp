// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "plumbline/core/part.hpp"

namespace plumbline::core {
namespace {

TEST(Part, OneThatIsMissingIsToldWithItsFileAndItsPlace) {
  const auto loaded = load_part("no_such_part", 0);
  ASSERT_FALSE(loaded);
  EXPECT_EQ(loaded.error().kind, ErrorKind::kInternal);
  EXPECT_EQ(loaded.error().message.rfind("plumbline_no_such_part.so: this part of Plumbline is missing", 0),
            0U)
      << loaded.error().message;
  EXPECT_NE(loaded.error().message.find("lib/plumbline"), std::string::npos) << loaded.error().message;
}

TEST(Part, LayoutsTellTypesOfOtherSizesApart) {
  struct Old {
    int a;
  };
  struct New {
    int a;
    int b;
  };
  EXPECT_EQ((layout_of<Old, New>()), (layout_of<Old, New>()));
  EXPECT_NE((layout_of<Old, New>()), (layout_of<New, Old>()));
  EXPECT_NE((layout_of<Old>()), (layout_of<New>()));
}

}  // namespace
}  // namespace plumbline::core
