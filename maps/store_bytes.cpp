// SPDX-License-Identifier: BSD-3-Clause
#include "store_bytes.hpp"

#include <zstd.h>

#include <algorithm>
#include <memory>

namespace plumbline::maps {

Bytes pack(const Bytes& bytes) {
  constexpr int kLevel = 1;  // written while a tracker waits for the processor
  const std::unique_ptr<ZSTD_CCtx, decltype(&ZSTD_freeCCtx)> context(ZSTD_createCCtx(), &ZSTD_freeCCtx);
  if (context == nullptr) throw std::bad_alloc();
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_compressionLevel, kLevel);
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_checksumFlag, 1);
  Bytes packed(ZSTD_compressBound(bytes.size()));
  const std::size_t size =
      ZSTD_compress2(context.get(), packed.data(), packed.size(), bytes.data(), bytes.size());
  if (ZSTD_isError(size) != 0U) throw std::runtime_error(std::string("zstd: ") + ZSTD_getErrorName(size));
  packed.resize(size);
  return packed;
}

Bytes unpack(const std::uint8_t* bytes, std::size_t size) {
  const unsigned long long length = ZSTD_getFrameContentSize(bytes, size);
  // zstd packs at most about 2^17 times: what promises more is damaged, and takes no memory.
  const unsigned long long most =
      std::min<unsigned long long>(1ULL << 30U, static_cast<unsigned long long>(size) << 17U);
  if (length == ZSTD_CONTENTSIZE_UNKNOWN || length == ZSTD_CONTENTSIZE_ERROR || length > most) {
    throw BadBytes("its head is damaged");
  }
  Bytes content(static_cast<std::size_t>(length));
  const std::size_t got = ZSTD_decompress(content.data(), content.size(), bytes, size);
  if (ZSTD_isError(got) != 0U || got != content.size()) throw BadBytes("its bytes are truncated or damaged");
  return content;
}

std::uint64_t fingerprint(const Bytes& bytes) {
  // Words are mixed in one after another; multiplier and shifts of MurmurHash64A (public domain).
  constexpr std::uint64_t kMultiplier = 0xc6a4a7935bd1e995ULL;
  std::uint64_t hash = static_cast<std::uint64_t>(bytes.size()) * kMultiplier;
  for (std::size_t i = 0; i < bytes.size(); i += sizeof(std::uint64_t)) {
    std::uint64_t word = 0;
    std::memcpy(&word, bytes.data() + i, std::min(sizeof(word), bytes.size() - i));
    word *= kMultiplier;
    word ^= word >> 47U;
    word *= kMultiplier;
    hash = (hash ^ word) * kMultiplier;
  }
  hash ^= hash >> 47U;
  hash *= kMultiplier;
  return hash ^ hash >> 47U;
}

}  // namespace plumbline::maps
