// SPDX-License-Identifier: BSD-3-Clause
// Which libraries the program loads, as the dynamic linker itself tells: those of pictures, of PCL's
// surfaces and of rare image formats take several times as long to load as all others, so only runs that
// need them may.
#include <algorithm>
#include <sstream>
#include <string>
#include <vector>

#include "program.hpp"
#include "wall_recording.hpp"

namespace plumbline::integration {
namespace {

const std::vector<std::string> kPictures{"plumbline_viz.so", "libvtkRenderingOpenGL2", "libOSMesa", "libgvc"};
const std::vector<std::string> kSurfaces{"plumbline_pcl.so", "libpcl_surface", "libpcl_io"};
const std::vector<std::string> kFormats{"plumbline_images.so", "libopencv_imgcodecs", "libgdal"};

class Start : public ProgramTest {
 protected:
  struct Loaded {
    Outcome outcome;
    std::vector<std::string> files;
    [[nodiscard]] bool has(const std::string& name) const {
      return std::any_of(files.begin(), files.end(), [&name](const std::string& file) {
        return fs::path(file).filename().string().rfind(name, 0) == 0;
      });
    }
  };

  /// What one run loads, at its start and later.
  [[nodiscard]] Loaded loaded_by(const std::string& arguments) const {
    Loaded loaded;
    loaded.outcome = run(arguments, "LD_DEBUG=files LD_DEBUG_OUTPUT=loaded ");
    for (const auto& entry : fs::directory_iterator(path("."))) {
      if (entry.path().filename().string().rfind("loaded.", 0) != 0) continue;
      std::istringstream lines(slurp(entry.path()));
      const std::string mark = "calling init: ";
      for (std::string line; std::getline(lines, line);) {
        const std::size_t at = line.find(mark);
        if (at != std::string::npos) loaded.files.push_back(line.substr(at + mark.size()));
      }
      fs::remove(entry.path());
    }
    return loaded;
  }

  static void expect_all(const Loaded& loaded, const std::vector<std::string>& names) {
    for (const std::string& name : names) EXPECT_TRUE(loaded.has(name)) << name;
  }
  static void expect_none(const Loaded& loaded, const std::vector<std::string>& names) {
    EXPECT_TRUE(loaded.has("libopencv_core")) << "the list of libraries is not complete";
    for (const std::string& name : names) EXPECT_FALSE(loaded.has(name)) << name;
  }
};

TEST_F(Start, LoadsOnlyWhatEveryRunNeeds) {
  const Loaded version = loaded_by("--version");
  EXPECT_EQ(version.outcome.code, 0) << version.outcome;
  expect_none(version, kPictures);
  expect_none(version, kSurfaces);
  expect_none(version, kFormats);
  EXPECT_FALSE(version.has("libvtk"));
  EXPECT_LT(version.files.size(), 80U);
}

TEST_F(Start, MapsAndFusesWithoutPictures) {
  write_wall(path("wall"));
  const Loaded map = loaded_by("map wall -o out -q --set output.views= --set fuse.voxel=2cm");
  ASSERT_EQ(map.outcome.code, 0) << map.outcome;
  ASSERT_EQ(run("map wall -o other -q --set output.views= --set fuse.voxel=2cm").code, 0);
  const Loaded fuse = loaded_by("fuse out other -o both -q --set output.views= --set fuse.voxel=2cm");
  ASSERT_EQ(fuse.outcome.code, 4) << fuse.outcome;  // so small a wall proves nothing, but all of it is run
  EXPECT_TRUE(fs::exists(path("both/map.ply")));
  for (const Loaded& loaded : {map, fuse}) {
    expect_none(loaded, kPictures);
    expect_none(loaded, kSurfaces);
    expect_none(loaded, kFormats);
  }
}

TEST_F(Start, WhoNeedsMoreLoadsThatMuchMore) {
  write("cloud.xyz", "0 0 1\n0.1 0 1\n0.1 0.1 1\n0 0.1 1\n");
  const Loaded render = loaded_by("render cloud.xyz -o shot.png --view front --size 64x64");
  ASSERT_EQ(render.outcome.code, 0) << render.outcome;
  expect_all(render, kPictures);
  expect_none(render, kFormats);

  write("chain.yaml", "chain: smooth\nfilters:\n  - type: mls\n    radius: 20 cm\n");
  const Loaded filter = loaded_by("filter chain.yaml cloud.xyz smooth.ply");
  ASSERT_EQ(filter.outcome.code, 0) << filter.outcome;
  expect_all(filter, kSurfaces);
  expect_none(filter, kPictures);
  expect_none(filter, kFormats);

  write_wall(path("wall"));
  const Loaded formats =
      loaded_by("map wall -o out -q --debug-video pictures --set output.views= --set fuse.voxel=2cm");
  ASSERT_EQ(formats.outcome.code, 0) << formats.outcome;
  expect_all(formats, kFormats);
  expect_none(formats, kPictures);
}

TEST_F(Start, OnlyWhoOpensABagLoadsWhatReadsIt) {
  const std::vector<std::string> bags{"plumbline_bags.so", "libddsc", "liblz4", "libbz2"};
  write_wall(path("wall"));
  expect_none(loaded_by("info wall"), {bags[0], bags[1]});
  const Loaded convert = loaded_by("convert wall wall.mcap -q");
  ASSERT_EQ(convert.outcome.code, 0) << convert.outcome;
  expect_all(convert, bags);
  expect_none(convert, kPictures);
}

TEST_F(Start, OnlyHubAndRobotsLoadTheNetwork) {
  const std::vector<std::string> network{"plumbline_dds.so", "libddsc", "libssl"};
  expect_none(loaded_by("--version"), network);
  expect_none(loaded_by("robot --help"), network);
  EXPECT_TRUE(loaded_by("keys create keys --robots r0 -q").has("libddsc"));
}

}  // namespace
}  // namespace plumbline::integration
