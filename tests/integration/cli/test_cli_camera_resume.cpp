// SPDX-License-Identifier: BSD-3-Clause
// A run that finds a better camera is killed at nine moments, and goes on as if it had not been.
#include <csignal>
#include <cstddef>
#include <string>
#include <vector>

#include "plumbline/maps/store.hpp"
#include "program.hpp"

namespace plumbline::integration {
namespace {

/// What the store of a run knows of its camera.
enum class Known { kNothing, kAsked, kAnswered, kUsed };

struct Moment {
  Known known;
  std::size_t frames;  ///< that are stored, at least
};
constexpr Moment kMoments[] = {{Known::kNothing, 8},    {Known::kNothing, 20}, {Known::kNothing, 35},
                               {Known::kAsked, 0},      {Known::kAsked, 72},   {Known::kAnswered, 0},
                               {Known::kAnswered, 120}, {Known::kUsed, 0},     {Known::kUsed, 228}};

class CameraResume : public ProgramTest {
 protected:
  static bool has_come(const Moment& moment, const fs::path& file) {
    if (!fs::exists(file)) return false;
    const auto store = maps::StoreReader::open(file);
    const auto contents = store ? store->contents() : tl::unexpected(store.error());
    if (!contents || contents->frames < moment.frames) return false;
    const maps::RobotInfo& robot = store->header().robots.front();
    const bool answered = robot.estimate && robot.estimate->answers > 0;
    return moment.known == (!robot.versions.empty() ? Known::kUsed
                            : answered              ? Known::kAnswered
                            : robot.estimate        ? Known::kAsked
                                                    : Known::kNothing);
  }

  /// Maps into `whole`, and copies at each moment what a kill would leave to `outN.partial`.
  void map_and_copy(const std::string& arguments) const {
    const pid_t child = fork();
    if (child == 0) {
      const std::string command =
          "cd '" + path("").string() + "' && exec " + PLUMBLINE_PROGRAM + " map " + arguments + " -o whole";
      execl("/bin/sh", "sh", "-c", command.c_str(), static_cast<char*>(nullptr));
      _exit(127);
    }

    ASSERT_GT(child, 0);

    // Stopped while its folder is copied, the run leaves what a kill at that moment would.
    std::size_t next = 0;
    int status = 0;
    while (waitpid(child, &status, WNOHANG) == 0) {
      if (next < std::size(kMoments) && has_come(kMoments[next], path("whole.partial/map.db"))) {
        kill(child, SIGSTOP);
        fs::copy(path("whole.partial"), path("out" + std::to_string(next) + ".partial"),
                 fs::copy_options::recursive);
        kill(child, SIGCONT);
        ++next;
      }
      usleep(2000);
    }
    EXPECT_TRUE(WEXITSTATUS(status) == 0 || WEXITSTATUS(status) == 4) << "4: frames in two components";
    ASSERT_EQ(next, std::size(kMoments)) << "a moment did not come";
  }

  [[nodiscard]] nlohmann::json camera(const std::string& out) const {
    return read_json(path(out) / "summary.json")["camera"][0];
  }
  [[nodiscard]] double ate_m(const std::string& out) const {
    const Outcome o = run("evaluate trajectory " + out + " world/robot0 --json");
    return o.code == 0 ? nlohmann::json::parse(o.out)["ate_m"]["rmse"].get<double>() : 1e9;
  }
};

TEST_F(CameraResume, ARunThatIsKilledAsksAndUsesItsCameraAsTheUndisturbedOne) {
  ASSERT_EQ(run("synth home --layout 7 -o world --width 320 --height 240 --frames 240 --fps 6 --seed 3 "
                "--path tour --reference-spacing 50cm --camera-error fx=2% -q")
                .code,
            0);
  const std::string map = "world/robot0 -q --set output.views= --set output.pcd=off --set fuse.voxel=40mm";

  map_and_copy(map);
  if (HasFatalFailure()) return;
  const nlohmann::json whole = camera("whole");
  ASSERT_GT(whole["from_frame"], 0) << whole;
  const double best = ate_m("whole");

  for (std::size_t i = 0; i < std::size(kMoments); ++i) {
    const std::string out = "out" + std::to_string(i);
    const Outcome o = run("map --resume -o " + out + " " + map);
    ASSERT_TRUE(o.code == 0 || o.code == 4) << out << o;

    const nlohmann::json resumed = camera(out);
    EXPECT_EQ(resumed["asked_at"], whole["asked_at"]) << out;
    EXPECT_EQ(resumed["from_frame"], whole["from_frame"]) << out;
    for (std::size_t n = 0; n < whole["numbers"].size(); ++n) {
      const nlohmann::json &a = whole["numbers"][n], &b = resumed["numbers"][n];
      EXPECT_NEAR(b["found"].get<double>(), a["found"].get<double>(), a["sigma"].get<double>()) << out << a;
    }
    EXPECT_LT(ate_m(out), 1.25 * best + 0.0005) << out;
  }

  // A fused map tells what its runs found of their cameras, which are one.
  const Outcome o = run("fuse whole out8 -o both -q --set output.views=");
  ASSERT_TRUE(o.code == 0 || o.code == 4) << o;
  const nlohmann::json fused = read_json(path("both/summary.json"));
  const nlohmann::json resumed = this->camera("out8");
  ASSERT_EQ(fused["camera"].size(), 2U) << fused["camera"];
  for (const nlohmann::json& camera : fused["camera"])
    EXPECT_TRUE(camera["numbers"] == whole["numbers"] || camera["numbers"] == resumed["numbers"]);
  ASSERT_EQ(fused["camera_pairs"].size(), 1U);
  EXPECT_TRUE(fused["camera_pairs"][0]["agree"]) << fused["camera_pairs"];
}

}  // namespace
}  // namespace plumbline::integration
