// SPDX-License-Identifier: BSD-3-Clause
// Part of every test program. ctest runs each test as a process of its own, several at a time: a folder for
// temporary files that belongs to the process keeps two tests that write a file of the same name apart. It
// goes with the process.
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <string>

namespace {

class ScratchFolder {
 public:
  ScratchFolder() : owner_(getpid()) {
    std::error_code error;
    path_ = (std::filesystem::temp_directory_path(error) / "plumbline_test_XXXXXX").string();
    if (error || mkdtemp(path_.data()) == nullptr) {
      path_.clear();
      return;
    }
    setenv("TMPDIR", path_.c_str(), 1);
    setenv("TEST_TMPDIR", path_.c_str(), 1);
  }
  ~ScratchFolder() {
    if (path_.empty() || getpid() != owner_) return;  // a forked child leaves its parent's files alone
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;

 private:
  std::string path_;
  pid_t owner_;
};

const ScratchFolder scratch_folder;

}  // namespace
