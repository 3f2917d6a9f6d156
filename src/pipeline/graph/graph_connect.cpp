// SPDX-License-Identifier: BSD-3-Clause
// The inputs of every stage: which port of which stage.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "graph/graph_parts.hpp"

namespace plumbline::pipeline {
namespace {

using core::ConfigMark;
using core::ConfigNode;
using core::ConfigProblems;
using Kind = ConfigNode::Kind;

/// "allowed: ..." for an input of this type.
std::string givers(const StageSpecs& specs, const PortType& type) {
  std::vector<std::string> names;
  for (const StageSpec& spec : specs) {
    if (spec.node.type == nullptr) continue;
    for (const Port& port : spec.node.type->outputs) {
      if (port.type == type) names.push_back(spec.node.name);
    }
  }
  if (names.empty()) return fmt::format("no stage of this file gives a {}", type.name);
  return fmt::format("allowed: {}", fmt::join(names, ", "));
}

/// The first port of `type` that fits; its number or none.
std::optional<std::size_t> fitting_output(const StageType& giver, const std::string& port_name,
                                          const PortType& type) {
  for (std::size_t p = 0; p < giver.outputs.size(); ++p) {
    if (!(giver.outputs[p].type == type)) continue;
    if (port_name.empty() || giver.outputs[p].name == port_name) return p;
  }
  return std::nullopt;
}

class Connector {
 public:
  Connector(StageSpecs& specs, ConfigProblems& problems) : specs_(specs), problems_(problems) {}

  void connect(StageSpec& spec) {
    const ConfigNode* inputs = spec.body->find("inputs");
    if (spec.node.type == nullptr) return note_uses(spec, inputs);

    const std::vector<Port>& ports = spec.node.type->inputs;
    spec.node.inputs.resize(ports.size());
    const std::string path = spec.path + ".inputs";
    const std::size_t before = problems_.size();

    // A malformed list hides every input that was meant; to report them as missing as well would mislead.
    if (inputs != nullptr && inputs->kind != Kind::kMap && inputs->kind != Kind::kNull) {
      problems_.push_back({inputs->mark, path, "must be a map, e.g. {frame: read}"});
      spec.dangling = true;
      return;
    }

    meant_.clear();
    if (inputs != nullptr) {
      for (std::size_t i = 0; i < inputs->entries.size(); ++i) {
        const auto& [name, from] = inputs->entries[i];
        connect_one(spec, name, inputs->key_marks[i], from);
      }
    }

    // A misspelt input is one mistake: it is reported as unknown, and not as missing as well.
    for (const Port& port : ports) {
      if (!port.required || (inputs != nullptr && inputs->find(port.name) != nullptr)) continue;
      if (std::find(meant_.begin(), meant_.end(), port.name) != meant_.end())
        continue;  // reported as a typing error
      problems_.push_back(
          {inputs != nullptr ? inputs->mark : spec.mark, path,
           fmt::format("the input {} is missing ({})", port.name, givers(specs_, port.type))});
    }

    spec.dangling = problems_.size() != before;
  }

 private:
  /// Marks stages from which a stage of unknown type reads as used.
  void note_uses(StageSpec& spec, const ConfigNode* inputs) const {
    if (inputs == nullptr) return;
    for (const auto& [name, from] : inputs->entries) {
      const std::size_t giver = find_spec(specs_, from.scalar.substr(0, from.scalar.find('.')));
      if (giver < specs_.size()) spec.reads_from.push_back(giver);
    }
  }

  void connect_one(StageSpec& spec, const std::string& name, const ConfigMark& mark, const ConfigNode& from) {
    const auto problem = [&](const ConfigMark& at, std::string what) {
      problems_.push_back({at, spec.path + ".inputs." + name, std::move(what)});
    };

    const std::vector<Port>& ports = spec.node.type->inputs;
    const auto port = std::find_if(ports.begin(), ports.end(), [&](const Port& p) { return p.name == name; });
    if (port == ports.end()) {
      std::vector<std::string> names;
      for (const Port& p : ports) names.push_back(p.name);
      meant_.push_back(core::did_you_mean(name, names));
      return problem(mark, names.empty() ? "unknown input (this stage takes none)"
                                         : "unknown input" + core::hint(name, names));
    }
    if (from.kind != Kind::kScalar) return problem(from.mark, "must be a stage or stage.port");

    const std::size_t dot = from.scalar.find('.');
    const std::string stage_name = from.scalar.substr(0, dot);
    const std::size_t giver = find_spec(specs_, stage_name);
    if (giver == specs_.size()) {
      return problem(from.mark, fmt::format("there is no stage '{}'{}", stage_name.substr(0, 40),
                                            core::hint(stage_name, names_of(specs_))));
    }

    // The dependency counts even if the port turns out wrong: cycles and unused stages are judged by it.
    spec.reads_from.push_back(giver);
    const StageTypePtr& type = specs_[giver].node.type;
    if (type == nullptr) return;  // reported already

    const auto output =
        fitting_output(*type, dot == std::string::npos ? "" : from.scalar.substr(dot + 1), port->type);
    if (output) {
      spec.node.inputs[static_cast<std::size_t>(port - ports.begin())] = OutputRef{giver, *output};
      return;
    }

    // The message lists what this stage gives and which stages would fit, so that the line can be repaired.
    std::vector<std::string> given;
    for (const Port& p : type->outputs) given.push_back(p.name + " (" + p.type.name + ")");
    problem(from.mark, fmt::format("'{}' does not give the {} that is needed here; it gives {} ({})",
                                   from.scalar, port->type.name,
                                   given.empty() ? "nothing" : fmt::format("{}", fmt::join(given, ", ")),
                                   givers(specs_, port->type)));
  }

  StageSpecs& specs_;
  ConfigProblems& problems_;
  std::vector<std::string> meant_;  ///< ports of this stage that were written with a typing error
};

}  // namespace

void connect(StageSpecs& specs, ConfigProblems& problems) {
  Connector connector(specs, problems);
  for (StageSpec& spec : specs) connector.connect(spec);
}

}  // namespace plumbline::pipeline
