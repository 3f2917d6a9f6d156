// SPDX-License-Identifier: BSD-3-Clause
// Things as bytes and back, and bytes that are no things.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <limits>
#include <map>
#include <random>

#include "plumbline/core/packing.hpp"

namespace plumbline::core {
namespace {

struct Part {
  std::int32_t number = 0;
  std::string name;
};
template <typename Io>
void fields(Io& io, Part& part) {
  io(part.number, part.name);
}

struct Whole {
  bool flag = false;
  std::optional<double> there, not_there;
  KeyframeId id;
  Eigen::Matrix<float, 2, 3> matrix = Eigen::Matrix<float, 2, 3>::Zero();
  std::array<std::uint64_t, 2> words{};
  std::vector<Part> parts;
  std::map<std::int32_t, Part> by_number;
};
template <typename Io>
void fields(Io& io, Whole& whole) {
  io(whole.flag, whole.there, whole.not_there, whole.id, whole.matrix, whole.words, whole.parts,
     whole.by_number);
}

Bytes bytes_of_one() {
  Whole whole;
  whole.flag = true;
  whole.there = -0.0;
  whole.id = {3, 7};
  whole.matrix << 1, 2, 3, 4, 5, 6;
  whole.words = {1, std::numeric_limits<std::uint64_t>::max()};
  whole.parts = {{-1, "ä"}, {2, ""}};
  whole.by_number = {{7, {7, "seven"}}, {-3, {}}};
  return encoded(whole);
}

TEST(Archive, GivesBackWhatItWasGiven) {
  const auto back = decode<Whole>(bytes_of_one());
  EXPECT_TRUE(back.flag);
  EXPECT_TRUE(std::signbit(*back.there));
  EXPECT_FALSE(back.not_there);
  EXPECT_EQ(back.id, (KeyframeId{3, 7}));
  EXPECT_EQ(back.matrix(1, 0), 4.0F);
  EXPECT_EQ(back.words[1], std::numeric_limits<std::uint64_t>::max());
  ASSERT_EQ(back.parts.size(), 2U);
  EXPECT_EQ(back.parts[0].name, "ä");
  ASSERT_EQ(back.by_number.size(), 2U);
  EXPECT_EQ(back.by_number.at(7).name, "seven");
  ByteWriter number;
  encode(std::uint32_t{0x01020304}, number);
  EXPECT_EQ(number.bytes(), (Bytes{4, 3, 2, 1})) << "little-endian whatever the machine";
}

TEST(Archive, ThrowsOnOtherBytes) {
  const Bytes good = bytes_of_one();
  for (std::size_t size = 0; size < good.size(); ++size) {
    const Bytes cut(good.begin(), good.begin() + static_cast<std::ptrdiff_t>(size));
    EXPECT_THROW(decode<Whole>(cut), BadBytes) << size;
  }
  Bytes more = good;
  more.push_back(0);
  EXPECT_THROW(decode<Whole>(more), BadBytes);
  Bytes flag = good;
  flag.front() = 2;
  EXPECT_THROW(decode<Whole>(flag), BadBytes);
  ByteWriter promise;
  encode(std::numeric_limits<std::uint64_t>::max(), promise);
  EXPECT_THROW(decode<std::vector<Part>>(promise.bytes()), BadBytes) << "and takes no memory";
  std::mt19937 random(3);
  for (int trial = 0; trial < 2000; ++trial) {
    Bytes damaged = good;
    damaged[random() % damaged.size()] = static_cast<std::uint8_t>(random());
    try {
      (void)decode<Whole>(damaged);
    } catch (const BadBytes&) {
    }
  }
}

TEST(Archive, PlanesKeepTheLowestBytes) {
  const std::vector<std::uint32_t> values{0x010203, 0x040506};
  ByteWriter writer;
  writer.planes<3>(values.data(), values.size());
  EXPECT_EQ(writer.bytes(), (Bytes{3, 6, 2, 5, 1, 4}));
  ByteReader reader(writer.bytes());
  std::vector<std::uint32_t> back(2);
  reader.planes<3>(back.data(), back.size());
  EXPECT_EQ(back, values);
  EXPECT_TRUE(reader.at_end());
}

TEST(Packing, GivesBackAndRefuses) {
  const Bytes plain(1000, 7);
  const Bytes packed = pack(plain);
  EXPECT_LT(packed.size(), 100U);
  EXPECT_EQ(unpack(packed.data(), packed.size()), plain);
  EXPECT_THROW(unpack(packed.data(), packed.size(), 999), BadBytes);
  EXPECT_THROW(unpack(packed.data(), packed.size() - 1), BadBytes);
  Bytes damaged = packed;
  damaged.back() ^= 1U;
  EXPECT_THROW(unpack(damaged.data(), damaged.size()), BadBytes) << "its checksum is wrong";
}

}  // namespace
}  // namespace plumbline::core
