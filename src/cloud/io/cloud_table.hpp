// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Conversion of a file's named columns into a cloud, shared by the readers of all formats.
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "plumbline/cloud/io/cloud_io.hpp"

namespace plumbline::cloud {

/// Property of a point that a column of a file holds.
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
  kOther  ///< a number that is kept under its name
};

/// Meaning of a column by its name: x y z, nx/normal_x, r/red/diffuse_red, rgb/rgba (packed), ...; case is
/// ignored. kNone: not kept, because it is alpha or padding, or its name could not be written again.
Meaning meaning_of(const std::string& name);

/// Makes a cloud from values given point by point.
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
  void take_shift();

  CloudFile file_;
  std::array<std::vector<double>, 3> wide_;  ///< values of the axes whose digits are kept
  std::vector<float*> others_;               ///< values of each column of the file that is kOther, else null
  bool position_ = false;
};

core::Result<CloudFile> read_ply_cloud(const std::filesystem::path& file, LargeCoordinates large);
core::Result<CloudFile> read_pcd_cloud(const std::filesystem::path& file, LargeCoordinates large);
core::Result<CloudFile> read_text_cloud(const std::filesystem::path& file, LargeCoordinates large);

}  // namespace plumbline::cloud
