// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/core/packing.hpp"

#include <zstd.h>
#include <zstd_errors.h>

#include <algorithm>
#include <memory>

namespace plumbline::core {

Bytes pack(const Bytes& bytes) {
  const std::unique_ptr<ZSTD_CCtx, decltype(&ZSTD_freeCCtx)> context(ZSTD_createCCtx(), &ZSTD_freeCCtx);
  if (context == nullptr) throw std::bad_alloc();

  // The fastest level; a checksum detects damage
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_compressionLevel, 1);
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_checksumFlag, 1);
  Bytes packed(ZSTD_compressBound(bytes.size()));
  const std::size_t size =
      ZSTD_compress2(context.get(), packed.data(), packed.size(), bytes.data(), bytes.size());
  if (ZSTD_isError(size) != 0U) throw std::bad_alloc();  // the only way it can fail with room enough
  packed.resize(size);
  return packed;
}

Bytes unpack(const std::uint8_t* bytes, std::size_t size, std::size_t most_bytes) {
  const unsigned long long length = ZSTD_getFrameContentSize(bytes, size);
  // zstd packs at most about 2^17 times: for data that promise more, which are damaged, nothing is allocated.
  const unsigned long long most =
      std::min<unsigned long long>(most_bytes, static_cast<unsigned long long>(size) << 17U);
  if (length == ZSTD_CONTENTSIZE_UNKNOWN || length == ZSTD_CONTENTSIZE_ERROR || length > most) {
    throw BadBytes("its head is damaged");
  }
  Bytes content(static_cast<std::size_t>(length));
  const std::size_t got = ZSTD_decompress(content.data(), content.size(), bytes, size);
  if (ZSTD_getErrorCode(got) == ZSTD_error_memory_allocation) throw std::bad_alloc();
  if (ZSTD_isError(got) != 0U || got != content.size()) throw BadBytes("its bytes are truncated or damaged");
  return content;
}

}  // namespace plumbline::core
