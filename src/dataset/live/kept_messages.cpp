// SPDX-License-Identifier: BSD-3-Clause
#include "live/kept_messages.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <string>

namespace plumbline::dataset {

KeptMessages::~KeptMessages() {
  if (descriptor_ >= 0) close(descriptor_);
}

std::optional<KeptMessages::Spot> KeptMessages::add(const Bytes& bytes) {
  if (descriptor_ < 0) {
    std::error_code ignored;
    std::string name = (std::filesystem::temp_directory_path(ignored) / "plumbline_XXXXXX").string();
    descriptor_ = mkostemp(name.data(), O_CLOEXEC);
    if (descriptor_ < 0) return std::nullopt;
    unlink(name.c_str());
  }

  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t written =
        pwrite(descriptor_, bytes.data() + done, bytes.size() - done, static_cast<off_t>(end_ + done));
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return std::nullopt;
    done += static_cast<std::size_t>(written);
  }

  const Spot spot{end_, bytes.size()};
  end_ += bytes.size();
  return spot;
}

std::optional<Bytes> KeptMessages::read(const Spot& spot) const {
  Bytes bytes(spot.size);
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t got =
        pread(descriptor_, bytes.data() + done, bytes.size() - done, static_cast<off_t>(spot.at + done));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return std::nullopt;
    done += static_cast<std::size_t>(got);
  }
  return bytes;
}

}  // namespace plumbline::dataset
