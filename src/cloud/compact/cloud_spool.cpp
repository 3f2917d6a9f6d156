// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/cloud/cloud_spool.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <string>
#include <utility>

namespace plumbline::cloud {

core::Result<CloudSpool> CloudSpool::create(const std::filesystem::path& folder,
                                            const CompactCloudOptions& options) {
  std::string name = (folder / ".clouds-XXXXXX").string();
  const int descriptor = mkostemp(name.data(), O_CLOEXEC);
  if (descriptor < 0) {
    return core::output_error(
        fmt::format("{}: no temporary file can be made there ({})", folder.string(), std::strerror(errno)));
  }
  unlink(name.c_str());
  return CloudSpool(folder, options, descriptor);
}

CloudSpool::CloudSpool(std::filesystem::path folder, const CompactCloudOptions& options, int descriptor)
    : folder_(std::move(folder)), options_(options), descriptor_(descriptor) {}

CloudSpool::CloudSpool(CloudSpool&& other) noexcept
    : folder_(std::move(other.folder_)),
      options_(other.options_),
      descriptor_(std::exchange(other.descriptor_, -1)),
      end_(other.end_),
      places_(std::move(other.places_)) {}

CloudSpool::~CloudSpool() {
  if (descriptor_ >= 0) close(descriptor_);
}

core::Result<void> CloudSpool::append(const Cloud& cloud) { return append(encode_cloud(cloud, options_)); }

core::Result<void> CloudSpool::append(const std::vector<std::uint8_t>& compact) {
  std::size_t done = 0;
  while (done < compact.size()) {
    const ssize_t wrote =
        pwrite(descriptor_, compact.data() + done, compact.size() - done, static_cast<off_t>(end_ + done));
    if (wrote < 0 && errno == EINTR) continue;
    if (wrote <= 0) {
      return core::output_error(fmt::format(
          "{}: the keyframes' clouds cannot be kept there ({}; {} MB so far); free space or name a folder on "
          "another disk",
          folder_.string(), std::strerror(wrote < 0 ? errno : ENOSPC), end_ / 1'000'000));
    }
    done += static_cast<std::size_t>(wrote);
  }
  places_.push_back({end_, compact.size()});
  end_ += compact.size();
  return {};
}

core::Result<std::vector<std::uint8_t>> CloudSpool::read_compact(std::size_t index) const {
  const Place& place = places_.at(index);
  std::vector<std::uint8_t> bytes(place.size);
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t got =
        pread(descriptor_, bytes.data() + done, bytes.size() - done, static_cast<off_t>(place.offset + done));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) {
      return core::output_error(fmt::format("{}: the keyframes' clouds cannot be read back ({})",
                                            folder_.string(), got < 0 ? std::strerror(errno) : "truncated"));
    }
    done += static_cast<std::size_t>(got);
  }
  return bytes;
}

core::Result<CloudPtr> CloudSpool::read(std::size_t index) const {
  const auto bytes = read_compact(index);
  if (!bytes) return tl::unexpected<core::Error>(bytes.error());
  auto cloud = decode_cloud(bytes->data(), bytes->size());
  if (cloud) return cloud;
  return core::output_error(fmt::format("{}: {}", folder_.string(), cloud.error().message));
}

}  // namespace plumbline::cloud
