// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Sparse Cholesky factorisation of symmetric positive definite matrices of 6x6 blocks, one block a pose. The
// pattern is analysed once, numbers may change as often as wanted. Every block is summed in one order: the
// same bytes for any number of threads. (T. A. Davis, Direct Methods for Sparse Linear Systems, SIAM 2006.)
#include <cstddef>
#include <utility>
#include <vector>

#include "plumbline/core/crew.hpp"

namespace plumbline::optimize {

/// An order of elimination that fills in little (approximate minimum degree): place of each unknown. Pairs
/// are those that share a block, each once, in any order.
std::vector<int> elimination_places(int unknowns, const std::vector<std::pair<int, int>>& pairs);

class BlockCholesky {
 public:
  static constexpr int kSize = 6;
  static constexpr std::size_t kBlock = 36;

  /// `pairs` as places. `crew` may be null: then the caller's thread does it all.
  BlockCholesky(int unknowns, const std::vector<std::pair<int, int>>& pairs, core::Crew* crew);

  [[nodiscard]] int size() const { return static_cast<int>(begin_.size()) - 1; }
  void set_zero();
  /// Column-major.
  [[nodiscard]] double* diagonal(int place) {
    return diagonal_.data() + kBlock * static_cast<std::size_t>(place);
  }

  /// A block below the diagonal that may be filled: its column, and where it is.
  struct RowEntry {
    int column;
    std::size_t block;
  };
  /// Those of one row, by column.
  [[nodiscard]] const RowEntry* row_begin(int row) const { return row_entries_.data() + row_begin_[at(row)]; }
  [[nodiscard]] const RowEntry* row_end(int row) const {
    return row_entries_.data() + row_begin_[at(row) + 1];
  }
  [[nodiscard]] double* block(std::size_t index) { return blocks_.data() + kBlock * index; }
  /// The block of two places that are a pair, row > column.
  [[nodiscard]] double* block(int row, int column);

  /// In place; false: the matrix is not positive definite.
  bool factor();
  /// After factor(): x <- A^-1 x, by place.
  void solve(double* x) const;

 private:
  static std::size_t at(int i) { return static_cast<std::size_t>(i); }
  void analyse(const std::vector<std::pair<int, int>>& pairs);
  void list_rows();
  void eliminate(int column, std::size_t first);

  core::Crew* crew_;
  std::vector<std::size_t> begin_;  ///< of each column, into rows_ and blocks_
  std::vector<int> rows_;           ///< of each column, below the diagonal, ascending
  std::vector<double> diagonal_;
  std::vector<double> blocks_;
  std::vector<std::size_t> row_begin_;
  std::vector<RowEntry> row_entries_;
};

}  // namespace plumbline::optimize
