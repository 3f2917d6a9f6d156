// SPDX-License-Identifier: BSD-3-Clause
#include "bags/rvl.hpp"

namespace plumbline::dataset {
namespace {

/// Numbers of groups of 3 bits, lowest first, each in a nibble whose upper bit says that another follows;
/// nibbles from the top of words of 32 bits.
class RvlNumbers {
 public:
  RvlNumbers(const std::uint8_t* data, std::size_t size) : data_(data), size_(size) {}

  std::uint32_t next() {
    // Three bits of a number, and one that continues it
    constexpr unsigned kMostBits = 32;
    std::uint32_t value = 0;
    for (unsigned bits = 0; bits < kMostBits; bits += 3) {
      const std::uint32_t nibble = next_nibble();
      value |= (nibble & 7U) << bits;
      if ((nibble & 8U) == 0) return value;
    }
    good_ = false;
    return 0;
  }
  [[nodiscard]] bool good() const { return good_; }

 private:
  std::uint32_t next_nibble() {
    constexpr unsigned kNibbles = 8;

    // A new word after eight nibbles
    if (left_ == 0) {
      if (size_ - at_ < sizeof(word_)) {
        good_ = false;
        return 0;
      }

      // The lowest byte comes first
      word_ = data_[at_] | static_cast<std::uint32_t>(data_[at_ + 1]) << 8 |
              static_cast<std::uint32_t>(data_[at_ + 2]) << 16 |
              static_cast<std::uint32_t>(data_[at_ + 3]) << 24;
      at_ += sizeof(word_);
      left_ = kNibbles;
    }

    // Nibbles, the highest first
    const std::uint32_t nibble = word_ >> 28;
    word_ <<= 4;
    --left_;
    return nibble;
  }

  const std::uint8_t* data_;
  std::size_t size_;
  std::size_t at_ = 0;
  std::uint32_t word_ = 0;
  unsigned left_ = 0;
  bool good_ = true;
};

}  // namespace

std::optional<std::vector<std::uint16_t>> decode_rvl(const std::uint8_t* data, std::size_t size,
                                                     std::size_t pixels) {
  std::vector<std::uint16_t> depths;
  RvlNumbers numbers(data, size);
  std::uint32_t previous = 0;
  while (depths.size() < pixels) {
    // A run of zeros comes before measured depths
    const std::uint32_t zeros = numbers.next();
    if (!numbers.good() || zeros > pixels - depths.size()) return std::nullopt;
    depths.insert(depths.end(), zeros, std::uint16_t{0});

    const std::uint32_t measured = numbers.next();
    if (!numbers.good() || measured > pixels - depths.size()) return std::nullopt;

    // Empty runs would never end
    if (zeros == 0 && measured == 0) return std::nullopt;

    // Depths are coded as differences
    for (std::uint32_t i = 0; i < measured; ++i) {
      const std::uint32_t coded = numbers.next();  // steps 0, -1, 1, -2 ... as 0, 1, 2, 3 ...
      previous += (coded >> 1) ^ (0U - (coded & 1U));
      depths.push_back(static_cast<std::uint16_t>(previous));
    }
    if (!numbers.good()) return std::nullopt;
  }
  return depths;
}

}  // namespace plumbline::dataset
