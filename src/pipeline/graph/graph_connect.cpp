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
std::string givers(const Drafts& drafts, const PortType& type) {
  std::vector<std::string> names;
  for (const Draft& draft : drafts) {
    if (draft.node.type == nullptr) continue;
    for (const Port& port : draft.node.type->outputs) {
      if (port.type == type) names.push_back(draft.node.name);
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
  Connector(Drafts& drafts, ConfigProblems& problems) : drafts_(drafts), problems_(problems) {}

  void connect(Draft& draft) {
    const ConfigNode* inputs = draft.body->find("inputs");
    if (draft.node.type == nullptr) return note_uses(draft, inputs);
    const std::vector<Port>& ports = draft.node.type->inputs;
    draft.node.inputs.resize(ports.size());
    const std::string path = draft.path + ".inputs";
    const std::size_t before = problems_.size();
    if (inputs != nullptr && inputs->kind != Kind::kMap && inputs->kind != Kind::kNull) {
      problems_.push_back({inputs->mark, path, "must be a map, e.g. {frame: read}"});
      draft.dangling = true;
      return;
    }
    meant_.clear();
    if (inputs != nullptr) {
      for (std::size_t i = 0; i < inputs->entries.size(); ++i) {
        const auto& [name, from] = inputs->entries[i];
        connect_one(draft, name, inputs->key_marks[i], from);
      }
    }
    for (const Port& port : ports) {
      if (!port.required || (inputs != nullptr && inputs->find(port.name) != nullptr)) continue;
      if (std::find(meant_.begin(), meant_.end(), port.name) != meant_.end())
        continue;  // told as a typing error
      problems_.push_back(
          {inputs != nullptr ? inputs->mark : draft.mark, path,
           fmt::format("the input {} is missing ({})", port.name, givers(drafts_, port.type))});
    }
    draft.dangling = problems_.size() != before;
  }

 private:
  /// What a stage of unknown type reads from is not unused.
  void note_uses(Draft& draft, const ConfigNode* inputs) const {
    if (inputs == nullptr) return;
    for (const auto& [name, from] : inputs->entries) {
      const std::size_t giver = find_draft(drafts_, from.scalar.substr(0, from.scalar.find('.')));
      if (giver < drafts_.size()) draft.reads_from.push_back(giver);
    }
  }

  void connect_one(Draft& draft, const std::string& name, const ConfigMark& mark, const ConfigNode& from) {
    const auto problem = [&](const ConfigMark& at, std::string what) {
      problems_.push_back({at, draft.path + ".inputs." + name, std::move(what)});
    };
    const std::vector<Port>& ports = draft.node.type->inputs;
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
    const std::size_t giver = find_draft(drafts_, stage_name);
    if (giver == drafts_.size()) {
      return problem(from.mark, fmt::format("there is no stage '{}'{}", stage_name.substr(0, 40),
                                            core::hint(stage_name, names_of(drafts_))));
    }
    draft.reads_from.push_back(giver);
    const StageType* type = drafts_[giver].node.type;
    if (type == nullptr) return;  // told already
    const auto output =
        fitting_output(*type, dot == std::string::npos ? "" : from.scalar.substr(dot + 1), port->type);
    if (output) {
      draft.node.inputs[static_cast<std::size_t>(port - ports.begin())] = OutputRef{giver, *output};
      return;
    }
    std::vector<std::string> given;
    for (const Port& p : type->outputs) given.push_back(p.name + " (" + p.type.name + ")");
    problem(from.mark, fmt::format("'{}' does not give the {} that is needed here; it gives {} ({})",
                                   from.scalar, port->type.name,
                                   given.empty() ? "nothing" : fmt::format("{}", fmt::join(given, ", ")),
                                   givers(drafts_, port->type)));
  }

  Drafts& drafts_;
  ConfigProblems& problems_;
  std::vector<std::string> meant_;  ///< ports of this stage that were written with a typing error
};

}  // namespace

void connect(Drafts& drafts, ConfigProblems& problems) {
  Connector connector(drafts, problems);
  for (Draft& draft : drafts) connector.connect(draft);
}

}  // namespace plumbline::pipeline
