// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <cstring>
#include <fstream>
#include <iterator>
#include <string>

#include "plumbline/core/output_file.hpp"
#include "plumbline/places/vocabulary.hpp"

namespace plumbline::places {
namespace {

constexpr char kMagic[8] = {'P', 'L', 'V', 'O', 'C', 'A', 'B', '\n'};
constexpr std::uint32_t kVersion = 1;
constexpr std::size_t kHead = sizeof kMagic + sizeof kVersion + sizeof(std::uint64_t);
constexpr std::size_t kNodeBytes = 4 + 2 + 1 + 1 + 8 + 8 + 32;

std::uint64_t fnv1a(const std::uint8_t* bytes, std::size_t count) {
  std::uint64_t hash = 0xcbf29ce484222325ULL;
  for (std::size_t i = 0; i < count; ++i) hash = (hash ^ bytes[i]) * 0x100000001b3ULL;
  return hash;
}

class Writer {
 public:
  template <typename T>
  void put(const T& value) {
    const auto* raw = reinterpret_cast<const std::uint8_t*>(&value);
    bytes.insert(bytes.end(), raw, raw + sizeof value);
  }
  std::vector<std::uint8_t> bytes;
};

/// The caller has made sure that there is enough to take.
class Reader {
 public:
  explicit Reader(const std::uint8_t* bytes) : next_(bytes) {}
  template <typename T>
  T take() {
    T value;
    std::memcpy(&value, next_, sizeof value);
    next_ += sizeof value;
    return value;
  }

 private:
  const std::uint8_t* next_;
};

}  // namespace

std::vector<std::uint8_t> Vocabulary::to_bytes() const {
  Writer body;
  body.put(static_cast<std::int32_t>(options_.branching));
  body.put(static_cast<std::int32_t>(options_.levels));
  body.put(static_cast<std::int32_t>(options_.split));
  body.put(static_cast<std::int32_t>(options_.iterations));
  body.put(static_cast<std::uint32_t>(fixed_ ? 1 : 0));
  body.put(static_cast<std::uint32_t>(nodes_.size()));
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    const Node& n = nodes_[i];
    body.put(n.first_child);
    body.put(n.children);
    body.put(n.level);
    body.put(static_cast<std::uint8_t>(n.kind));
    body.put(n.features);
    body.put(n.divide_at);
    body.put(centres_[i]);
  }
  Writer file;
  file.bytes.assign(std::begin(kMagic), std::end(kMagic));
  file.put(kVersion);
  file.put(fnv1a(body.bytes.data(), body.bytes.size()));
  file.bytes.insert(file.bytes.end(), body.bytes.begin(), body.bytes.end());
  return std::move(file.bytes);
}

core::Result<Vocabulary> Vocabulary::from_bytes(const std::vector<std::uint8_t>& bytes,
                                                const std::string& name) {
  constexpr std::size_t kOptions = 6 * 4;
  const auto damaged = [&](const char* what) {
    return core::input_error(
        fmt::format("{}: {}; train it again with `plumbline vocabulary train`", name, what));
  };
  if (bytes.size() < sizeof kMagic || std::memcmp(bytes.data(), kMagic, sizeof kMagic) != 0) {
    return damaged("is not a vocabulary");
  }
  if (bytes.size() < kHead + kOptions) return damaged("ends too early");
  Reader head(bytes.data() + sizeof kMagic);
  const auto version = head.take<std::uint32_t>();
  if (version != kVersion) {
    return damaged(fmt::format("has format version {}, this program knows {}", version, kVersion).c_str());
  }
  if (head.take<std::uint64_t>() != fnv1a(bytes.data() + kHead, bytes.size() - kHead)) {
    return damaged("is damaged (its checksum does not fit)");
  }
  Reader body(bytes.data() + kHead);
  VocabularyOptions options;
  options.branching = body.take<std::int32_t>();
  options.levels = body.take<std::int32_t>();
  options.split = body.take<std::int32_t>();
  options.iterations = body.take<std::int32_t>();
  Vocabulary vocabulary(options);
  vocabulary.fixed_ = body.take<std::uint32_t>() != 0;
  const auto count = body.take<std::uint32_t>();
  if (vocabulary.options_.branching != options.branching || options.levels < 1 || options.levels > 12 ||
      options.split < 1 || options.iterations < 1 || count < 2 ||
      bytes.size() != kHead + kOptions + count * kNodeBytes) {
    return damaged("holds impossible numbers");
  }
  vocabulary.nodes_.assign(count, {});
  vocabulary.centres_.assign(count, {});
  for (std::uint32_t i = 0; i < count; ++i) {
    Node& n = vocabulary.nodes_[i];
    n.first_child = body.take<Word>();
    n.children = body.take<std::int16_t>();
    n.level = body.take<std::int8_t>();
    n.kind = static_cast<Kind>(body.take<std::uint8_t>());
    n.features = body.take<std::int64_t>();
    n.divide_at = body.take<std::int64_t>();
    vocabulary.centres_[i] = body.take<features::Descriptor256>();
    const bool leaf = n.children == 0;
    // Children lie behind their parent, so that every way down ends.
    const bool shape =
        leaf || (n.children >= 2 && n.children <= options.branching && n.first_child > static_cast<Word>(i) &&
                 static_cast<std::int64_t>(n.first_child) + n.children <= static_cast<std::int64_t>(count));
    if (!shape || n.level < 0 || n.level > options.levels || n.features < 0 ||
        (i < 2 && static_cast<std::uint32_t>(n.kind) != i) || static_cast<int>(n.kind) > 1) {
      return damaged("holds a tree of impossible shape");
    }
  }
  return vocabulary;
}

core::Result<void> Vocabulary::write(const std::filesystem::path& file) const {
  core::OutputFile output(file);
  const std::vector<std::uint8_t> bytes = to_bytes();
  output.write(bytes.data(), bytes.size());
  return output.commit();
}

core::Result<Vocabulary> Vocabulary::read(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::vector<std::uint8_t> bytes;
  if (stream) bytes.assign(std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>());
  if (!stream || stream.bad()) {
    return core::input_error(file.string() + ": cannot be read; check the path and its rights");
  }
  return from_bytes(bytes, file.string());
}

}  // namespace plumbline::places
