// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Keys for --security: one authority, a folder for the hub and one for each robot (docs/guide/network.md).
#include <filesystem>
#include <string>
#include <vector>

#include "plumbline/core/error.hpp"

namespace plumbline::net {

/// Makes `folder`, which must not exist, with ca/ (keep it private), hub/ and one complete folder for each
/// robot. Folders have mode 0700, files 0600. Errors: (kUsage) it exists, an invalid or repeated name;
/// (kOutput) it cannot be written.
core::Result<void> create_keys(const std::filesystem::path& folder, const std::vector<std::string>& robots);
/// Adds keys for more robots, signed by the same authority. Errors as create_keys; (kInput) `folder` has no
/// authority.
core::Result<void> add_keys(const std::filesystem::path& folder, const std::vector<std::string>& robots);
/// Revokes robots' keys: whoever has the new crl.pem no longer admits them. It is written into ca/, hub/ and
/// all robots' folders below `folder`. Errors as add_keys; (kUsage) no keys have this name.
core::Result<void> revoke_keys(const std::filesystem::path& folder, const std::vector<std::string>& robots);

}  // namespace plumbline::net
