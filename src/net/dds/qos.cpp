// SPDX-License-Identifier: BSD-3-Clause
#include "qos.hpp"

#include <fmt/format.h>

#include <system_error>
#include <tuple>
#include <utility>

#include "keys.hpp"

namespace plumbline::net {
namespace {

constexpr std::int32_t kWordsKept = 64;  // as many robots as may speak between two looks
constexpr std::int32_t kPiecesKept = 8;  // 8 MB a robot at most wait at either end

Qos new_qos() { return {dds_create_qos(), &dds_delete_qos}; }

}  // namespace

Qos partition_qos(const std::vector<std::string>& partitions) {
  Qos qos = new_qos();
  std::vector<const char*> names;
  for (const std::string& name : partitions) names.push_back(name.c_str());
  // Permissions name partitions: who speaks in a robot's may speak for that robot.
  dds_qset_partition(qos.get(), static_cast<std::uint32_t>(names.size()), names.data());
  return qos;
}

Qos word_qos() {
  Qos qos = new_qos();
  // Each word says all that matters, and comes again in half a second: one that is lost does no harm, and who
  // speaks never waits for who does not listen.
  dds_qset_reliability(qos.get(), DDS_RELIABILITY_BEST_EFFORT, 0);
  // A word of before is worth nothing to who comes late.
  dds_qset_durability(qos.get(), DDS_DURABILITY_VOLATILE);
  // Bounded: of a flood the latest words are kept.
  dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, kWordsKept);
  return qos;
}

Qos piece_qos(int most_ms) {
  Qos qos = new_qos();
  // What is lost on the way is sent again by DDS, fragment by fragment; what is lost with a link or a process
  // by the robot, which knows what was acknowledged. Who sends waits a moment for room, then looks around.
  dds_qset_reliability(qos.get(), DDS_RELIABILITY_RELIABLE, DDS_MSECS(most_ms));
  // History would die with its process and come twice: the store is the history.
  dds_qset_durability(qos.get(), DDS_DURABILITY_VOLATILE);
  // Nothing is overwritten: a piece that is missing costs the whole transaction.
  dds_qset_history(qos.get(), DDS_HISTORY_KEEP_ALL, 0);
  // Bounded: a reader that is full refuses, and the writer waits.
  dds_qset_resource_limits(qos.get(), kPiecesKept, 1, kPiecesKept);
  return qos;
}

core::Result<Qos> participant_qos(const NetworkOptions& options) {
  Qos qos = new_qos();
  if (options.security.empty()) return qos;
  std::error_code ec;
  const std::filesystem::path folder = std::filesystem::absolute(options.security);
  const auto set = [&](const char* name, const std::string& value) {
    dds_qset_prop(qos.get(), name, value.c_str());
  };
  for (const auto& [name, file] : {std::pair{"dds.sec.auth.identity_ca", kAuthorityFile},
                                   {"dds.sec.auth.identity_certificate", kCertificateFile},
                                   {"dds.sec.auth.private_key", kKeyFile},
                                   {"org.eclipse.cyclonedds.sec.auth.crl", kRevokedFile},
                                   {"dds.sec.access.permissions_ca", kAuthorityFile},
                                   {"dds.sec.access.governance", kGovernanceFile},
                                   {"dds.sec.access.permissions", kPermissionsFile}}) {
    if (!std::filesystem::exists(folder / file, ec)) {
      return core::usage_error(fmt::format(
          "--security: {} is not there; give a robot's or the hub's folder that plumbline keys create made",
          (options.security / file).string()));
    }
    set(name, "file:" + (folder / file).string());
  }
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
  const bool tcp = options.transport == Transport::kTcp;
  const bool local = options.interface == "lo";
  std::string peers;
  for (const std::string& peer : options.peers) peers += fmt::format("<Peer Address=\"{}\"/>", peer);
  // lo has no multicast everywhere; there, others are looked for at every port that they may have.
  if (local && !tcp && options.peers.empty()) peers = "<Peer Address=\"127.0.0.1\"/>";
  // Data by multicast floods a WiFi: it is for looking for others at most.
  const bool multicast = !tcp && peers.empty();
  std::string xml = "<CycloneDDS><Domain Id=\"any\"><General>";
  xml += fmt::format("<Interfaces><NetworkInterface name=\"{}\"/></Interfaces>", options.interface);
  xml += fmt::format("<AllowMulticast>{}</AllowMulticast>", multicast ? "spdp" : "false");
  xml += fmt::format("<Transport>{}</Transport>", tcp ? "tcp" : "udp");
  xml += "</General><Discovery>";
  // Peers without a port are looked for at the ports of so many participants of their host; 9 are too few.
  if (!tcp)
    xml += "<ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>63</MaxAutoParticipantIndex>";
  // A cable that is back is noticed at once, not after 30 s.
  xml += "<SPDPInterval>1 s</SPDPInterval>";
  // Who was not heard for so long is gone: what waits for it is let go.
  xml += "<LeaseDuration>10 s</LeaseDuration>";
  if (!peers.empty()) xml += "<Peers>" + peers + "</Peers>";
  if (!tcp && options.port > 0) xml += fmt::format("<Ports><Base>{}</Base></Ports>", options.port);
  xml += "</Discovery>";
  // A hub is called, a robot calls.
  if (tcp) xml += fmt::format("<TCP><Port>{}</Port></TCP>", hub ? options.port : -1);
  // More than a message of ours can have takes no memory.
  xml += "<Internal><MaxSampleSize>16 MB</MaxSampleSize></Internal>";
  return xml + "</Domain></CycloneDDS>";
}

}  // namespace plumbline::net
