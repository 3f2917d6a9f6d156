// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "plumbline/core/own_files.hpp"

namespace plumbline::core {
namespace {

namespace fs = std::filesystem;

const FileNames kNames{"map.ply", "pictures/*.png", "robots/*/map.db", "robots/*/map.db-*", "model/**"};

class OwnFiles : public testing::Test {
 protected:
  OwnFiles() : folder_(fs::path(testing::TempDir()) / ("plumbline_own_" + std::to_string(getpid()))) {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  ~OwnFiles() override { fs::remove_all(folder_); }
  void write(const std::string& file) const {
    fs::create_directories((folder_ / file).parent_path());
    std::ofstream(folder_ / file) << "x";
  }
  fs::path folder_;
};

TEST_F(OwnFiles, AreKnownByTheirNames) {
  for (const char* own : {"map.ply", "pictures/iso.png", "robots/r0/map.db", "robots/r0/map.db-wal",
                          "model/images/000001.png", ".map.ply.4711.part", "pictures/.iso.png.1.part"})
    EXPECT_TRUE(is_own_file(own, kNames)) << own;
  for (const char* foreign : {"map.ply2", "my/map.ply", "pictures/deep/iso.png", "pictures/iso.jpg",
                              "robots/map.db", "model", "robots/a/b/map.db", ".map.ply.part",
                              ".map.ply.x1.part", "map.ply.4711.part", ".notes.txt.1.part", ""})
    EXPECT_FALSE(is_own_file(foreign, kNames)) << foreign;
}

TEST_F(OwnFiles, AloneAreRemoved) {
  for (const char* own : {"map.ply", "pictures/iso.png", "robots/r0/map.db", "model/a/b.txt"}) write(own);
  for (const char* foreign : {"notes.txt", "pictures/holiday.jpg", "robots/r0/todo"}) write(foreign);
  fs::create_directories(folder_ / "photos");
  fs::create_directories(folder_ / "robots/r1");
  const std::vector<std::string> left{"notes.txt", "photos/", "pictures/holiday.jpg", "robots/r0/todo"};
  EXPECT_EQ(foreign_files(folder_, kNames), left);
  EXPECT_EQ(list_of_files(left), "notes.txt, photos/, pictures/holiday.jpg and 1 more");

  ASSERT_TRUE(remove_own_files(folder_, kNames));
  EXPECT_EQ(foreign_files(folder_, kNames), left);
  EXPECT_FALSE(fs::exists(folder_ / "map.ply"));
  EXPECT_FALSE(fs::exists(folder_ / "model"));
}

TEST_F(OwnFiles, GoWithTheirFolderIfNothingElseIsInIt) {
  for (const char* own : {"map.ply", "pictures/iso.png", "robots/r0/map.db"}) write(own);
  ASSERT_TRUE(remove_own_files(folder_, kNames));
  EXPECT_FALSE(fs::exists(folder_));
  EXPECT_TRUE(remove_own_files(folder_, kNames)) << "nothing is there";
}

TEST_F(OwnFiles, LinksAreNotFollowed) {
  write("elsewhere/iso.png");
  fs::create_directories(folder_ / "result");
  fs::create_directory_symlink(folder_ / "elsewhere", folder_ / "result/pictures");
  EXPECT_EQ(foreign_files(folder_ / "result", kNames), std::vector<std::string>{"pictures"});
  ASSERT_TRUE(remove_own_files(folder_ / "result", kNames));
  EXPECT_TRUE(fs::exists(folder_ / "elsewhere/iso.png"));
  EXPECT_TRUE(fs::is_symlink(folder_ / "result/pictures"));
}

}  // namespace
}  // namespace plumbline::core
