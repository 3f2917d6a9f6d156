// SPDX-License-Identifier: BSD-3-Clause
// Every YAML file that is shipped is read by the code that users' files are read by.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include "../../../src/pipeline/graph/option_levels.hpp"
#include "plumbline/cloud/filters/filter_chain.hpp"
#include "plumbline/pipeline/graph.hpp"
#include "plumbline/pipeline/reference.hpp"
#include "plumbline/sensor/camera_file.hpp"
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
  return chain->name() == file.stem() ? "" : file.string() + ": the chain is called " + chain->name();
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
  const std::map<std::string, std::string (*)(const fs::path&)> loaders = {{"", load_pipeline},
                                                                           {"filters", load_filters},
                                                                           {"filters/examples", load_filters},
                                                                           {"cameras", load_camera},
                                                                           {"scenes", load_scene}};
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

std::string text_of(const fs::path& file) {
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

TEST(Shipped, StagesPageIsUpToDate) {
  StageRegistry registry;
  register_stages(registry);
  const std::string made = stages_reference(registry);
  EXPECT_EQ(text_of(fs::path(PLUMBLINE_SOURCE_DIR) / "docs/reference/stages.md"), made)
      << "make it anew: plumbline pipelines describe > docs/reference/stages.md";
  for (const std::string& name : registry.names()) {
    EXPECT_NE(made.find("\n## " + name + "\n"), std::string::npos) << name;
  }
}

TEST(Shipped, PipelinesPageKnowsEveryPipeline) {
  const std::string page = text_of(fs::path(PLUMBLINE_SOURCE_DIR) / "docs/guide/pipelines.md");
  for (const std::string& name : core::yaml_names(kShipped)) {
    EXPECT_NE(page.find("| `" + name + "` |"), std::string::npos)
        << "docs/guide/pipelines.md does not tell of " << name;
  }
}

TEST(Shipped, EveryStageIsUsedByAPipelineOrAnExampleOfThePage) {
  StageRegistry registry;
  register_stages(registry);
  std::string texts = text_of(fs::path(PLUMBLINE_SOURCE_DIR) / "docs/guide/pipelines.md");
  for (const std::string& name : core::yaml_names(kShipped)) {
    const auto graph = load_graph(kShipped / (name + ".yaml"), registry, kShipped);
    ASSERT_TRUE(graph) << graph.error().message;
    texts += to_yaml(*graph);
  }
  for (const std::string& name : registry.names()) {
    EXPECT_NE(texts.find("type: " + name), std::string::npos) << "no pipeline has a stage " << name;
  }
}

TEST(Shipped, EveryPortCanBeTapped) {
  StageRegistry registry;
  register_stages(registry);
  for (const StageTypePtr& type : registry.types()) {
    for (const Port& port : type->outputs) {
      EXPECT_NE(registry.find_tap(port.type), nullptr)
          << type->name << "." << port.name << ": add a tap of " << port.type.name;
    }
  }
}

TEST(Shipped, WhatIsWrittenOutReadsBackTheSame) {
  StageRegistry registry;
  register_stages(registry);
  for (const std::string& name : core::yaml_names(kShipped)) {
    const auto graph = load_graph(kShipped / (name + ".yaml"), registry, kShipped);
    ASSERT_TRUE(graph) << graph.error().message;
    const std::string text = to_yaml(*graph);
    const auto again = parse_graph(text, "/nowhere/config.yaml", registry, "/nowhere");
    ASSERT_TRUE(again) << name << ": " << again.error().message << text;
    EXPECT_EQ(to_yaml(*again), text);
  }
}

bool has_option(const StageRegistry& registry, const std::string& stage, const std::string& key) {
  const StageTypePtr type = registry.find(stage);
  if (type == nullptr) return false;
  const auto made = type->make();
  core::OptionTable table;
  made->declare(table);
  return std::any_of(table.specs().begin(), table.specs().end(),
                     [&](const core::OptionSpec& spec) { return spec.key == key; });
}

TEST(Shipped, LevelsNameOptionsThatAreThere) {
  StageRegistry registry;
  register_stages(registry);
  std::map<OptionLevel, std::size_t> count;
  for (const auto& [stage, key] : levelled_options()) {
    EXPECT_TRUE(has_option(registry, stage, key)) << stage << "." << key;
  }
  for (const StageTypePtr& type : registry.types()) {
    const auto made = type->make();
    core::OptionTable table;
    made->declare(table);
    for (const core::OptionSpec& spec : table.specs()) ++count[option_level(type->name, spec.key)];
  }
  EXPECT_LE(count[OptionLevel::kBasic], 90U);
  EXPECT_LE(count[OptionLevel::kAdvanced], 75U);
  RecordProperty("basic", static_cast<int>(count[OptionLevel::kBasic]));
}

}  // namespace
}  // namespace plumbline::pipeline
