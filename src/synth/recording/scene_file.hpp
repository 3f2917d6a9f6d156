// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// scene.json: the world, its options, and the robots that filmed it.
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

#include "plumbline/synth/recording.hpp"
#include "plumbline/synth/source.hpp"

namespace plumbline::synth {

/// One of its robots. `seed`: of the sensors on the robot's body.
nlohmann::json describe_robot(const SynthSource& source, const std::string& folder,
                              const std::string& path_name, std::size_t frames, const SynthOptions& options,
                              std::uint64_t seed);

nlohmann::json describe_world(const Scene& scene, const SynthOptions& options, const WriteSummary& summary,
                              const nlohmann::json& robots);

}  // namespace plumbline::synth
