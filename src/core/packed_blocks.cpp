// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/core/packed_blocks.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <utility>

#include "plumbline/core/release.hpp"

namespace plumbline::core {
namespace {

/// Calls `transfer(done)` until `size` bytes have passed. False: it failed.
template <typename Transfer>
bool pass_all(std::size_t size, const Transfer& transfer) {
  for (std::size_t done = 0; done < size;) {
    const ssize_t n = transfer(done);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    done += static_cast<std::size_t>(n);
  }
  return true;
}

}  // namespace

PackedBlocks::PackedBlocks(PackedBlocks&& other) noexcept
    : file_(std::exchange(other.file_, -1)),
      end_(other.end_),
      bytes_(other.bytes_),
      places_(std::move(other.places_)) {}

PackedBlocks::~PackedBlocks() {
  if (file_ >= 0) ::close(file_);
}

void PackedBlocks::open(const std::filesystem::path& folder) {
  if (file_ < 0) file_ = ::open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
}

bool PackedBlocks::write(const Place& place) const {
  return file_ >= 0 && pass_all(place.size, [&](std::size_t done) {
           return ::pwrite(file_, place.packed.data() + done, place.size - done,
                           place.offset + static_cast<off_t>(done));
         });
}

std::size_t PackedBlocks::add(const Bytes& block) {
  // A block that cannot be written to disk stays in memory
  Place place{end_, 0, pack(block)};
  place.size = place.packed.size();
  bytes_ += place.size;
  if (write(place)) {
    end_ += static_cast<off_t>(place.size);
    release(place.packed);
  }
  places_.push_back(std::move(place));
  return places_.size() - 1;
}

std::optional<Bytes> PackedBlocks::get(std::size_t number) const {
  const Place& place = places_.at(number);

  // The disk had no room for this block
  if (!place.packed.empty()) return unpack(place.packed.data(), place.size);

  Bytes packed(place.size);
  const bool read = pass_all(place.size, [&](std::size_t done) {
    return ::pread(file_, packed.data() + done, place.size - done, place.offset + static_cast<off_t>(done));
  });
  if (!read) return std::nullopt;
  return unpack(packed.data(), packed.size());
}

}  // namespace plumbline::core
