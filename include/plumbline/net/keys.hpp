// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Keys for --security: one authority, a folder for the hub and one for each robot (docs/guide/network.md).
#include <filesystem>
#include <string>
#include <vector>

#include "plumbline/core/error.hpp"

namespace plumbline::net {

/// Makes `folder`, which must not exist, with ca/ (stays with who makes keys), hub/ and one folder for each
/// robot, each complete. Folders 0700, files 0600. Errors: (kUsage) it exists, a name that cannot be or is
/// there twice; (kOutput) it cannot be written.
core::Result<void> create_keys(const std::filesystem::path& folder, const std::vector<std::string>& robots);
/// More robots, by the same authority. Errors as create_keys; (kInput) `folder` has no authority.
core::Result<void> add_keys(const std::filesystem::path& folder, const std::vector<std::string>& robots);
/// From now on these robots are let in nowhere that has the new crl.pem: it is written into ca/, hub/ and all
/// robots' folders that are here. Errors as add_keys; (kUsage) nobody has this name.
core::Result<void> revoke_keys(const std::filesystem::path& folder, const std::vector<std::string>& robots);

}  // namespace plumbline::net
