// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/pipeline/graph.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <set>
#include <system_error>

namespace plumbline::pipeline {
namespace {

using core::ConfigMark;
using core::ConfigNode;
using core::ConfigProblems;
using Kind = ConfigNode::Kind;

const std::vector<std::string> kReservedKeys{"type", "inputs"};

std::string suggestion(const std::string& word, const std::vector<std::string>& allowed) {
  const std::string near = core::did_you_mean(word, allowed);
  return fmt::format("(allowed: {}{})", fmt::join(allowed, ", "),
                     near.empty() ? "" : fmt::format("; did you mean {}?", near));
}

bool is_stage_name(const std::string& name) {
  const auto allowed = [](char c) { return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_'; };
  return !name.empty() && name[0] >= 'a' && name[0] <= 'z' && std::all_of(name.begin(), name.end(), allowed);
}

/// "stage.key=value" of the command line.
struct Override {
  std::string stage;
  std::string key;
  ConfigNode value;
};

void place_on_command_line(ConfigNode& node) {
  node.mark = {"--set", 0, 0};
  for (ConfigNode& item : node.items) place_on_command_line(item);
  for (auto& [key, value] : node.entries) place_on_command_line(value);
  for (ConfigMark& mark : node.key_marks) mark = {"--set", 0, 0};
}

std::vector<Override> parse_overrides(const std::vector<std::string>& texts, ConfigProblems& problems) {
  const ConfigMark mark{"--set", 0, 0};
  std::vector<Override> overrides;
  for (const std::string& text : texts) {
    const std::size_t equals = text.find('=');
    const std::size_t dot = text.find('.');
    if (equals == std::string::npos || dot == std::string::npos || dot == 0 || dot + 1 >= equals) {
      problems.push_back({mark, text, "write it as stage.key=value, e.g. --set track.points=off"});
      continue;
    }
    auto value = core::parse_yaml(text.substr(equals + 1), text.substr(0, equals));
    if (!value) {
      problems.push_back({mark, text.substr(0, equals), "the value is not valid YAML"});
      continue;
    }
    if (equals + 1 == text.size()) value->kind = Kind::kScalar;  // "stage.key=" is the empty text
    place_on_command_line(*value);
    overrides.push_back({text.substr(0, dot), text.substr(dot + 1, equals - dot - 1), std::move(*value)});
  }
  return overrides;
}

/// A stage as the file gives it.
struct Draft {
  Node node;
  ConfigMark mark;
  std::string path;
  const ConfigNode* body = nullptr;
  std::vector<std::size_t> reads_from;  ///< drafts; also where only the port is wrong, for the cycle check
};

class GraphBuilder {
 public:
  GraphBuilder(const StageRegistry& registry, CheckContext context, ConfigProblems& problems)
      : registry_(registry), context_(std::move(context)), problems_(problems) {}

  Graph build(const ConfigNode& root, const std::vector<Override>& overrides) {
    Graph graph;
    if (root.kind != Kind::kMap) {
      problem(root.mark, "", "a pipeline is a map with the keys description and stages");
      return graph;
    }
    read_top(root, graph);
    for (Draft& draft : drafts_) read_stage(draft);
    for (Draft& draft : drafts_) connect(draft);
    apply(overrides);
    for (Draft& draft : drafts_) {
      if (draft.node.stage) draft.node.stage->check(context_, draft.mark, draft.path, problems_);
    }
    const std::vector<std::size_t> order = sorted();
    check_shape();
    if (problems_.empty()) assemble(order, graph);
    return graph;
  }

 private:
  void problem(const ConfigMark& mark, std::string path, std::string what) {
    problems_.push_back({mark, std::move(path), std::move(what)});
  }

  void read_top(const ConfigNode& root, Graph& graph) {
    // `run` is what a result's config.yaml says about its run; it configures nothing.
    const std::vector<std::string> keys{"description", "stages", "run"};
    for (std::size_t i = 0; i < root.entries.size(); ++i) {
      const std::string& key = root.entries[i].first;
      if (std::find(keys.begin(), keys.end(), key) == keys.end()) {
        problem(root.key_marks[i], key, "unknown key " + suggestion(key, keys));
      }
    }
    if (const ConfigNode* text = root.find("description")) {
      if (text->kind != Kind::kScalar) problem(text->mark, "description", "must be a text");
      graph.description = text->scalar;
    }
    const ConfigNode* stages = root.find("stages");
    if (stages == nullptr || stages->kind != Kind::kMap || stages->entries.empty()) {
      problem(stages != nullptr ? stages->mark : root.mark, "stages",
              "must be a map of stages, e.g. read: {type: read}");
      return;
    }
    for (std::size_t i = 0; i < stages->entries.size(); ++i) {
      const auto& [name, body] = stages->entries[i];
      if (!is_stage_name(name)) {
        problem(stages->key_marks[i], "stages." + name, "a stage's name is made of a-z, 0-9 and _");
      }
      Draft draft;
      draft.node.name = name;
      draft.mark = stages->key_marks[i];
      draft.path = "stages." + name;
      draft.body = &body;
      drafts_.push_back(std::move(draft));
    }
  }

  void read_stage(Draft& draft) {
    const ConfigNode& body = *draft.body;
    if (body.kind != Kind::kMap) {
      return problem(draft.mark, draft.path, "must be a map with a type, e.g. {type: read}");
    }
    const ConfigNode* type = body.find("type");
    if (type == nullptr || type->kind != Kind::kScalar) {
      return problem(type != nullptr ? type->mark : draft.mark, draft.path,
                     fmt::format("needs a type (allowed: {})", fmt::join(registry_.names(), ", ")));
    }
    draft.node.type = registry_.find(type->scalar);
    if (draft.node.type == nullptr) {
      return problem(type->mark, draft.path + ".type",
                     fmt::format("unknown stage type '{}' {}", type->scalar,
                                 suggestion(type->scalar, registry_.names())));
    }
    draft.node.stage = draft.node.type->make();
    draft.node.stage->declare(draft.node.options);
    draft.node.options.set_all(body, draft.path, problems_, kReservedKeys);
  }

  // ---- inputs

  void connect(Draft& draft) {
    const ConfigNode* inputs = draft.body->find("inputs");
    if (draft.node.type == nullptr) return note_uses(draft, inputs);
    const std::vector<Port>& ports = draft.node.type->inputs;
    draft.node.inputs.resize(ports.size());
    const std::string path = draft.path + ".inputs";
    if (inputs != nullptr && inputs->kind != Kind::kMap && inputs->kind != Kind::kNull) {
      return problem(inputs->mark, path, "must be a map, e.g. {frame: read}");
    }
    if (inputs != nullptr) {
      for (std::size_t i = 0; i < inputs->entries.size(); ++i) {
        const auto& [name, from] = inputs->entries[i];
        connect_one(draft, name, inputs->key_marks[i], from);
      }
    }
    for (const Port& port : ports) {
      if (port.required && (inputs == nullptr || inputs->find(port.name) == nullptr)) {
        problem(inputs != nullptr ? inputs->mark : draft.mark, path,
                fmt::format("the input {} is missing ({})", port.name, givers(port.type)));
      }
    }
  }

  /// What a stage of unknown type reads from is not unused.
  void note_uses(Draft& draft, const ConfigNode* inputs) {
    if (inputs == nullptr) return;
    for (const auto& [name, from] : inputs->entries) {
      const std::size_t giver = find_draft(from.scalar.substr(0, from.scalar.find('.')));
      if (giver < drafts_.size()) draft.reads_from.push_back(giver);
    }
  }

  void connect_one(Draft& draft, const std::string& name, const ConfigMark& mark, const ConfigNode& from) {
    const std::vector<Port>& ports = draft.node.type->inputs;
    const std::string path = draft.path + ".inputs." + name;
    const auto port = std::find_if(ports.begin(), ports.end(), [&](const Port& p) { return p.name == name; });
    if (port == ports.end()) {
      std::vector<std::string> names;
      for (const Port& p : ports) names.push_back(p.name);
      return problem(mark, path,
                     names.empty() ? "unknown input (this stage takes none)"
                                   : "unknown input " + suggestion(name, names));
    }
    if (from.kind != Kind::kScalar) return problem(from.mark, path, "must be a stage or stage.port");
    const std::size_t dot = from.scalar.find('.');
    const std::string stage_name = from.scalar.substr(0, dot);
    const std::size_t giver = find_draft(stage_name);
    if (giver == drafts_.size()) {
      std::vector<std::string> names;
      for (const Draft& d : drafts_) names.push_back(d.node.name);
      return problem(from.mark, path,
                     fmt::format("there is no stage '{}' {}", stage_name, suggestion(stage_name, names)));
    }
    draft.reads_from.push_back(giver);
    const StageType* type = drafts_[giver].node.type;
    if (type == nullptr) return;  // told already
    const std::string port_name = dot == std::string::npos ? "" : from.scalar.substr(dot + 1);
    for (std::size_t p = 0; p < type->outputs.size(); ++p) {
      if (!(type->outputs[p].type == port->type)) continue;
      if (!port_name.empty() && type->outputs[p].name != port_name) continue;
      draft.node.inputs[static_cast<std::size_t>(port - ports.begin())] = OutputRef{giver, p};
      return;
    }
    std::vector<std::string> given;
    for (const Port& p : type->outputs) given.push_back(p.name + " (" + p.type.name + ")");
    problem(
        from.mark, path,
        fmt::format("'{}' does not give the {} that is needed here; it gives {} ({})", from.scalar,
                    port->type.name, given.empty() ? "nothing" : fmt::format("{}", fmt::join(given, ", ")),
                    givers(port->type)));
  }

  [[nodiscard]] std::size_t find_draft(const std::string& name) const {
    const auto found =
        std::find_if(drafts_.begin(), drafts_.end(), [&](const Draft& d) { return d.node.name == name; });
    return static_cast<std::size_t>(found - drafts_.begin());
  }

  /// "allowed: ..." for an input of this type.
  [[nodiscard]] std::string givers(const PortType& type) const {
    std::vector<std::string> names;
    for (const Draft& draft : drafts_) {
      if (draft.node.type == nullptr) continue;
      for (const Port& port : draft.node.type->outputs) {
        if (port.type == type) names.push_back(draft.node.name);
      }
    }
    if (names.empty()) return fmt::format("no stage of this file gives a {}", type.name);
    return fmt::format("allowed: {}", fmt::join(names, ", "));
  }

  // ---- the graph as a whole

  void apply(const std::vector<Override>& overrides) {
    const ConfigMark mark{"--set", 0, 0};
    for (const Override& o : overrides) {
      const std::size_t target = find_draft(o.stage);
      if (target == drafts_.size()) {
        std::vector<std::string> names;
        for (const Draft& d : drafts_) names.push_back(d.node.name);
        problem(mark, o.stage + "." + o.key,
                fmt::format("there is no stage '{}' {}", o.stage, suggestion(o.stage, names)));
      } else if (std::find(kReservedKeys.begin(), kReservedKeys.end(), o.key) != kReservedKeys.end()) {
        problem(mark, o.stage + "." + o.key, "only options can be set; change the graph in a pipeline file");
      } else if (drafts_[target].node.type != nullptr) {
        drafts_[target].node.options.set(o.key, o.value, o.stage, problems_);
      }
    }
  }

  /// Kahn's algorithm; of the stages that could be next, the first in the file. Tells what is left as a
  /// cycle.
  std::vector<std::size_t> sorted() {
    std::vector<std::size_t> order;
    std::vector<bool> placed(drafts_.size(), false);
    while (order.size() < drafts_.size()) {
      std::size_t next = 0;
      for (; next < drafts_.size(); ++next) {
        const auto& from = drafts_[next].reads_from;
        if (!placed[next] && std::all_of(from.begin(), from.end(), [&](std::size_t f) { return placed[f]; }))
          break;
      }
      if (next == drafts_.size()) {
        tell_cycle(placed);
        break;
      }
      placed[next] = true;
      order.push_back(next);
    }
    return order;
  }

  void tell_cycle(const std::vector<bool>& placed) {
    // Every stage that is left reads from one that is left: walking back must come round.
    std::size_t at =
        static_cast<std::size_t>(std::find(placed.begin(), placed.end(), false) - placed.begin());
    std::vector<std::size_t> walk;
    while (std::find(walk.begin(), walk.end(), at) == walk.end()) {
      walk.push_back(at);
      const auto& from = drafts_[at].reads_from;
      at = *std::find_if(from.begin(), from.end(), [&](std::size_t f) { return !placed[f]; });
    }
    walk.erase(walk.begin(), std::find(walk.begin(), walk.end(), at));
    std::rotate(walk.begin(), std::min_element(walk.begin(), walk.end()), walk.end());
    std::vector<std::string> names;
    for (const std::size_t w : walk) names.push_back(drafts_[w].node.name);
    names.push_back(names.front());
    problem(drafts_[walk.front()].mark, drafts_[walk.front()].path,
            fmt::format("the stages read from each other in a circle ({})", fmt::join(names, " <- ")));
  }

  void check_shape() {
    std::vector<std::size_t> sources;
    std::set<std::size_t> used;
    bool all_known = true;
    for (std::size_t d = 0; d < drafts_.size(); ++d) {
      all_known = all_known && drafts_[d].node.type != nullptr;
      if (drafts_[d].node.type != nullptr && drafts_[d].node.type->is_source()) sources.push_back(d);
      used.insert(drafts_[d].reads_from.begin(), drafts_[d].reads_from.end());
    }
    for (std::size_t d = 0; d < drafts_.size(); ++d) {
      const StageType* type = drafts_[d].node.type;
      if (type == nullptr || type->outputs.empty() || used.count(d) != 0) continue;
      problem(drafts_[d].mark, drafts_[d].path, "nothing reads from this stage; connect it or remove it");
    }
    if (sources.empty() && all_known && !drafts_.empty()) {
      problem(drafts_.front().mark, "stages", "no stage gives frames; add one of type read");
    }
    for (std::size_t i = 1; i < sources.size(); ++i) {
      problem(drafts_[sources[i]].mark, drafts_[sources[i]].path,
              fmt::format("a pipeline has one stage that gives frames; {} is one already",
                          drafts_[sources[0]].node.name));
    }
  }

  void assemble(const std::vector<std::size_t>& order, Graph& graph) {
    std::map<std::size_t, std::size_t> place;  // draft -> node
    for (const std::size_t d : order) {
      place[d] = graph.nodes.size();
      graph.nodes.push_back(std::move(drafts_[d].node));
      for (auto& input : graph.nodes.back().inputs) {
        if (input) input->node = place.at(input->node);
      }
    }
  }

  const StageRegistry& registry_;
  CheckContext context_;
  ConfigProblems& problems_;
  std::vector<Draft> drafts_;
};

core::Result<Graph> build_graph(const core::Result<ConfigNode>& root, const std::filesystem::path& file,
                                const StageRegistry& registry, const std::filesystem::path& pipelines_folder,
                                const std::vector<std::string>& override_texts) {
  if (!root) return tl::unexpected<core::Error>(root.error());
  ConfigProblems problems;
  const std::vector<Override> overrides = parse_overrides(override_texts, problems);
  GraphBuilder builder(registry, {file.parent_path(), pipelines_folder}, problems);
  Graph graph = builder.build(*root, overrides);
  if (!problems.empty()) return tl::unexpected<core::Error>(core::to_error(problems));
  return graph;
}

}  // namespace

const Node& Graph::source() const {
  for (const Node& node : nodes) {
    if (node.type->is_source()) return node;
  }
  throw std::logic_error("a checked graph has a source");
}

core::Result<Graph> load_graph(const std::filesystem::path& file, const StageRegistry& registry,
                               const std::filesystem::path& pipelines_folder,
                               const std::vector<std::string>& overrides) {
  return build_graph(core::read_yaml(file), file, registry, pipelines_folder, overrides);
}

core::Result<Graph> parse_graph(const std::string& yaml, const std::filesystem::path& file,
                                const StageRegistry& registry, const std::filesystem::path& pipelines_folder,
                                const std::vector<std::string>& overrides) {
  return build_graph(core::parse_yaml(yaml, file.string()), file, registry, pipelines_folder, overrides);
}

std::string to_yaml(const Graph& graph) {
  std::string text;
  if (!graph.description.empty()) {
    std::string escaped;
    for (const char c : graph.description) {
      if (c == '"' || c == '\\') escaped += '\\';
      escaped += c == '\n' ? ' ' : c;
    }
    text += fmt::format("description: \"{}\"\n", escaped);
  }
  text += "stages:\n";
  for (const Node& node : graph.nodes) {
    text += fmt::format("  {}:\n    type: {}\n", node.name, node.type->name);
    std::vector<std::string> inputs;
    for (std::size_t i = 0; i < node.inputs.size(); ++i) {
      if (!node.inputs[i]) continue;
      const Node& from = graph.nodes[node.inputs[i]->node];
      inputs.push_back(fmt::format("{}: {}.{}", node.type->inputs[i].name, from.name,
                                   from.type->outputs[node.inputs[i]->port].name));
    }
    if (!inputs.empty()) text += fmt::format("    inputs: {{{}}}\n", fmt::join(inputs, ", "));
    for (const core::OptionSpec& spec : node.options.specs()) {
      text += fmt::format("    {}: {}\n", spec.key, node.options.value(spec.key));
    }
  }
  return text;
}

std::vector<std::string> pipeline_names(const std::filesystem::path& pipelines_folder) {
  std::vector<std::string> names;
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(pipelines_folder, ignored)) {
    if (entry.path().extension() == ".yaml") names.push_back(entry.path().stem().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

core::Result<std::filesystem::path> find_pipeline(const std::string& name_or_file,
                                                  const std::filesystem::path& pipelines_folder) {
  std::error_code ignored;
  if (std::filesystem::is_regular_file(name_or_file, ignored)) return std::filesystem::path(name_or_file);
  for (const char* ending : {"", ".yaml"}) {
    const std::filesystem::path shipped = pipelines_folder / (name_or_file + ending);
    if (std::filesystem::is_regular_file(shipped, ignored)) return shipped;
  }
  return core::usage_error(fmt::format("{}: no such pipeline file, and no shipped pipeline has that name {}",
                                       name_or_file,
                                       suggestion(name_or_file, pipeline_names(pipelines_folder))));
}

}  // namespace plumbline::pipeline
