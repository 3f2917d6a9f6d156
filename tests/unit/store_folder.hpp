// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A folder of its own for each test's store.
#include <stdlib.h>

#include <filesystem>
#include <stdexcept>
#include <string>

#include "plumbline/maps/store.hpp"

namespace plumbline::tests {

struct StoreFolder {
  std::filesystem::path path;

  StoreFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "plumbline_store_XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("no folder for the test");
    path = name;
  }
  ~StoreFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path, ignored);
  }
  StoreFolder(const StoreFolder&) = delete;
  StoreFolder& operator=(const StoreFolder&) = delete;
  [[nodiscard]] std::filesystem::path file() const { return path / "map.db"; }
};

inline maps::StoreHeader header_of(const sensor::Camera& camera) {
  maps::StoreHeader header;
  header.robots = {{0, "robot 'a'; DROP TABLE point", camera}};
  header.configuration = "stages:\n  - {name: read, robot: \"ä\"}\n";
  header.program_version = "1.2.3";
  return header;
}

}  // namespace plumbline::tests
