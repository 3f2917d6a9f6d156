// SPDX-License-Identifier: BSD-3-Clause
#include "video.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>

#include <string>
#include <vector>

extern char** environ;

namespace plumbline::cli {
namespace {

/// Runs a program of the PATH without a shell, its output thrown away; its exit code, -1 when it cannot run.
int run_program(std::vector<std::string> words) {
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  for (const int descriptor : {0, 1, 2}) {
    posix_spawn_file_actions_addopen(&actions, descriptor, "/dev/null", O_RDWR, 0);
  }
  pid_t child = 0;
  const int problem = posix_spawnp(&child, arguments[0], &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (problem != 0) return -1;
  int status = 0;
  if (waitpid(child, &status, 0) != child || !WIFEXITED(status)) return -1;
  return WEXITSTATUS(status);
}

}  // namespace

bool is_film(const std::filesystem::path& file) {
  return file.extension() == ".gif" || file.extension() == ".mp4";
}

core::Result<void> can_film() {
  if (run_program({"ffmpeg", "-version"}) == 0) return {};
  return core::usage_error(
      "films need the program ffmpeg, which is not installed; name a folder instead to get the pictures");
}

/// A GIF with its own palette, or H.264 with even sides.
core::Result<void> make_film(const std::filesystem::path& folder, int pictures_per_s,
                             const std::filesystem::path& file) {
  std::vector<std::string> words{
      "ffmpeg", "-y", "-framerate", std::to_string(pictures_per_s), "-i", (folder / "%04d.png").string()};
  if (file.extension() == ".gif") {
    words.insert(words.end(), {"-filter_complex", "split[a][b];[a]palettegen[p];[b][p]paletteuse"});
  } else {
    words.insert(words.end(), {"-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-pix_fmt", "yuv420p"});
  }
  words.push_back(std::filesystem::absolute(file).string());
  if (run_program(std::move(words)) == 0) return {};
  return core::output_error(fmt::format("{}: ffmpeg could not write it", file.string()));
}

}  // namespace plumbline::cli
