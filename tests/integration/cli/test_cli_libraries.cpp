// SPDX-License-Identifier: BSD-3-Clause
// That a default run goes through the algorithms that PCL, FLANN and Ceres are there for, as a debugger sees
// it.
#include <array>
#include <utility>

#include "program.hpp"

namespace plumbline::integration {
namespace {

class Libraries : public ProgramTest {
 protected:
  void SetUp() override {
    std::string script = "set pagination off\nset breakpoint pending on\nset debuginfod enabled off\n";
    for (const auto& [name, function] : kFunctions) {
      script += std::string("tbreak ") + function + "\ncommands\nsilent\nprintf \"reached " + name +
                "\\n\"\ncontinue\nend\n";
    }
    write("script", script + "run\n");
    const Outcome debugged = run("--version", kDebugger);
    if (debugged.out.find("exited normally") == std::string::npos)
      GTEST_SKIP() << "no program can be debugged here (gdb, ptrace): " << debugged;
  }

  /// Which of kFunctions a run of the program calls.
  [[nodiscard]] std::string reached_by(const std::string& arguments) const {
    const Outcome debugged = run(arguments, kDebugger);
    EXPECT_NE(debugged.out.find("exited normally"), std::string::npos) << debugged;
    std::string reached;
    for (const auto& [name, function] : kFunctions) {
      if (debugged.out.find(std::string("reached ") + name) != std::string::npos)
        reached += (reached.empty() ? "" : " ") + std::string(name);
    }
    return reached;
  }

  static constexpr const char* kDebugger = "gdb -q -batch -nx -x script --args ";
  static constexpr std::array<std::pair<const char*, const char*>, 4> kFunctions{{
      {"VoxelGrid", "pcl::VoxelGrid<pcl::PointNormal>::applyFilter"},
      {"KdTreeFLANN", "pcl::KdTreeFLANN<pcl::PointXYZRGBNormal, flann::L2_Simple<float> >::radiusSearch"},
      {"IterativeClosestPoint",
       "pcl::IterativeClosestPoint<pcl::PointNormal, pcl::PointNormal, double>::computeTransformation"},
      {"Solve", "ceres::Solve"},
  }};
};

TEST_F(Libraries, DoWhatTheyAreKnownFor) {
  const std::string map = "map 'synth:room?frames=60&seed=2' -o out -q --force --set output.views= ";
  EXPECT_EQ(reached_by(map), "VoxelGrid KdTreeFLANN IterativeClosestPoint Solve");
  EXPECT_EQ(reached_by(map + "--set refine.icp=off"), "VoxelGrid KdTreeFLANN Solve");
}

}  // namespace
}  // namespace plumbline::integration
