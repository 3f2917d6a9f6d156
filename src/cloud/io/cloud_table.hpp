// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Named columns of a file on their way into a cloud; what the readers of all formats have in common.
#include <cstdint>
#include <string>
#include <vector>

#include "plumbline/cloud/io/cloud_io.hpp"

namespace plumbline::cloud {

/// Meaning of a column of a file for a point.
enum class Meaning {
  kNone,
  kX,
  kY,
  kZ,
  kNormalX,
  kNormalY,
  kNormalZ,
  kRed,
  kGreen,
  kBlue,
  kPackedColor,
  kCurvature,
  kConfidence,
  kObservations,
  kRobot,
  kOther  ///< a number that is carried along
};

/// By the names in use: x y z, nx/normal_x, r/red/diffuse_red, rgb/rgba (packed), ...; case is ignored.
/// kNone: not kept, because alpha, padding or a name that could not be written again.
Meaning meaning_of(const std::string& name);

/// Takes values point by point.
class CloudBuilder {
 public:
  /// Meanings and names of the file's columns; prepares those that the cloud gets.
  CloudBuilder(const std::vector<Meaning>& meanings, const std::vector<std::string>& names,
               std::size_t points);
  /// Keeps the values of an axis as doubles until all are read; finish() then subtracts a shift.
  void keep_digits(Meaning axis);
  /// False when x, y or z is missing.
  [[nodiscard]] bool has_position() const { return position_; }
  /// `column`: of the file, needed for kOther.
  void set(std::size_t row, Meaning meaning, std::size_t column, double value);
  void set_packed_color(std::size_t row, std::uint32_t bits);
  void shape(std::uint32_t width, std::uint32_t height);
  [[nodiscard]] CloudFile finish();

 private:
  CloudFile file_;
  void take_shift();

  std::array<std::vector<double>, 3> wide_;  ///< of axes whose digits are kept
  std::vector<float*> others_;               ///< of each column of the file that is kOther, else null
  bool position_ = false;
};

core::Result<CloudFile> read_ply_cloud(const std::filesystem::path& file, LargeCoordinates large);
core::Result<CloudFile> read_pcd_cloud(const std::filesystem::path& file, LargeCoordinates large);
core::Result<CloudFile> read_text_cloud(const std::filesystem::path& file, LargeCoordinates large);

}  // namespace plumbline::cloud
