// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/maps/pose_samples.hpp"

#include <fmt/format.h>

#include <cstring>
#include <fstream>
#include <string>

#include "plumbline/core/output_file.hpp"

namespace plumbline::maps {
namespace {

constexpr std::size_t kHeader = 192;  // bytes, with NumPy's mark and the length of the text
constexpr std::size_t kMark = 10;

struct SamplesRecord {
  std::int32_t robot = 0;
  std::int32_t keyframe = 0;
  std::array<float, 6 * geometry::kPoseSamples> motion{};
};

/// The text of a header, as long as it has to be.
std::string samples_header(std::size_t count) {
  std::string text = fmt::format(
      "{{'descr': [('robot', '<i4'), ('keyframe', '<i4'), ('motion', '<f4', ({}, 6))], 'fortran_order': "
      "False, 'shape': ({},), }}",
      geometry::kPoseSamples, count);
  text.resize(kHeader - kMark - 1, ' ');
  text += '\n';
  const auto length = static_cast<std::uint16_t>(text.size());
  return std::string("\x93NUMPY\x01\x00", 8) + static_cast<char>(length & 0xFFU) +
         static_cast<char>(length >> 8U) + text;
}

}  // namespace

/// Fixed-size records of single precision behind a NumPy header.
core::Result<void> write_pose_samples(const std::filesystem::path& file,
                                      const std::vector<KeyframeSamples>& samples) {
  core::OutputFile out(file);
  out.write(samples_header(samples.size()));
  for (const KeyframeSamples& one : samples) {
    SamplesRecord record{one.keyframe.robot, one.keyframe.index, {}};
    for (std::size_t s = 0; s < one.in_camera.size(); ++s) {
      for (int k = 0; k < 6; ++k)
        record.motion[6 * s + static_cast<std::size_t>(k)] = static_cast<float>(one.in_camera[s][k]);
    }
    out.put(record);
  }
  return out.commit();
}

core::Result<std::vector<KeyframeSamples>> read_pose_samples(const std::filesystem::path& file) {
  // The header is checked last, with the count
  std::ifstream in(file, std::ios::binary);
  std::string header(kHeader, '\0');
  in.read(header.data(), kHeader);
  std::vector<KeyframeSamples> all;

  // Records until the end of the file
  for (SamplesRecord record; in.read(reinterpret_cast<char*>(&record), sizeof record);) {
    KeyframeSamples one{{record.robot, record.keyframe}, {}};
    for (std::size_t s = 0; s < one.in_camera.size(); ++s) {
      for (int k = 0; k < 6; ++k) one.in_camera[s][k] = record.motion[6 * s + static_cast<std::size_t>(k)];
    }
    all.push_back(one);
  }

  // A truncated record or a wrong count
  if (in.gcount() != 0 || header != samples_header(all.size())) {
    return core::input_error(
        fmt::format("{}: is damaged, or no file of {}; map again", file.string(), kPoseSamplesFile));
  }
  return all;
}

}  // namespace plumbline::maps
