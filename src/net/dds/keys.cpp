// SPDX-License-Identifier: BSD-3-Clause
#include "keys.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <openssl/bio.h>
#include <openssl/ec.h>
#include <openssl/err.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/pkcs7.h>
#include <openssl/rand.h>
#include <openssl/x509.h>
#include <openssl/x509v3.h>
#include <sys/stat.h>
#include <unistd.h>

#include <memory>
#include <stdexcept>
#include <system_error>

namespace plumbline::net {
namespace {

namespace fs = std::filesystem;

constexpr long kDay_s = 86400;
constexpr long kAuthorityDays = 3650;
constexpr long kKeyDays = 730;
constexpr const char* kAuthority = "plumbline authority";

struct Failure : std::runtime_error {
  using std::runtime_error::runtime_error;
};

template <typename T, void (*kFree)(T*)>
struct Free {
  void operator()(T* thing) const { kFree(thing); }
};
using Key = std::unique_ptr<EVP_PKEY, Free<EVP_PKEY, &EVP_PKEY_free>>;
using Certificate = std::unique_ptr<X509, Free<X509, &X509_free>>;
using Crl = std::unique_ptr<X509_CRL, Free<X509_CRL, &X509_CRL_free>>;
using Signature = std::unique_ptr<PKCS7, Free<PKCS7, &PKCS7_free>>;
using Bio = std::unique_ptr<BIO, Free<BIO, &BIO_free_all>>;

void demand(bool holds, const std::string& what) {
  if (!holds) throw Failure(what);
}

/// Writes a file of mode 0600 through `write`, replacing one of that name.
template <typename Write>
void write_file(const fs::path& file, const Write& write) {
  const fs::path fresh = file.string() + ".new";
  ::unlink(fresh.c_str());
  const int descriptor = ::open(fresh.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  demand(descriptor >= 0, file.string() + ": cannot be written; check folder and permissions");
  FILE* stream = ::fdopen(descriptor, "w");
  const Bio out(BIO_new_fp(stream, BIO_CLOSE));
  const bool done = write(out.get()) == 1 && BIO_flush(out.get()) == 1;
  demand(done && ::rename(fresh.c_str(), file.c_str()) == 0,
         file.string() + ": cannot be written; is the disk full?");
}

void make_folder(const fs::path& folder) {
  demand(::mkdir(folder.c_str(), 0700) == 0,
         folder.string() + ": cannot be made; check folder and permissions");
}

/// Reads one PEM file; a damaged one is an error.
template <typename Thing, typename Read>
Thing read_pem(const fs::path& file, const Read& read) {
  const Bio in(BIO_new_file(file.c_str(), "r"));
  demand(in != nullptr, file.string() + ": cannot be read; give a folder that plumbline keys create made");
  Thing thing(read(in.get()));
  demand(thing != nullptr, file.string() + ": is damaged");
  return thing;
}
Certificate read_certificate(const fs::path& file) {
  return read_pem<Certificate>(file,
                               [](BIO* in) { return PEM_read_bio_X509(in, nullptr, nullptr, nullptr); });
}
Key read_key(const fs::path& file) {
  return read_pem<Key>(file, [](BIO* in) { return PEM_read_bio_PrivateKey(in, nullptr, nullptr, nullptr); });
}

Crl read_crl(const fs::path& folder) {
  return read_pem<Crl>(folder / "ca" / kRevokedFile,
                       [](BIO* in) { return PEM_read_bio_X509_CRL(in, nullptr, nullptr, nullptr); });
}
void write_certificate(const fs::path& file, X509* certificate) {
  write_file(file, [&](BIO* out) { return PEM_write_bio_X509(out, certificate); });
}
void write_key(const fs::path& file, EVP_PKEY* key) {
  write_file(file, [&](BIO* out) {
    return PEM_write_bio_PrivateKey(out, key, nullptr, nullptr, 0, nullptr, nullptr);
  });
}

Key new_key() {
  Key key(EVP_EC_gen("P-256"));
  demand(key != nullptr, "OpenSSL makes no key");
  return key;
}

/// A certificate with a random positive number, valid since yesterday.
Certificate new_certificate(EVP_PKEY* key, const std::string& name, long days) {
  Certificate certificate(X509_new());
  X509_set_version(certificate.get(), 2);
  std::int64_t serial = 0;
  demand(RAND_bytes(reinterpret_cast<unsigned char*>(&serial), sizeof serial) == 1,
         "OpenSSL has no random numbers");
  constexpr std::int64_t kPositive = 0x7fffffffffffffffLL;
  ASN1_INTEGER_set_int64(X509_get_serialNumber(certificate.get()), serial & kPositive);
  X509_gmtime_adj(X509_getm_notBefore(certificate.get()), -kDay_s);  // clocks differ
  X509_gmtime_adj(X509_getm_notAfter(certificate.get()), days * kDay_s);
  X509_set_pubkey(certificate.get(), key);
  X509_NAME_add_entry_by_txt(X509_get_subject_name(certificate.get()), "CN", MBSTRING_ASC,
                             reinterpret_cast<const unsigned char*>(name.c_str()), -1, -1, 0);
  return certificate;
}

/// The extension as text, as in OpenSSL's configuration.
void add_extension(X509* certificate, X509* issuer, int what, const char* value) {
  X509V3_CTX context;
  X509V3_set_ctx(&context, issuer, certificate, nullptr, nullptr, 0);
  X509_EXTENSION* extension = X509V3_EXT_conf_nid(nullptr, &context, what, value);
  demand(extension != nullptr && X509_add_ext(certificate, extension, -1) == 1,
         "OpenSSL makes no certificate");
  X509_EXTENSION_free(extension);
}

void sign(X509* certificate, X509* issuer, EVP_PKEY* key) {
  X509_set_issuer_name(certificate, X509_get_subject_name(issuer));
  demand(X509_sign(certificate, key, EVP_sha256()) > 0, "OpenSSL does not sign");
}

struct Authority {
  Certificate certificate;
  Key key;
};

Authority read_authority(const fs::path& folder) {
  return {read_certificate(folder / "ca" / kAuthorityFile), read_key(folder / "ca" / kKeyFile)};
}

/// Writes a document as signed S/MIME, as DDS security requires.
void write_signed(const fs::path& file, const std::string& xml, const Authority& authority) {
  const Bio in(BIO_new_mem_buf(xml.data(), static_cast<int>(xml.size())));
  constexpr int kFlags = PKCS7_TEXT | PKCS7_DETACHED | PKCS7_STREAM;
  const Signature made(
      PKCS7_sign(authority.certificate.get(), authority.key.get(), nullptr, in.get(), kFlags));
  demand(made != nullptr, "OpenSSL does not sign");
  write_file(file, [&](BIO* out) { return SMIME_write_PKCS7(out, made.get(), in.get(), kFlags); });
}

const char* const kHead =
    "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
    "<dds xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\" "
    "xsi:noNamespaceSchemaLocation=\"http://www.omg.org/spec/DDS-SECURITY/20170901/omg_shared_ca_{}.xsd\">\n";
const char* const kDomains = "<domains><id_range><min>0</min><max>230</max></id_range></domains>\n";

/// DDS Security's rules: everything is encrypted, nobody takes part without a certificate.
std::string governance() {
  return fmt::format(fmt::runtime(kHead), "governance") + "<domain_access_rules><domain_rule>\n" + kDomains +
         "<allow_unauthenticated_participants>false</allow_unauthenticated_participants>\n"
         "<enable_join_access_control>true</enable_join_access_control>\n"
         "<discovery_protection_kind>ENCRYPT</discovery_protection_kind>\n"
         "<liveliness_protection_kind>ENCRYPT</liveliness_protection_kind>\n"
         "<rtps_protection_kind>ENCRYPT</rtps_protection_kind>\n"
         "<topic_access_rules><topic_rule><topic_expression>*</topic_expression>\n"
         "<enable_discovery_protection>true</enable_discovery_protection>\n"
         "<enable_liveliness_protection>true</enable_liveliness_protection>\n"
         "<enable_read_access_control>true</enable_read_access_control>\n"
         "<enable_write_access_control>true</enable_write_access_control>\n"
         "<metadata_protection_kind>NONE</metadata_protection_kind>\n"
         "<data_protection_kind>NONE</data_protection_kind>\n"
         "</topic_rule></topic_access_rules></domain_rule></domain_access_rules></dds>\n";
}

/// One rule of the permissions.
std::string allow(const char* what, const std::vector<std::string>& topics,
                  const std::vector<std::string>& partitions) {
  std::string xml = fmt::format("<{}><topics>", what);
  for (const std::string& topic : topics) xml += fmt::format("<topic>{}</topic>", topic);
  xml += "</topics><partitions>";
  for (const std::string& partition : partitions) xml += fmt::format("<partition>{}</partition>", partition);
  return xml + fmt::format("</partitions></{}>\n", what);
}

/// A robot may publish and subscribe in the partition of its name; the hub in all.
std::string permissions(const std::string& name) {
  const bool hub = name == "hub";
  const std::vector<std::string> where =
      hub ? std::vector<std::string>{"*", "_hub"} : std::vector<std::string>{name};
  std::string xml = fmt::format(fmt::runtime(kHead), "permissions");
  xml += fmt::format("<permissions><grant name=\"{}\"><subject_name>CN={}</subject_name>\n", name, name);
  xml +=
      "<validity><not_before>2020-01-01T00:00:00</not_before><not_after>2099-01-01T00:00:00</not_after></"
      "validity>\n";
  xml += std::string("<allow_rule>\n") + kDomains;
  if (hub) {
    xml += allow("publish", {"plumbline_hub_status", "plumbline_feedback"}, where);
    xml += allow("subscribe", {"plumbline_robot_status", "plumbline_chunk", "plumbline_hub_status"}, where);
  } else {
    xml += allow("publish", {"plumbline_robot_status", "plumbline_chunk"}, where);
    xml += allow("subscribe", {"plumbline_hub_status", "plumbline_feedback"}, where);
  }
  return xml + "</allow_rule><default>DENY</default></grant></permissions></dds>\n";
}

/// The list of revoked certificates, copied to every folder of keys.
void write_crl(const fs::path& folder, const Authority& authority, X509_CRL* crl) {
  X509_CRL_set_version(crl, 1);
  X509_CRL_set_issuer_name(crl, X509_get_subject_name(authority.certificate.get()));
  ASN1_TIME* now = X509_gmtime_adj(nullptr, -kDay_s);
  ASN1_TIME* later = X509_gmtime_adj(nullptr, kAuthorityDays * kDay_s);
  X509_CRL_set1_lastUpdate(crl, now);
  X509_CRL_set1_nextUpdate(crl, later);
  ASN1_TIME_free(now);
  ASN1_TIME_free(later);
  X509_CRL_sort(crl);
  demand(X509_CRL_sign(crl, authority.key.get(), EVP_sha256()) > 0, "OpenSSL does not sign");
  for (const auto& entry : fs::directory_iterator(folder)) {
    const bool keys =
        fs::exists(entry.path() / kCertificateFile) || fs::exists(entry.path() / kAuthorityFile);
    if (!entry.is_directory() || !keys) continue;
    write_file(entry.path() / kRevokedFile, [&](BIO* out) { return PEM_write_bio_X509_CRL(out, crl); });
  }
}

/// Failures of OpenSSL and of files become results.
template <typename Action>
core::Result<void> guarded(core::ErrorKind kind, const Action& action) {
  try {
    action();
    return {};
  } catch (const Failure& failure) {
    return core::failure(kind, failure.what());
  } catch (const std::system_error& failure) {
    return core::failure(kind, failure.what());
  }
}

}  // namespace

/// A certificate authority with an empty list of revoked keys.
core::Result<void> make_authority(const fs::path& folder) {
  return guarded(core::ErrorKind::kOutput, [&] {
    make_folder(folder);
    make_folder(folder / "ca");
    make_folder(folder / "ca" / "issued");
    Authority authority{nullptr, new_key()};
    authority.certificate = new_certificate(authority.key.get(), kAuthority, kAuthorityDays);
    add_extension(authority.certificate.get(), authority.certificate.get(), NID_basic_constraints,
                  "critical,CA:TRUE");
    add_extension(authority.certificate.get(), authority.certificate.get(), NID_key_usage,
                  "critical,keyCertSign,cRLSign,digitalSignature");
    sign(authority.certificate.get(), authority.certificate.get(), authority.key.get());
    write_key(folder / "ca" / kKeyFile, authority.key.get());
    write_certificate(folder / "ca" / kAuthorityFile, authority.certificate.get());
    const Crl crl(X509_CRL_new());
    write_crl(folder, authority, crl.get());
  });
}

/// Key, certificate and signed permissions in a folder of that name.
core::Result<void> make_keys(const fs::path& folder, const std::string& name) {
  return guarded(core::ErrorKind::kOutput, [&] {
    const Authority authority = read_authority(folder);
    const Key key = new_key();
    const Certificate certificate = new_certificate(key.get(), name, kKeyDays);
    sign(certificate.get(), authority.certificate.get(), authority.key.get());
    const fs::path own = folder / name;
    make_folder(own);
    write_key(own / kKeyFile, key.get());
    for (const fs::path& file : {own / kCertificateFile, folder / "ca" / "issued" / (name + ".pem")}) {
      write_certificate(file, certificate.get());
    }
    write_certificate(own / kAuthorityFile, authority.certificate.get());
    const Crl crl = read_crl(folder);
    write_file(own / kRevokedFile, [&](BIO* out) { return PEM_write_bio_X509_CRL(out, crl.get()); });
    write_signed(own / kGovernanceFile, governance(), authority);
    write_signed(own / kPermissionsFile, permissions(name), authority);
  });
}

/// Adds certificates to the revocation list.
core::Result<void> revoke(const fs::path& folder, const std::vector<std::string>& names) {
  return guarded(core::ErrorKind::kUsage, [&] {
    const Authority authority = read_authority(folder);
    const Crl crl = read_crl(folder);
    for (const std::string& name : names) {
      const Certificate certificate = read_certificate(folder / "ca" / "issued" / (name + ".pem"));
      X509_REVOKED* entry = X509_REVOKED_new();
      X509_REVOKED_set_serialNumber(entry, X509_get_serialNumber(certificate.get()));
      ASN1_TIME* now = X509_gmtime_adj(nullptr, 0);
      X509_REVOKED_set_revocationDate(entry, now);
      ASN1_TIME_free(now);
      X509_CRL_add0_revoked(crl.get(), entry);
    }
    write_crl(folder, authority, crl.get());
  });
}

/// Days until the certificate expires; negative afterwards.
core::Result<int> days_left(const fs::path& folder) {
  int days = 0;  // towards 0: none on the first day after the certificate expired
  bool past = false;
  const auto read = guarded(core::ErrorKind::kUsage, [&] {
    const Certificate certificate = read_certificate(folder / kCertificateFile);
    int seconds = 0;
    demand(ASN1_TIME_diff(&days, &seconds, nullptr, X509_get0_notAfter(certificate.get())) == 1,
           (folder / kCertificateFile).string() + ": is damaged");
    past = seconds < 0;
  });
  if (!read) return core::usage_error("--security: " + read.error().message);
  return past ? days - 1 : days;
}

}  // namespace plumbline::net
