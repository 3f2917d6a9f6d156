// SPDX-License-Identifier: BSD-3-Clause
#include "block_cholesky.hpp"

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>

#include "plumbline/core/clones.hpp"

namespace plumbline::optimize {
namespace {

constexpr int kSize = BlockCholesky::kSize;

/// c <- c - a b^T; all column-major.
inline void subtract_product(double* __restrict c, const double* __restrict a, const double* __restrict b) {
  for (int j = 0; j < kSize; ++j) {
    double sum[kSize];
    for (int i = 0; i < kSize; ++i) sum[i] = c[kSize * j + i];
    for (int k = 0; k < kSize; ++k) {
      const double factor = b[kSize * k + j];
      for (int i = 0; i < kSize; ++i) sum[i] -= a[kSize * k + i] * factor;
    }
    for (int i = 0; i < kSize; ++i) c[kSize * j + i] = sum[i];
  }
}

/// One column's blocks from `first` on, times each other, off the columns further right.
PLUMBLINE_CLONES
void subtract_outer(const int* rows, const double* blocks, std::size_t first, std::size_t count,
                    const int* target_rows, double* target_blocks, double* target_diagonal) {
  const double* a = blocks + BlockCholesky::kBlock * first;
  subtract_product(target_diagonal, a, a);
  for (std::size_t i = first + 1, t = 0; i < count; ++i, ++t) {
    while (target_rows[t] != rows[i]) ++t;  // what one column fills, its later columns have
    subtract_product(target_blocks + BlockCholesky::kBlock * t, blocks + BlockCholesky::kBlock * i, a);
  }
}

/// Lower triangle in place; false: not positive definite.
bool factor_block(double* a) {
  for (int j = 0; j < kSize; ++j) {
    double d = a[kSize * j + j];
    for (int k = 0; k < j; ++k) d -= a[kSize * k + j] * a[kSize * k + j];
    if (!(d > 0.0) || !std::isfinite(d)) return false;
    d = std::sqrt(d);
    a[kSize * j + j] = d;
    for (int i = j + 1; i < kSize; ++i) {
      double s = a[kSize * j + i];
      for (int k = 0; k < j; ++k) s -= a[kSize * k + i] * a[kSize * k + j];
      a[kSize * j + i] = s / d;
    }
  }
  return true;
}

/// x <- x L^-T for each of the column's blocks.
PLUMBLINE_CLONES
void divide(const double* lower, double* blocks, std::size_t count) {
  for (std::size_t n = 0; n < count; ++n) {
    double* x = blocks + BlockCholesky::kBlock * n;
    for (int j = 0; j < kSize; ++j) {
      for (int k = 0; k < j; ++k) {
        const double factor = lower[kSize * k + j];
        for (int i = 0; i < kSize; ++i) x[kSize * j + i] -= x[kSize * k + i] * factor;
      }
      const double pivot = lower[kSize * j + j];
      for (int i = 0; i < kSize; ++i) x[kSize * j + i] /= pivot;
    }
  }
}

}  // namespace

std::vector<int> elimination_places(int unknowns, const std::vector<std::pair<int, int>>& pairs) {
  std::vector<Eigen::Triplet<double>> entries;
  for (int i = 0; i < unknowns; ++i) entries.emplace_back(i, i, 1.0);
  for (const auto& [a, b] : pairs) entries.emplace_back(std::max(a, b), std::min(a, b), 1.0);
  Eigen::SparseMatrix<double> pattern(unknowns, unknowns);
  pattern.setFromTriplets(entries.begin(), entries.end());
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> order;  // order[place] = unknown
  Eigen::AMDOrdering<int>()(pattern.selfadjointView<Eigen::Lower>(), order);
  std::vector<int> places(static_cast<std::size_t>(unknowns));
  for (int place = 0; place < unknowns; ++place) {
    places[static_cast<std::size_t>(order.indices()[place])] = place;
  }
  return places;
}

BlockCholesky::BlockCholesky(int unknowns, const std::vector<std::pair<int, int>>& pairs, core::Crew* crew)
    : crew_(crew) {
  begin_.assign(at(unknowns) + 1, 0);
  analyse(pairs);
  list_rows();
  diagonal_.resize(kBlock * at(unknowns));
  blocks_.resize(kBlock * rows_.size());
}

/// A column fills what its own pairs fill and what the columns left of it that lead to it have filled.
void BlockCholesky::analyse(const std::vector<std::pair<int, int>>& pairs) {
  const int n = size();
  std::vector<std::vector<int>> columns(at(n));
  for (const auto& [a, b] : pairs) columns[at(std::min(a, b))].push_back(std::max(a, b));
  for (int j = 0; j < n; ++j) {
    std::vector<int>& column = columns[at(j)];
    std::sort(column.begin(), column.end());
    column.erase(std::unique(column.begin(), column.end()), column.end());
    begin_[at(j) + 1] = begin_[at(j)] + column.size();
    rows_.insert(rows_.end(), column.begin(), column.end());
    if (column.empty()) continue;
    std::vector<int>& parent = columns[at(column.front())];
    parent.insert(parent.end(), column.begin() + 1, column.end());
    column = {};
  }
}

void BlockCholesky::list_rows() {
  row_begin_.assign(begin_.size(), 0);
  for (const int row : rows_) ++row_begin_[at(row) + 1];
  for (std::size_t i = 1; i < row_begin_.size(); ++i) row_begin_[i] += row_begin_[i - 1];
  row_entries_.resize(rows_.size());
  std::vector<std::size_t> next(row_begin_.begin(), row_begin_.end() - 1);
  for (int j = 0; j < size(); ++j) {
    for (std::size_t i = begin_[at(j)]; i < begin_[at(j) + 1]; ++i)
      row_entries_[next[at(rows_[i])]++] = {j, i};
  }
}

void BlockCholesky::set_zero() {
  std::fill(diagonal_.begin(), diagonal_.end(), 0.0);
  std::fill(blocks_.begin(), blocks_.end(), 0.0);
}

double* BlockCholesky::block(int row, int column) {
  const auto first = rows_.begin() + static_cast<std::ptrdiff_t>(begin_[at(column)]);
  const auto last = rows_.begin() + static_cast<std::ptrdiff_t>(begin_[at(column) + 1]);
  return block(static_cast<std::size_t>(std::lower_bound(first, last, row) - rows_.begin()));
}

void BlockCholesky::eliminate(int column, std::size_t first) {
  const std::size_t begin = begin_[at(column)];
  const int target = rows_[begin + first];
  const std::size_t target_begin = begin_[at(target)];
  subtract_outer(rows_.data() + begin, block(begin), first, begin_[at(column) + 1] - begin,
                 rows_.data() + target_begin, block(target_begin), diagonal(target));
}

bool BlockCholesky::factor() {
  constexpr std::size_t kWorthSharing = 16;  // blocks in a column
  for (int j = 0; j < size(); ++j) {
    const std::size_t begin = begin_[at(j)];
    const std::size_t count = begin_[at(j) + 1] - begin;
    if (!factor_block(diagonal(j))) return false;
    divide(diagonal(j), block(begin), count);
    if (crew_ != nullptr && count >= kWorthSharing) {
      crew_->each(count, 1, [&](std::size_t i) { eliminate(j, i); });
    } else {
      for (std::size_t i = 0; i < count; ++i) eliminate(j, i);
    }
  }
  return true;
}

void BlockCholesky::solve(double* x) const {
  const auto lower = [&](int j) { return diagonal_.data() + kBlock * at(j); };
  for (int j = 0; j < size(); ++j) {
    double* y = x + kSize * at(j);
    const double* l = lower(j);
    for (int k = 0; k < kSize; ++k) {
      y[k] /= l[kSize * k + k];
      for (int i = k + 1; i < kSize; ++i) y[i] -= l[kSize * k + i] * y[k];
    }
    for (std::size_t n = begin_[at(j)]; n < begin_[at(j) + 1]; ++n) {
      double* z = x + kSize * at(rows_[n]);
      const double* b = blocks_.data() + kBlock * n;
      for (int k = 0; k < kSize; ++k) {
        for (int i = 0; i < kSize; ++i) z[i] -= b[kSize * k + i] * y[k];
      }
    }
  }
  for (int j = size() - 1; j >= 0; --j) {
    double* y = x + kSize * at(j);
    for (std::size_t n = begin_[at(j)]; n < begin_[at(j) + 1]; ++n) {
      const double* z = x + kSize * at(rows_[n]);
      const double* b = blocks_.data() + kBlock * n;
      for (int k = 0; k < kSize; ++k) {
        double sum = 0.0;
        for (int i = 0; i < kSize; ++i) sum += b[kSize * k + i] * z[i];
        y[k] -= sum;
      }
    }
    const double* l = lower(j);
    for (int k = kSize - 1; k >= 0; --k) {
      for (int i = k + 1; i < kSize; ++i) y[k] -= l[kSize * k + i] * y[i];
      y[k] /= l[kSize * k + k];
    }
  }
}

}  // namespace plumbline::optimize
