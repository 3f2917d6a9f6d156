// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Programs that run beside the test and speak with each other over lo, in a domain of the test's own.
#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <functional>
#include <map>
#include <string>
#include <thread>

#include "program.hpp"

namespace plumbline::integration {

/// Ends with the test, whatever happens.
class Process {
 public:
  Process() = default;
  Process(const fs::path& folder, const std::string& name, const std::string& arguments,
          const std::string& before = "")
      : log_(folder / (name + ".log")) {
    const std::string command =
        "cd '" + folder.string() + "' && " + before + " exec " + PLUMBLINE_PROGRAM + " " + arguments;
    pid_ = fork();
    if (pid_ != 0) return;
    const int log = open(log_.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0644);
    const int nothing = open("/dev/null", O_RDONLY);
    dup2(nothing, STDIN_FILENO);
    dup2(log, STDOUT_FILENO);
    dup2(log, STDERR_FILENO);
    execl("/bin/sh", "sh", "-c", command.c_str(), static_cast<char*>(nullptr));
    _exit(127);
  }
  Process(Process&& other) noexcept : log_(std::move(other.log_)), pid_(std::exchange(other.pid_, 0)) {}
  Process& operator=(Process&& other) noexcept {
    std::swap(log_, other.log_);
    std::swap(pid_, other.pid_);
    return *this;
  }
  ~Process() { end(SIGKILL); }

  /// Its exit code; 128 + signal when it was ended; -1: it is still there after so many seconds, and is
  /// ended.
  int wait(double seconds) {
    const auto until = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
    int status = 0;
    while (waitpid(pid_, &status, WNOHANG) == 0) {
      if (std::chrono::steady_clock::now() > until) {
        end(SIGKILL);
        return -1;
      }
      usleep(20000);
    }
    pid_ = 0;
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }
  void send(int signal) const { kill(pid_, signal); }
  void end(int signal) {
    if (pid_ <= 0) return;
    kill(pid_, signal);
    waitpid(pid_, nullptr, 0);
    pid_ = 0;
  }
  [[nodiscard]] std::string told() const { return slurp(log_); }

 private:
  fs::path log_;
  pid_t pid_ = 0;
};

inline bool happens(const std::function<bool()>& what, double seconds) {
  const auto until = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  while (!what()) {
    if (std::chrono::steady_clock::now() > until) return false;
    usleep(20000);
  }
  return true;
}

/// A world that two robots map a part of each, and what `plumbline fuse` makes of their maps: made once.
class NetworkTest : public ProgramTest {
 protected:
  static constexpr double kLong_s = 120.0;  // for a busy machine
  static constexpr const char* kRobot = " -q --set cloud.filters=[]";
  static constexpr const char* kFuse =
      " --set output.pcd=off --set fuse.voxel=3cm --set output.views= --set merge.min_pairs=3";

  static void SetUpTestSuite() {
    world_ = fs::path(testing::TempDir()) / ("plumbline_network_world." + std::to_string(getpid()));
    fs::remove_all(world_);
    fs::create_directories(world_);
    run_there(
        "synth room -o world --frames 50 --fps 10 --width 320 --height 240 --reference-spacing 10cm -q");
    const std::string map = "map " + world("world/robot0").string() + " -p robot" + kRobot;
    run_there(map + " -o a --to 3");
    run_there(map + " -o b --from 1.5");
    run_there("fuse a b -q -o ab" + std::string(kFuse));
  }
  static void TearDownTestSuite() { fs::remove_all(world_); }
  static void run_there(const std::string& arguments) {
    Process process(world_, "made", arguments);
    ASSERT_EQ(process.wait(kLong_s), 0) << arguments << "\n" << process.told();
  }
  static fs::path world(const std::string& name) { return world_ / name; }

  [[nodiscard]] std::string network() const {
    return " --interface lo --domain " + std::to_string(1 + getpid() % 200);
  }
  [[nodiscard]] Process start(const std::string& name, const std::string& arguments,
                              const std::string& before = "") const {
    return {path(""), name, arguments, before};
  }
  [[nodiscard]] Process hub(const std::string& more = " --robots 2", const std::string& before = "") const {
    return start("hub", "hub -v -o out" + network() + kFuse + more, before);
  }
  /// The robot `a` or `b`, whose map is that of the world's folder of that name.
  [[nodiscard]] Process robot(const std::string& name, const std::string& more = "",
                              const std::string& before = "") const {
    const std::string part = name == "a" ? " --to 3" : " --from 1.5";
    return start(name,
                 "robot " + world("world/robot0").string() + part + " -o " + name + " --name " + name +
                     network() + kRobot + more,
                 before);
  }
  void expect_the_bytes_of_fuse(const fs::path& out) const {
    for (const char* file : {"map.ply", "lines.ply", "robots/a/trajectory.txt", "robots/b/trajectory.txt",
                             "robots/a/keyframes.txt", "robots/b/keyframes.txt"}) {
      EXPECT_TRUE(fs::exists(out / file)) << file;
      EXPECT_EQ(slurp(out / file), slurp(world("ab") / file)) << file;
    }
  }

 private:
  static inline fs::path world_;
};

}  // namespace plumbline::integration
