// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The one place for qualities of service; each line of qos.cpp says why.
#include <dds/dds.h>

#include <memory>
#include <string>
#include <vector>

#include "plumbline/net/options.hpp"

namespace plumbline::net {

using Qos = std::unique_ptr<dds_qos_t, decltype(&dds_delete_qos)>;

/// Of publishers and subscribers.
Qos partition_qos(const std::vector<std::string>& partitions);
/// Of hellos and the hub's words.
Qos word_qos();
/// Of transactions' pieces.
/// `most_ms`: that who writes waits for room.
Qos piece_qos(int most_ms = 100);
/// Of the participant: keys, when there are any.
core::Result<Qos> participant_qos(const NetworkOptions& options);
/// The configuration of a domain, XML. The environment is not read.
std::string domain_configuration(const NetworkOptions& options, bool hub);

}  // namespace plumbline::net
