// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Certificates and signed permissions for DDS security, made with OpenSSL's library.
#include <filesystem>
#include <string>
#include <vector>

#include "plumbline/core/error.hpp"

namespace plumbline::net {

core::Result<void> make_authority(const std::filesystem::path& folder);
/// The folder `name` with its key, certificate, permissions and the authority's certificate.
core::Result<void> make_keys(const std::filesystem::path& folder, const std::string& name);
core::Result<void> revoke(const std::filesystem::path& folder, const std::vector<std::string>& names);

/// The files in a folder of keys.
constexpr const char* kAuthorityFile = "ca.pem";
constexpr const char* kCertificateFile = "certificate.pem";
constexpr const char* kKeyFile = "key.pem";
constexpr const char* kGovernanceFile = "governance.p7s";
constexpr const char* kPermissionsFile = "permissions.p7s";
constexpr const char* kRevokedFile = "crl.pem";

/// Days until the certificate in a folder of keys expires; negative: it has expired. Errors (kUsage): it
/// cannot be read.
core::Result<int> days_left(const std::filesystem::path& folder);

}  // namespace plumbline::net
