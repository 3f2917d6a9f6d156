// SPDX-License-Identifier: BSD-3-Clause
// Every YAML file that is shipped is read by the code that users' files are read by.
#include <gtest/gtest.h>

#include <filesystem>
#include <map>

#include "plumbline/cloud/filter_chain.hpp"
#include "plumbline/pipeline/graph.hpp"
#include "plumbline/sensor/camera.hpp"
#include "plumbline/synth/scene.hpp"

namespace plumbline::pipeline {
namespace {

namespace fs = std::filesystem;

const fs::path kShipped = fs::path(PLUMBLINE_SOURCE_DIR) / "pipelines";

/// "" or what is wrong with the file.
std::string load_pipeline(const fs::path& file) {
  StageRegistry registry;
  register_stages(registry);
  const auto graph = load_graph(file, registry, kShipped);
  if (!graph) return graph.error().message;
  return graph->description.empty() ? file.string() + ": has no description" : "";
}

std::string load_filters(const fs::path& file) {
  const auto chain = cloud::FilterChain::load(file, cloud::builtin_filters());
  if (!chain) return chain.error().message;
  return chain->size() == 0 ? file.string() + ": has no filters" : "";
}

std::string load_camera(const fs::path& file) {
  const auto camera = sensor::find_camera(file.stem().string(), kShipped / "cameras");
  return camera ? "" : camera.error().message;
}

std::string load_scene(const fs::path& file) {
  const auto scene = synth::load_scene(file.stem().string(), kShipped / "scenes");
  if (!scene) return scene.error().message;
  return scene->faces.empty() ? file.string() + ": nothing is in it" : "";
}

TEST(Shipped, EveryFileLoads) {
  const std::map<std::string, std::string (*)(const fs::path&)> loaders = {
      {"", load_pipeline}, {"filters", load_filters}, {"cameras", load_camera}, {"scenes", load_scene}};
  std::map<std::string, int> loaded;
  for (const auto& entry : fs::recursive_directory_iterator(kShipped)) {
    if (!entry.is_regular_file()) continue;
    EXPECT_EQ(entry.path().extension(), ".yaml") << entry.path();
    const fs::path folder = fs::relative(entry.path().parent_path(), kShipped);
    const auto loader = loaders.find(folder == "." ? "" : folder.string());
    ASSERT_NE(loader, loaders.end()) << "nothing in this test loads the files of " << folder;
    EXPECT_EQ(loader->second(entry.path()), "");
    ++loaded[loader->first];
  }
  for (const auto& [folder, unused] : loaders) EXPECT_GT(loaded[folder], 0) << folder;
}

}  // namespace
}  // namespace plumbline::pipeline
