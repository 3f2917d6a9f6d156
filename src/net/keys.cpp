// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/net/keys.hpp"

#include <fmt/format.h>

#include <set>
#include <system_error>

#include "bus.hpp"
#include "plumbline/net/options.hpp"

namespace plumbline::net {
namespace {

namespace fs = std::filesystem;

/// The part that makes keys. Errors (kUsage): an invalid or repeated name.
core::Result<const BusPart*> part_for(const std::vector<std::string>& robots) {
  std::set<std::string> names = {"ca", "hub"};
  for (const std::string& name : robots) {
    if (!is_robot_name(name)) {
      return core::usage_error(
          fmt::format("--robots: '{}' is not a valid name: use letters, digits, '.', '_' and '-'", name));
    }
    if (!names.insert(name).second) {
      return core::usage_error(fmt::format("--robots: {} is given twice or is reserved", name));
    }
  }
  return core::part<BusPart>();
}

}  // namespace

/// A new authority with keys for the hub and for these robots.
core::Result<void> create_keys(const fs::path& folder, const std::vector<std::string>& robots) {
  const auto keys = part_for(robots);
  if (!keys) return tl::unexpected(keys.error());
  std::error_code ec;
  if (fs::exists(folder, ec)) {
    return core::usage_error(
        folder.string() +
        ": exists already; add robots with plumbline keys add, or choose a new folder for new keys");
  }
  if (auto made = (*keys)->make_authority(folder); !made) return made;
  if (auto made = (*keys)->make_keys(folder, "hub"); !made) return made;
  for (const std::string& name : robots) {
    if (auto made = (*keys)->make_keys(folder, name); !made) return made;
  }
  return {};
}

/// Keys for further robots; none are made if one exists.
core::Result<void> add_keys(const fs::path& folder, const std::vector<std::string>& robots) {
  const auto keys = part_for(robots);
  if (!keys) return tl::unexpected(keys.error());
  std::error_code ec;
  for (const std::string& name : robots) {
    if (fs::exists(folder / name, ec))
      return core::usage_error((folder / name).string() + ": exists already");
  }
  for (const std::string& name : robots) {
    if (auto made = (*keys)->make_keys(folder, name); !made) return made;
  }
  return {};
}

core::Result<void> revoke_keys(const fs::path& folder, const std::vector<std::string>& robots) {
  return part_for(robots).and_then([&](const BusPart* keys) { return keys->revoke(folder, robots); });
}

}  // namespace plumbline::net
