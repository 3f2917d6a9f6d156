// SPDX-License-Identifier: BSD-3-Clause
#include "store_bytes.hpp"

#include <zstd.h>

#include <algorithm>
#include <memory>

namespace plumbline::maps {

namespace {

using Packer = std::unique_ptr<ZSTD_CCtx, decltype(&ZSTD_freeCCtx)>;

Packer packer(int level) {
  Packer context(ZSTD_createCCtx(), &ZSTD_freeCCtx);
  if (context == nullptr) throw std::bad_alloc();
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_compressionLevel, level);
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_checksumFlag, 1);
  return context;
}

void require_done(std::size_t code) {
  if (ZSTD_isError(code) != 0U) throw std::runtime_error(std::string("zstd: ") + ZSTD_getErrorName(code));
}

}  // namespace

Bytes pack(const Bytes& bytes) {
  constexpr int kLevel = 1;  // written while a tracker waits for the processor
  Bytes packed(ZSTD_compressBound(bytes.size()));
  const std::size_t size =
      ZSTD_compress2(packer(kLevel).get(), packed.data(), packed.size(), bytes.data(), bytes.size());
  require_done(size);
  packed.resize(size);
  return packed;
}

Bytes pack(const Bytes& bytes, const std::vector<std::size_t>& cuts) {
  constexpr int kLevel = 12;
  constexpr std::size_t kBlock = 64;  // bytes of a block's head and code at most, when nothing can be saved
  const Packer context = packer(kLevel);
  require_done(ZSTD_CCtx_setPledgedSrcSize(context.get(), bytes.size()));
  Bytes packed(ZSTD_compressBound(bytes.size()) + kBlock * (cuts.size() + 1));
  ZSTD_outBuffer to{packed.data(), packed.size(), 0};
  std::size_t from = 0;
  const auto take = [&](std::size_t end, ZSTD_EndDirective then) {
    ZSTD_inBuffer part{bytes.data() + from, end - from, 0};
    std::size_t left = 1;
    while (left != 0) {
      left = ZSTD_compressStream2(context.get(), &to, &part, then);
      require_done(left);
      if (left != 0 && to.pos == to.size) throw std::logic_error("pack: no room");
    }
    from = end;
  };
  for (const std::size_t cut : cuts) {
    if (cut > from && cut < bytes.size()) take(cut, ZSTD_e_flush);  // ends a block
  }
  take(bytes.size(), ZSTD_e_end);
  packed.resize(to.pos);
  return packed;
}

Bytes unpack(const std::uint8_t* bytes, std::size_t size, std::size_t most_bytes) {
  const unsigned long long length = ZSTD_getFrameContentSize(bytes, size);
  // zstd packs at most about 2^17 times: what promises more is damaged, and takes no memory.
  const unsigned long long most =
      std::min<unsigned long long>(most_bytes, static_cast<unsigned long long>(size) << 17U);
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
