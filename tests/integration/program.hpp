// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Runs the program as a shell would, in a folder of its own.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

namespace plumbline::integration {

namespace fs = std::filesystem;

inline std::string slurp(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

/// A PLY without the comment that names its frame, which the files of a result folder do not have.
inline std::string without_frame(std::string ply) {
  const std::size_t from = ply.find("comment frame: ");
  if (from != std::string::npos) ply.erase(from, ply.find('\n', from) + 1 - from);
  return ply;
}

inline nlohmann::json read_json(const fs::path& file) {
  return nlohmann::json::parse(slurp(file), nullptr, false);
}

struct Outcome {
  int code = -1;  ///< 128 + signal when it was killed
  std::string out;
  std::string err;
  [[nodiscard]] bool told(const std::string& text) const { return err.find(text) != std::string::npos; }
};

/// A folder that goes with the test.
class ProgramTest : public testing::Test {
 protected:
  ProgramTest() {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    std::string name =
        std::string(info->test_suite_name()) + "." + info->name() + "." + std::to_string(getpid());
    for (char& c : name) c = c == '/' ? '_' : c;
    folder_ = fs::path(testing::TempDir()) / ("plumbline_" + name);
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  ~ProgramTest() override { fs::remove_all(folder_); }

  /// `before`: shell text in front of the program, e.g. "ulimit -f 8; ".
  [[nodiscard]] Outcome run(const std::string& arguments, const std::string& before = "") const {
    const std::string command = "cd '" + folder_.string() + "' && " + before + PLUMBLINE_PROGRAM + " " +
                                arguments + " >out.txt 2>err.txt </dev/null";
    const int status = std::system(command.c_str());
    Outcome outcome;
    outcome.code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    outcome.out = slurp(folder_ / "out.txt");
    outcome.err = slurp(folder_ / "err.txt");
    return outcome;
  }
  [[nodiscard]] fs::path path(const std::string& name) const { return folder_ / name; }
  void write(const std::string& name, const std::string& text) const { std::ofstream(path(name)) << text; }

 private:
  fs::path folder_;
};

inline std::ostream& operator<<(std::ostream& stream, const Outcome& outcome) {
  return stream << "exit code " << outcome.code << "\n" << outcome.out << outcome.err;
}

}  // namespace plumbline::integration
