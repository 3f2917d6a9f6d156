// SPDX-License-Identifier: BSD-3-Clause
// Taps: "taps: [{port: fuse.cloud, file: raw.ply}]" become stages that only write.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "graph/graph_parts.hpp"

namespace plumbline::pipeline {
namespace {

using core::ConfigNode;
using core::ConfigProblems;
using Kind = ConfigNode::Kind;

/// The port named by "stage" or "stage.port"; none: reported.
std::optional<OutputRef> find_port(const StageSpecs& specs, const ConfigNode& port, const std::string& path,
                                   ConfigProblems& problems) {
  const auto refuse = [&](std::string what) {
    problems.push_back({port.mark, path + ".port", std::move(what)});
    return std::nullopt;
  };

  const std::size_t dot = port.scalar.find('.');
  const std::string name = port.scalar.substr(0, dot);
  const std::size_t giver = find_spec(specs, name);
  if (giver == specs.size()) {
    return refuse(
        fmt::format("there is no stage '{}'{}", name.substr(0, 40), core::hint(name, names_of(specs))));
  }

  const StageTypePtr& type = specs[giver].node.type;
  if (type == nullptr) return std::nullopt;  // reported already

  std::vector<std::string> ports;
  for (const Port& p : type->outputs) ports.push_back(p.name);
  if (ports.empty()) return refuse(fmt::format("'{}' gives nothing that could be written", name));

  // The port may be left out only where there is no choice.
  if (dot == std::string::npos && ports.size() == 1) return OutputRef{giver, 0};

  const std::string wanted = dot == std::string::npos ? "" : port.scalar.substr(dot + 1);
  const auto found = std::find(ports.begin(), ports.end(), wanted);
  if (found != ports.end()) return OutputRef{giver, static_cast<std::size_t>(found - ports.begin())};
  if (dot == std::string::npos) {
    return refuse(fmt::format("'{}' has several ports; write one of {}.{}", name, name,
                              fmt::join(ports, fmt::format(", {}.", name))));
  }

  return refuse(fmt::format("'{}' has no port '{}'{}", name, wanted, core::hint(wanted, ports)));
}

}  // namespace

void add_taps(const ConfigNode& root, const StageRegistry& registry, StageSpecs& specs,
              ConfigProblems& problems) {
  const ConfigNode* taps = root.find("taps");
  if (taps == nullptr || taps->kind != Kind::kSequence) return;

  for (std::size_t i = 0; i < taps->items.size(); ++i) {
    const ConfigNode& entry = taps->items[i];
    const std::string path = fmt::format("taps[{}]", i);
    const ConfigNode* port = entry.find("port");
    if (entry.kind != Kind::kMap || port == nullptr || port->kind != Kind::kScalar) {
      problems.push_back({port != nullptr ? port->mark : entry.mark, path,
                          "must name a port, e.g. {port: fuse.cloud, file: cloud.ply}"});
      continue;
    }

    const auto from = find_port(specs, *port, path, problems);
    if (!from) continue;

    // From here on a tap is a stage like any other: order, options and written files are checked alike.
    const StageType& giver = *specs[from->node].node.type;
    StageSpec spec;
    spec.node.name = fmt::format("tap:{}.{}", specs[from->node].node.name, giver.outputs[from->port].name);
    spec.node.tap = true;
    spec.node.type = registry.find_tap(giver.outputs[from->port].type);
    spec.node.inputs = {from};
    spec.mark = entry.mark;
    spec.path = path;
    spec.body = &entry;
    spec.reads_from = {from->node};

    if (spec.node.type == nullptr) {
      problems.push_back({port->mark, path + ".port",
                          fmt::format("a {} cannot be written", giver.outputs[from->port].type.name)});
      continue;
    }

    spec.node.stage = spec.node.type->make();
    spec.node.stage->declare(spec.node.options);
    spec.node.options.set_all(entry, path, problems, {"port"});
    specs.push_back(std::move(spec));
  }
}

}  // namespace plumbline::pipeline
