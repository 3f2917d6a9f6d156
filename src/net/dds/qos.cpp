// SPDX-License-Identifier: BSD-3-Clause
#include "qos.hpp"

#include <fmt/format.h>

#include <system_error>
#include <tuple>
#include <utility>

#include "keys.hpp"

namespace plumbline::net {
namespace {

constexpr std::int32_t kStatusesKept = 64;  // as many robots as may publish between two polls
constexpr std::int32_t kChunksKept = 8;     // at most 8 MB a robot wait at either end

Qos new_qos() { return {dds_create_qos(), &dds_delete_qos}; }

}  // namespace

Qos partition_qos(const std::vector<std::string>& partitions) {
  Qos qos = new_qos();
  std::vector<const char*> names;
  for (const std::string& name : partitions) names.push_back(name.c_str());
  // Permissions name partitions: only keys of a robot may publish in its partition.
  dds_qset_partition(qos.get(), static_cast<std::uint32_t>(names.size()), names.data());
  return qos;
}

Qos status_qos() {
  Qos qos = new_qos();
  // Each status is complete and repeated after half a second: a lost one does no harm, and a publisher never
  // waits for a slow reader.
  dds_qset_reliability(qos.get(), DDS_RELIABILITY_BEST_EFFORT, 0);
  // Old statuses are of no use to a late joiner.
  dds_qset_durability(qos.get(), DDS_DURABILITY_VOLATILE);
  // Bounded: of a flood the latest statuses are kept.
  dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, kStatusesKept);
  return qos;
}

Qos chunk_qos(int most_ms) {
  Qos qos = new_qos();
  // DDS sends lost fragments again; the robot, which knows what was acknowledged, sends again everything that
  // was lost with a link or a process. A writer waits a moment for space, then returns to its loop.
  dds_qset_reliability(qos.get(), DDS_RELIABILITY_RELIABLE, DDS_MSECS(most_ms));
  // The store is the history: one in DDS would end with its process and arrive twice.
  dds_qset_durability(qos.get(), DDS_DURABILITY_VOLATILE);
  // Nothing is overwritten: a missing chunk costs the whole transaction.
  dds_qset_history(qos.get(), DDS_HISTORY_KEEP_ALL, 0);
  // Bounded: a reader that is full refuses, and the writer waits.
  dds_qset_resource_limits(qos.get(), kChunksKept, 1, kChunksKept);
  return qos;
}

core::Result<Qos> participant_qos(const NetworkOptions& options) {
  // Without keys nothing is secured
  Qos qos = new_qos();
  if (options.security.empty()) return qos;

  // Paths must not depend on the working directory
  std::error_code ec;
  const std::filesystem::path folder = std::filesystem::absolute(options.security);
  const auto set = [&](const char* name, const std::string& value) {
    dds_qset_prop(qos.get(), name, value.c_str());
  };

  // Identity and permissions, as files
  for (const auto& [name, file] : {std::pair{"dds.sec.auth.identity_ca", kAuthorityFile},
                                   {"dds.sec.auth.identity_certificate", kCertificateFile},
                                   {"dds.sec.auth.private_key", kKeyFile},
                                   {"org.eclipse.cyclonedds.sec.auth.crl", kRevokedFile},
                                   {"dds.sec.access.permissions_ca", kAuthorityFile},
                                   {"dds.sec.access.governance", kGovernanceFile},
                                   {"dds.sec.access.permissions", kPermissionsFile}}) {
    // A missing file is named in the message
    if (!std::filesystem::exists(folder / file, ec)) {
      return core::usage_error(fmt::format(
          "--security: {} is missing; give a robot's or the hub's folder made by plumbline keys create",
          (options.security / file).string()));
    }
    set(name, "file:" + (folder / file).string());
  }

  // Plugins of Cyclone DDS, by absolute path
  for (const auto& [plugin, library, function] : {std::tuple{"auth", "auth", "authentication"},
                                                  {"access", "ac", "access_control"},
                                                  {"crypto", "crypto", "crypto"}}) {
    const std::string head = fmt::format("dds.sec.{}.library.", plugin);
    set((head + "path").c_str(), fmt::format("{}/libdds_security_{}.so", PLUMBLINE_DDS_PLUGINS, library));
    set((head + "init").c_str(), fmt::format("init_{}", function));
    set((head + "finalize").c_str(), fmt::format("finalize_{}", function));
  }
  return qos;
}

std::string domain_configuration(const NetworkOptions& options, bool hub) {
  // Peers are named where multicast is missing
  const bool tcp = options.transport == Transport::kTcp;
  const bool local = options.interface == "lo";
  std::string peers;
  for (const std::string& peer : options.peers) peers += fmt::format("<Peer Address=\"{}\"/>", peer);

  // lo may lack multicast: every possible port is tried there.
  if (local && !tcp && options.peers.empty()) peers = "<Peer Address=\"127.0.0.1\"/>";

  // Multicast of data floods a WiFi: it is used for discovery only.
  const bool multicast = !tcp && peers.empty();
  std::string xml = "<CycloneDDS><Domain Id=\"any\"><General>";
  xml += fmt::format("<Interfaces><NetworkInterface name=\"{}\"/></Interfaces>", options.interface);
  xml += fmt::format("<AllowMulticast>{}</AllowMulticast>", multicast ? "spdp" : "false");
  xml += fmt::format("<Transport>{}</Transport>", tcp ? "tcp" : "udp");
  xml += "</General><Discovery>";

  // Number of ports to try at a peer without a port; the default of 9 is too small.
  if (!tcp)
    xml += "<ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>63</MaxAutoParticipantIndex>";

  // A cable that is plugged in again is noticed at once, not after 30 s.
  xml += "<SPDPInterval>1 s</SPDPInterval>";

  // A participant silent for this long is gone: data queued for it is dropped.
  xml += "<LeaseDuration>10 s</LeaseDuration>";
  if (!peers.empty()) xml += "<Peers>" + peers + "</Peers>";
  if (!tcp && options.port > 0) xml += fmt::format("<Ports><Base>{}</Base></Ports>", options.port);
  xml += "</Discovery>";

  // The hub listens, robots connect.
  if (tcp) xml += fmt::format("<TCP><Port>{}</Port></TCP>", hub ? options.port : -1);

  // No memory for samples larger than any message.
  xml += "<Internal><MaxSampleSize>16 MB</MaxSampleSize></Internal>";
  return xml + "</Domain></CycloneDDS>";
}

}  // namespace plumbline::net
