// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <set>

#include "exports/export_test.hpp"

namespace plumbline::exports {
namespace {

std::set<std::string> option_keys() {
  ExportOptions options;
  core::OptionTable table;
  options.declare(table);
  std::set<std::string> keys;
  for (const core::OptionSpec& spec : table.specs()) keys.insert(spec.key);
  return keys;
}

TEST(ExportFormats, TakeDeclaredOptionsAndLeaveNoneOut) {
  std::set<std::string> left = option_keys();
  std::set<std::string> names;
  for (const FormatInfo& format : export_formats()) {
    EXPECT_TRUE(names.insert(format.name).second) << format.name << " is there twice";
    EXPECT_FALSE(format.description.empty()) << format.name;
    for (const std::string& key : format.options) {
      EXPECT_EQ(option_keys().count(key), 1U) << format.name << " takes " << key;
      left.erase(key);
    }
  }
  for (const char* common : {"box", "z", "storey"}) left.erase(common);
  EXPECT_TRUE(left.empty()) << *left.begin() << " means nothing to any format";
}

TEST(ExportFormats, ThePageIsTheTables) {
  std::ifstream stream(PLUMBLINE_SOURCE_DIR "/docs/guide/exports.md");
  const std::string page{std::istreambuf_iterator<char>(stream), {}};
  EXPECT_EQ(page, exports_page()) << "run: plumbline export --describe > docs/guide/exports.md";
}

core::Result<void> checked(const std::string& output, Content content = Content::kCloud,
                           const std::string& format = "", const std::set<std::string>& given = {}) {
  ExportRequest request;
  request.output = output;
  request.content = content;
  request.format = format;
  request.given = given;
  return check_export(request);
}

TEST(ExportFormats, AreChosenByEndingContentAndName) {
  EXPECT_TRUE(checked("grid.yaml", Content::kCloud, "", {"heights", "resolution"}));
  EXPECT_TRUE(checked("model", Content::kCloud, "", {"every"})) << "a folder is a COLMAP model";
  EXPECT_TRUE(checked("nerf/transforms.json", Content::kCloud, "", {"depth"}));
  EXPECT_TRUE(checked("a.csv", Content::kTrajectory, "", {"body"})) << "EuRoC";
  EXPECT_TRUE(checked("poses.csv", Content::kCloud, "", {"body"})) << "with covariance";
  EXPECT_TRUE(checked("a.csv", Content::kCloud, "", {"voxel"})) << "a table of points";
  EXPECT_TRUE(checked("a.obj", Content::kCloud, "", {"reach"})) << "only meshes are .obj";
  EXPECT_TRUE(checked("paths", Content::kTrajectory, "kitti"));
  EXPECT_TRUE(checked("A.PLY", Content::kCloud, "", {"ascii"}));
}

TEST(ExportFormats, SayWhatIsWrong) {
  const auto wrong = [](const core::Result<void>& result) {
    return result ? "nothing" : result.error().message;
  };
  EXPECT_NE(wrong(checked("a.e57")).find("allowed:"), std::string::npos);
  EXPECT_NE(wrong(checked("a.txt")).find("--format"), std::string::npos)
      << "a path only when it is asked for";
  EXPECT_NE(wrong(checked("a.las", Content::kCloud, "", {"cut"})).find("--cut: is not an option of las"),
            std::string::npos);
  EXPECT_NE(wrong(checked("a.glb", Content::kCloud, "", {"reach"})).find("without --mesh"),
            std::string::npos);
  EXPECT_NE(wrong(checked("a.las", Content::kLines)).find("lines"), std::string::npos);
  EXPECT_NE(wrong(checked("paths", Content::kTrajectory)).find("--format kitti -o paths"), std::string::npos);
  EXPECT_NE(wrong(checked("a", Content::kCloud, "colmpa")).find("colmap"), std::string::npos)
      << "did you mean";
  EXPECT_EQ(checked("a.e57").error().kind, core::ErrorKind::kUsage);
}

}  // namespace
}  // namespace plumbline::exports
