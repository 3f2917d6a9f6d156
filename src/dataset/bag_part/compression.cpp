// SPDX-License-Identifier: BSD-3-Clause
#include "bag_part/compression.hpp"

#include <bzlib.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <lz4frame.h>
#include <unistd.h>
#include <zstd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <utility>
#include <vector>

#include "plumbline/core/shortage.hpp"

namespace plumbline::dataset {
namespace {

class CopyInflater final : public Inflater {
 public:
  CopyInflater(const std::uint8_t* data, std::size_t size) : data_(data), size_(size) {}
  std::size_t get(std::uint8_t* to, std::size_t size) override {
    const std::size_t count = std::min(size, size_);
    std::memcpy(to, data_, count);
    data_ += count;
    size_ -= count;
    return count;
  }

 private:
  const std::uint8_t* data_;
  std::size_t size_;
};

class ZstdInflater final : public Inflater {
 public:
  ZstdInflater(const std::uint8_t* data, std::size_t size) : input_{data, size, 0} {
    ZSTD_DCtx_setParameter(context_.get(), ZSTD_d_windowLogMax, kMostWindowLog);
  }
  std::size_t get(std::uint8_t* to, std::size_t size) override {
    ZSTD_outBuffer output{to, size, 0};
    while (output.pos < output.size && !damaged_) {
      const std::size_t read = input_.pos;
      const std::size_t written = output.pos;
      const std::size_t left = ZSTD_decompressStream(context_.get(), &output, &input_);

      // Without progress the data are damaged or cut
      damaged_ = ZSTD_isError(left) != 0 || (input_.pos == read && output.pos == written);
    }
    return output.pos;
  }

 private:
  static constexpr int kMostWindowLog = 27;  // 128 MB, as zstd's own program allows
  struct Free {
    void operator()(ZSTD_DCtx* context) const { ZSTD_freeDCtx(context); }
  };
  std::unique_ptr<ZSTD_DCtx, Free> context_{core::made(ZSTD_createDCtx())};
  ZSTD_inBuffer input_;
  bool damaged_ = false;
};

class Lz4Inflater final : public Inflater {
 public:
  Lz4Inflater(const std::uint8_t* data, std::size_t size) : data_(data), size_(size) {
    LZ4F_dctx* context = nullptr;
    if (LZ4F_isError(LZ4F_createDecompressionContext(&context, LZ4F_VERSION)) != 0U) context = nullptr;
    context_.reset(core::made(context));
  }
  std::size_t get(std::uint8_t* to, std::size_t size) override {
    std::size_t done = 0;
    while (done < size && !damaged_) {
      std::size_t written = size - done;
      std::size_t read = size_;
      const std::size_t hint = LZ4F_decompress(context_.get(), to + done, &written, data_, &read, nullptr);

      // Without progress the data are damaged or cut
      damaged_ = LZ4F_isError(hint) != 0U || (read == 0 && written == 0);
      if (LZ4F_isError(hint) != 0U) break;
      data_ += read;
      size_ -= read;
      done += written;
    }
    return done;
  }

 private:
  struct Free {
    void operator()(LZ4F_dctx* context) const { LZ4F_freeDecompressionContext(context); }
  };
  std::unique_ptr<LZ4F_dctx, Free> context_;
  const std::uint8_t* data_;
  std::size_t size_;
  bool damaged_ = false;
};

class Bzip2Inflater final : public Inflater {
 public:
  Bzip2Inflater(const std::uint8_t* data, std::size_t size) : left_(size) {
    stream_.next_in = const_cast<char*>(reinterpret_cast<const char*>(data));
    if (BZ2_bzDecompressInit(&stream_, 0, 0) != BZ_OK) throw std::bad_alloc();  // the only way it can fail
  }
  ~Bzip2Inflater() override { BZ2_bzDecompressEnd(&stream_); }
  Bzip2Inflater(const Bzip2Inflater&) = delete;
  Bzip2Inflater& operator=(const Bzip2Inflater&) = delete;
  std::size_t get(std::uint8_t* to, std::size_t size) override {
    constexpr std::size_t kStep = std::size_t{1} << 20;
    std::size_t done = 0;
    while (done < size && !damaged_) {
      const auto room = static_cast<unsigned>(std::min(kStep, size - done));
      const auto fed = static_cast<unsigned>(std::min(kStep, left_));

      // bzip2 counts down the bytes of both buffers
      stream_.next_out = reinterpret_cast<char*>(to + done);
      stream_.avail_out = room;
      stream_.avail_in = fed;
      const int state = BZ2_bzDecompress(&stream_);
      const std::size_t read = fed - stream_.avail_in;
      const std::size_t written = room - stream_.avail_out;
      left_ -= read;
      done += written;

      // Without progress the data are damaged or cut
      damaged_ = state != BZ_OK || (read == 0 && written == 0);
    }
    return done;
  }

 private:
  bz_stream stream_{};
  std::size_t left_;
  bool damaged_ = false;
};

/// True if all bytes are written; one call may write only a part.
bool write_all(int descriptor, const char* from, std::size_t size) {
  while (size > 0) {
    const ssize_t written = ::write(descriptor, from, size);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    from += written;
    size -= static_cast<std::size_t>(written);
  }
  return true;
}

}  // namespace

std::unique_ptr<Inflater> make_inflater(Compression compression, const std::uint8_t* data, std::size_t size) {
  if (compression == Compression::kZstd) return std::make_unique<ZstdInflater>(data, size);
  if (compression == Compression::kLz4) return std::make_unique<Lz4Inflater>(data, size);
  if (compression == Compression::kBzip2) return std::make_unique<Bzip2Inflater>(data, size);
  return std::make_unique<CopyInflater>(data, size);
}

bool inflate_all(Compression compression, const std::uint8_t* data, std::size_t size, std::uint64_t most,
                 Bytes& to) {
  constexpr std::size_t kFirstStep = std::size_t{1} << 16;
  const auto inflater = make_inflater(compression, data, size);
  to.clear();

  // Growing steps, because the promised size may be wrong
  for (std::size_t step = kFirstStep;; step *= 2) {
    const std::size_t before = to.size();
    const std::size_t wanted = static_cast<std::size_t>(std::min<std::uint64_t>(step, most + 1 - before));
    to.resize(before + wanted);
    const std::size_t got = inflater->get(to.data() + before, wanted);
    to.resize(before + got);
    if (to.size() > most) break;
    if (got < wanted) return !to.empty();
  }
  to.clear();
  return false;
}

bool is_zstd(const std::uint8_t* data, std::size_t size) {
  constexpr std::uint8_t kMagic[] = {0x28, 0xB5, 0x2F, 0xFD};
  return size >= sizeof(kMagic) && std::memcmp(data, kMagic, sizeof(kMagic)) == 0;
}

TemporaryFile::~TemporaryFile() {
  take_name_away();
  if (descriptor_ >= 0) close(descriptor_);
}

TemporaryFile::TemporaryFile(TemporaryFile&& other) noexcept
    : path_(std::exchange(other.path_, {})), descriptor_(std::exchange(other.descriptor_, -1)) {}

TemporaryFile& TemporaryFile::operator=(TemporaryFile&& other) noexcept {
  std::swap(path_, other.path_);
  std::swap(descriptor_, other.descriptor_);
  return *this;
}

void TemporaryFile::take_name_away() {
  if (!path_.empty()) unlink(path_.c_str());
  path_.clear();
}

core::Result<TemporaryFile> TemporaryFile::inflated(const std::filesystem::path& file, bool& cut) {
  std::error_code ignored;
  std::string name = (std::filesystem::temp_directory_path(ignored) / "plumbline_XXXXXX").string();
  TemporaryFile target;
  target.descriptor_ = mkostemp(name.data(), O_CLOEXEC);

  if (target.descriptor_ < 0) {
    return core::output_error(fmt::format("{}: no temporary file for what is compressed in it: {}",
                                          file.string(), std::strerror(errno)));
  }
  target.path_ = name;

  // In steps, because the bag may exceed the memory
  std::ifstream stream(file, std::ios::binary);
  std::vector<char> packed(ZSTD_DStreamInSize());
  std::vector<char> plain(ZSTD_DStreamOutSize());
  const std::unique_ptr<ZSTD_DCtx, std::size_t (*)(ZSTD_DCtx*)> context(core::made(ZSTD_createDCtx()),
                                                                        &ZSTD_freeDCtx);
  std::size_t left = 1;
  cut = false;

  while (!cut &&
         (stream.read(packed.data(), static_cast<std::streamsize>(packed.size())), stream.gcount() > 0)) {
    ZSTD_inBuffer input{packed.data(), static_cast<std::size_t>(stream.gcount()), 0};

    // Full output may leave more of the same input
    bool full = false;
    while (!cut && (input.pos < input.size || full)) {
      ZSTD_outBuffer output{plain.data(), plain.size(), 0};
      left = ZSTD_decompressStream(context.get(), &output, &input);
      cut = ZSTD_isError(left) != 0;
      full = output.pos == output.size;

      // A full disk is not the bag's fault
      if (!write_all(target.descriptor_, plain.data(), output.pos)) {
        return core::output_error(
            fmt::format("{}: what is compressed in it does not fit into the folder of temporary files: {}; "
                        "unpack it with zstd -d",
                        file.string(), std::strerror(errno)));
      }
    }
  }

  // A frame without its end was cut off
  cut = cut || left != 0;
  return target;
}

}  // namespace plumbline::dataset
