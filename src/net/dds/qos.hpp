// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// All quality-of-service settings; qos.cpp gives the reason for each.
#include <dds/dds.h>

#include <memory>
#include <string>
#include <vector>

#include "plumbline/net/options.hpp"

namespace plumbline::net {

using Qos = std::unique_ptr<dds_qos_t, decltype(&dds_delete_qos)>;

/// For publishers and subscribers.
Qos partition_qos(const std::vector<std::string>& partitions);
/// For statuses of robots and hub.
Qos status_qos();
/// For chunks. `most_ms`: how long a writer waits for room in its queue.
Qos chunk_qos(int most_ms = 100);
/// For the participant: its keys, if there are any.
core::Result<Qos> participant_qos(const NetworkOptions& options);
/// Configuration of a domain as XML. The environment is not read.
std::string domain_configuration(const NetworkOptions& options, bool hub);

}  // namespace plumbline::net
