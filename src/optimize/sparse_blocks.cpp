// SPDX-License-Identifier: BSD-3-Clause
#include "sparse_blocks.hpp"

#include <Eigen/SparseCholesky>
#include <algorithm>

namespace plumbline::optimize {
namespace {

using geometry::Matrix6d;
using Sparse = Eigen::SparseMatrix<double>;

/// P A P^T = L L^T, with a permutation P that keeps L sparse.
class Factor : public Eigen::SimplicialLLT<Sparse, Eigen::Upper> {
 public:
  /// Numbers in L, once the pattern is analysed.
  [[nodiscard]] std::size_t numbers() const { return static_cast<std::size_t>(m_matrix.nonZeros()); }
  [[nodiscard]] const Sparse& l() const { return m_matrix; }
  [[nodiscard]] int permuted(Eigen::Index i) const { return permutationP().indices()(i); }
};

/// The upper triangle: its columns are the rows of the lower one.
Sparse upper_triangle(const std::vector<std::map<int, Matrix6d>>& rows) {
  const auto size = static_cast<Eigen::Index>(6 * rows.size());
  std::size_t blocks = 0;
  for (const auto& row : rows) blocks += row.size();
  Sparse upper(size, size);
  upper.reserve(static_cast<Eigen::Index>(36 * blocks));

  // Eigen takes the entries column by column
  for (std::size_t r = 0; r < rows.size(); ++r) {
    for (int i = 0; i < 6; ++i) {
      const int column = 6 * static_cast<int>(r) + i;
      upper.startVec(column);
      for (const auto& [c, block] : rows[r]) {
        for (int j = 0; j < 6 && 6 * c + j <= column; ++j) upper.insertBack(6 * c + j, column) = block(i, j);
      }
    }
  }

  upper.finalize();
  return upper;
}

/// Entries of the inverse where L has any, at L's positions, from the last column to the first (Takahashi,
/// Fagan, Chen, 1973): an entry depends on later columns only, where L has entries as well.
std::vector<double> selected_inverse(const Sparse& l) {
  const int* begin = l.outerIndexPtr();
  const int* row = l.innerIndexPtr();
  const double* value = l.valuePtr();
  std::vector<double> inverse(static_cast<std::size_t>(l.nonZeros()));
  std::vector<int> place(static_cast<std::size_t>(l.rows()), -1);  // of a row in the present column
  std::vector<double> sums;

  for (int column = static_cast<int>(l.cols()) - 1; column >= 0; --column) {
    const int diagonal = begin[column];
    const int end = begin[column + 1];
    for (int p = diagonal + 1; p < end; ++p) place[static_cast<std::size_t>(row[p])] = p - diagonal;
    sums.assign(static_cast<std::size_t>(end - diagonal), 0.0);

    // The inverse of the rows below the diagonal, times the column.
    for (int p = diagonal + 1; p < end; ++p) {
      const int k = row[p];
      double& own = sums[static_cast<std::size_t>(p - diagonal)];
      own += value[p] * inverse[static_cast<std::size_t>(begin[k])];
      for (int q = begin[k] + 1; q < begin[k + 1]; ++q) {
        const int other = place[static_cast<std::size_t>(row[q])];
        if (other < 0) continue;
        sums[static_cast<std::size_t>(other)] += value[p] * inverse[static_cast<std::size_t>(q)];
        own += value[diagonal + other] * inverse[static_cast<std::size_t>(q)];
      }
    }

    // Entries below the diagonal, then the diagonal
    double rest = 1.0 / value[diagonal];
    for (int p = diagonal + 1; p < end; ++p) {
      place[static_cast<std::size_t>(row[p])] = -1;
      const double entry = -sums[static_cast<std::size_t>(p - diagonal)] / value[diagonal];
      inverse[static_cast<std::size_t>(p)] = entry;
      rest -= value[p] * entry;
    }
    inverse[static_cast<std::size_t>(diagonal)] = rest / value[diagonal];
  }

  return inverse;
}

}  // namespace

void SparseBlocks::clear() {
  for (auto& row : rows_) row.clear();
}

double* SparseBlocks::block(int row, int column) {
  return rows_[static_cast<std::size_t>(row)].try_emplace(column, Matrix6d::Zero()).first->second.data();
}

bool SparseBlocks::solve(Eigen::VectorXd& right_side) const {
  Factor factor;
  factor.compute(upper_triangle(rows_));
  if (factor.info() != Eigen::Success) return false;
  right_side = factor.solve(right_side).eval();
  return true;
}

std::size_t SparseBlocks::factor_numbers() const {
  Factor factor;
  factor.analyzePattern(upper_triangle(rows_));
  return factor.numbers();
}

std::vector<Matrix6d> SparseBlocks::inverse_blocks() const {
  Factor factor;
  factor.compute(upper_triangle(rows_));
  if (factor.info() != Eigen::Success) return {};

  // Only entries where the factor is not zero
  const Sparse& l = factor.l();
  const std::vector<double> inverse = selected_inverse(l);
  const auto entry = [&](int a, int b) {
    const int column = std::min(a, b);
    const int* first = l.innerIndexPtr() + l.outerIndexPtr()[column];
    const int* last = l.innerIndexPtr() + l.outerIndexPtr()[column + 1];
    return inverse[static_cast<std::size_t>(std::lower_bound(first, last, std::max(a, b)) -
                                            l.innerIndexPtr())];
  };

  // Back in the order of the poses
  std::vector<Matrix6d> blocks(rows_.size());
  for (std::size_t slot = 0; slot < blocks.size(); ++slot) {
    const auto at = [&](int i) { return factor.permuted(static_cast<Eigen::Index>(6 * slot) + i); };
    for (int i = 0; i < 6; ++i) {
      for (int j = 0; j < 6; ++j) blocks[slot](i, j) = entry(at(i), at(j));
    }
  }
  return blocks;
}

}  // namespace plumbline::optimize
