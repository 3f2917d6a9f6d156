// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Normal equations of many poses, few of which share landmarks: a symmetric matrix of 6x6 blocks, most of
// them zero.
#include <map>
#include <vector>

#include "plumbline/geometry/rigid3.hpp"

namespace plumbline::optimize {

class SparseBlocks {
 public:
  explicit SparseBlocks(int rows) : rows_(static_cast<std::size_t>(rows)) {}

  void clear();
  /// First element of a block of the lower triangle (column by column), which stays where it is; a block that
  /// is new is zero.
  [[nodiscard]] double* block(int row, int column);

  /// Solves for a right side, in its place; false if the matrix is not positive definite.
  [[nodiscard]] bool solve(Eigen::VectorXd& right_side) const;
  /// Numbers in the matrix's factor: memory grows with them.
  [[nodiscard]] std::size_t factor_numbers() const;
  /// Diagonal blocks of the inverse; empty if the matrix is not positive definite.
  [[nodiscard]] std::vector<geometry::Matrix6d> inverse_blocks() const;

 private:
  std::vector<std::map<int, geometry::Matrix6d>> rows_;  ///< by column
};

}  // namespace plumbline::optimize
