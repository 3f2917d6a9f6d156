// SPDX-License-Identifier: BSD-3-Clause
// Pipelines that begin with another file's stages.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <system_error>

#include "graph/graph_parts.hpp"

namespace plumbline::pipeline {
namespace {

namespace fs = std::filesystem;
using core::ConfigMark;
using core::ConfigNode;
using core::ConfigProblems;
using Kind = ConfigNode::Kind;

constexpr std::size_t kMaxFiles = 50;  ///< two includes a file would be a billion files thirty levels down

std::vector<std::string> keys_of(const ConfigNode* map) {
  std::vector<std::string> keys;
  if (map == nullptr) return keys;
  for (const auto& [key, unused] : map->entries) keys.push_back(key);
  return keys;
}

std::size_t place_of(const ConfigNode& map, const std::string& key) {
  const auto found =
      std::find_if(map.entries.begin(), map.entries.end(), [&](const auto& e) { return e.first == key; });
  return static_cast<std::size_t>(found - map.entries.begin());
}

ConfigNode* find(ConfigNode& map, const std::string& key) {
  const std::size_t place = place_of(map, key);
  return place < map.entries.size() ? &map.entries[place].second : nullptr;
}

/// Replaces or appends.
void put(ConfigNode& map, const std::string& key, ConfigNode value, const ConfigMark& mark) {
  map.kind = Kind::kMap;
  const std::size_t place = place_of(map, key);
  if (place < map.entries.size()) {
    map.entries[place].second = std::move(value);
    map.key_marks[place] = mark;
    return;
  }
  map.entries.emplace_back(key, std::move(value));
  map.key_marks.push_back(mark);
}

/// The list of words under `key`; a single word may be written without brackets.
std::vector<const ConfigNode*> words(const ConfigNode& root, const std::string& key, const char* example,
                                     ConfigProblems& problems) {
  const ConfigNode* node = root.find(key);
  if (node == nullptr) return {};
  std::vector<const ConfigNode*> list;
  if (node->kind == Kind::kSequence) {
    for (const ConfigNode& item : node->items) list.push_back(&item);
  } else {
    list.push_back(node);
  }
  for (const ConfigNode* item : list) {
    if (item->kind == Kind::kScalar && !item->scalar.empty()) continue;
    problems.push_back({item->mark, key, fmt::format("must be a name or a list of names, e.g. {}", example)});
    return {};
  }
  return list;
}

/// True if `own` changes the included stage `base`: it names the same type or none.
bool changes(const ConfigNode& own, const ConfigNode& base) {
  const ConfigNode* own_type = own.find("type");
  const ConfigNode* base_type = base.find("type");
  return own_type == nullptr || (base_type != nullptr && own_type->scalar == base_type->scalar);
}

void change_stage(const ConfigNode& own, ConfigNode& base) {
  for (std::size_t i = 0; i < own.entries.size(); ++i) {
    const auto& [key, value] = own.entries[i];
    ConfigNode* inputs = key == "inputs" && value.kind == Kind::kMap ? find(base, "inputs") : nullptr;
    if (inputs == nullptr || inputs->kind != Kind::kMap) {
      put(base, key, value, own.key_marks[i]);
      continue;
    }
    for (std::size_t k = 0; k < value.entries.size(); ++k) {
      put(*inputs, value.entries[k].first, value.entries[k].second, value.key_marks[k]);
    }
  }
}

class Includer {
 public:
  Includer(const fs::path& pipelines_folder, ConfigProblems& problems)
      : pipelines_folder_(pipelines_folder), problems_(problems) {}

  /// `file` is the one that `own` was read from.
  std::optional<ConfigNode> expand(ConfigNode own, const fs::path& file) {
    if (own.kind != Kind::kMap) {
      problems_.push_back({own.mark, "", "a pipeline is a map with the keys description and stages"});
      return std::nullopt;
    }

    check_top(own);
    const auto includes = words(own, "include", "include: rgbd.yaml", problems_);
    const auto removes = words(own, "remove", "remove: [refine]", problems_);
    if (includes.empty()) {
      if (!removes.empty()) {
        problems_.push_back(
            {removes[0]->mark, "remove", "there is no include whose stages could be removed"});
      }
      return own.find("include") == nullptr ? std::optional(std::move(own)) : std::nullopt;
    }

    // The file counts as open until its includes are read: an include of an open file closes a circle.
    open_.push_back(fs::weakly_canonical(file));
    ConfigNode base;
    base.kind = Kind::kMap;

    bool complete = true;
    for (const ConfigNode* include : includes) {
      std::optional<ConfigNode> included = read(*include, file);
      if (included) merge(*included, base);
      complete = complete && included.has_value();
    }

    open_.pop_back();
    if (!complete) return std::nullopt;

    // Removal comes before the file's own stages: a stage may be removed and then defined again from scratch.
    for (const ConfigNode* name : removes) remove(*name, base);
    drop_unknown_changes(own, base);
    base.mark = own.mark;
    merge(own, base);
    return base;
  }

 private:
  void check_top(const ConfigNode& root) {
    for (std::size_t i = 0; i < root.entries.size(); ++i) {
      const std::string& key = root.entries[i].first;
      if (std::find(kTopKeys.begin(), kTopKeys.end(), key) != kTopKeys.end()) continue;
      problems_.push_back({root.key_marks[i], key, "unknown key" + core::hint(key, kTopKeys)});
    }
    const ConfigNode* taps = root.find("taps");
    if (taps != nullptr && taps->kind != Kind::kSequence) {
      problems_.push_back(
          {taps->mark, "taps", "must be a list of taps, e.g. - {port: fuse.cloud, file: cloud.ply}"});
    }
  }

  std::optional<ConfigNode> read(const ConfigNode& name, const fs::path& from) {
    const auto refuse = [&](const std::string& what) {
      problems_.push_back({name.mark, "include", what});
      return std::nullopt;
    };

    const fs::path file = resolve(name.scalar, from.parent_path());
    if (file.empty()) {
      return refuse(fmt::format(
          "there is no '{}' beside this file, and no shipped pipeline of that name{}", name.scalar,
          core::hint(fs::path(name.scalar).stem().string(), core::yaml_names(pipelines_folder_))));
    }

    const fs::path canonical = fs::weakly_canonical(file);

    // A circle would run into the limit of files; the message shows it from file to file instead.
    const auto again = std::find(open_.begin(), open_.end(), canonical);
    if (again != open_.end()) {
      std::vector<std::string> circle;
      for (auto at = again; at != open_.end(); ++at) circle.push_back(at->filename().string());
      circle.push_back(canonical.filename().string());
      return refuse(fmt::format("the files include each other in a circle ({})", fmt::join(circle, " -> ")));
    }
    if (++files_ > kMaxFiles) return refuse(fmt::format("includes more than {} files", kMaxFiles));

    std::optional<ConfigNode> tree = core::read_yaml(file, problems_);
    if (!tree) return std::nullopt;
    return expand(std::move(*tree), file);
  }

  /// Beside the file that includes it, or shipped; ".yaml" may be left out.
  [[nodiscard]] fs::path resolve(const std::string& name, const fs::path& beside) const {
    std::error_code ignored;
    for (const fs::path& folder : {beside, pipelines_folder_}) {
      for (const char* ending : {"", ".yaml"}) {
        fs::path file = folder / (name + ending);
        if (fs::is_regular_file(file, ignored)) return file;
      }
    }
    return {};
  }

  void remove(const ConfigNode& name, ConfigNode& base) {
    ConfigNode* stages = find(base, "stages");
    const std::size_t place = stages != nullptr ? place_of(*stages, name.scalar) : 0;
    if (stages == nullptr || place == stages->entries.size()) {
      problems_.push_back({name.mark, "remove",
                           fmt::format("there is no included stage '{}'{}", name.scalar,
                                       core::hint(name.scalar, keys_of(stages)))});
      return;
    }
    stages->entries.erase(stages->entries.begin() + static_cast<std::ptrdiff_t>(place));
    stages->key_marks.erase(stages->key_marks.begin() + static_cast<std::ptrdiff_t>(place));
  }

  /// A stage without type changes an included one; if there is none of that name, that is the only problem
  /// reported.
  void drop_unknown_changes(ConfigNode& own, ConfigNode& base) {
    ConfigNode* stages = find(own, "stages");
    if (stages == nullptr || stages->kind != Kind::kMap) return;
    const std::vector<std::string> known = keys_of(find(base, "stages"));
    for (std::size_t i = stages->entries.size(); i-- > 0;) {
      const auto& [name, body] = stages->entries[i];
      const bool is_new = body.kind != Kind::kMap || body.find("type") != nullptr;
      if (is_new || std::find(known.begin(), known.end(), name) != known.end()) continue;
      problems_.push_back(
          {stages->key_marks[i], "stages." + name,
           fmt::format("there is no included stage '{}' to change, and a new one needs a type{}", name,
                       core::hint(name, known))});
      stages->entries.erase(stages->entries.begin() + static_cast<std::ptrdiff_t>(i));
      stages->key_marks.erase(stages->key_marks.begin() + static_cast<std::ptrdiff_t>(i));
    }
  }

  /// `over` on top of `base`.
  static void merge(const ConfigNode& over, ConfigNode& base) {
    for (std::size_t i = 0; i < over.entries.size(); ++i) {
      const auto& [key, value] = over.entries[i];
      ConfigNode* there = find(base, key);
      if (key == "include" || key == "remove" || key == "run") continue;
      if (key == "stages" && there != nullptr && value.kind == Kind::kMap) {
        merge_stages(value, *there);
      } else if (key == "taps" && there != nullptr && value.kind == Kind::kSequence) {
        there->items.insert(there->items.end(), value.items.begin(), value.items.end());
      } else {
        put(base, key, value, over.key_marks[i]);
      }
    }
  }

  static void merge_stages(const ConfigNode& over, ConfigNode& base) {
    for (std::size_t i = 0; i < over.entries.size(); ++i) {
      const auto& [name, body] = over.entries[i];
      ConfigNode* there = find(base, name);
      const bool both = there != nullptr && there->kind == Kind::kMap && body.kind == Kind::kMap;
      if (both && changes(body, *there)) {
        change_stage(body, *there);
      } else {
        put(base, name, body, over.key_marks[i]);
      }
    }
  }

  fs::path pipelines_folder_;
  ConfigProblems& problems_;
  std::vector<fs::path> open_;  ///< files that are being included
  std::size_t files_ = 0;
};

}  // namespace

std::optional<ConfigNode> with_includes(ConfigNode own, const fs::path& file,
                                        const fs::path& pipelines_folder, ConfigProblems& problems) {
  return Includer(pipelines_folder, problems).expand(std::move(own), file);
}

}  // namespace plumbline::pipeline
