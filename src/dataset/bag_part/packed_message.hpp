// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Messages that rosbag2 compressed one by one: zstd frames instead of their bytes.
#include "bag_part/compression.hpp"

namespace plumbline::dataset {

/// The first bytes of a message, from those of its zstd frame; empty if it is damaged.
inline Bytes unpacked_head(const Bytes& packed) {
  Bytes head(kHeadBytes);
  head.resize(make_inflater(Compression::kZstd, packed.data(), packed.size())->get(head.data(), head.size()));
  return head;
}

/// The message itself, whether it is compressed or not; false when it is damaged.
inline bool unpack_message(Bytes& bytes) {
  if (!is_zstd(bytes.data(), bytes.size())) return true;
  Bytes plain;
  const bool good = inflate_all(Compression::kZstd, bytes.data(), bytes.size(), kMostMessageBytes, plain);
  bytes = std::move(plain);
  return good;
}

}  // namespace plumbline::dataset
