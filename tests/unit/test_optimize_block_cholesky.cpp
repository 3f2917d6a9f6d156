// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cstring>
#include <set>

#include "block_cholesky.hpp"
#include "random_world.hpp"

namespace plumbline::optimize {
namespace {

using tests::Random;
using Pairs = std::vector<std::pair<int, int>>;

/// A chain with some shortcuts, as keyframes of a path that comes back.
Pairs chain_with_loops(int unknowns, int loops, Random& random) {
  std::set<std::pair<int, int>> pairs;
  for (int i = 1; i < unknowns; ++i) pairs.insert({i, i - 1});
  for (int i = 0; i < loops; ++i) {
    const int a = static_cast<int>(random.uniform(0, unknowns - 1e-9));
    const int b = static_cast<int>(random.uniform(0, unknowns - 1e-9));
    if (a != b) pairs.insert({std::max(a, b), std::min(a, b)});
  }
  return {pairs.begin(), pairs.end()};
}

struct System {
  Pairs places;
  Eigen::MatrixXd matrix;
  Eigen::VectorXd right;
};

/// Random blocks, and enough on the diagonal to be positive definite.
System random_system(int unknowns, const Pairs& pairs, Random& random) {
  System system;
  const std::vector<int> places = elimination_places(unknowns, pairs);
  system.matrix = Eigen::MatrixXd::Zero(6 * unknowns, 6 * unknowns);
  const auto fill = [&](int a, int b) {
    for (int i = 0; i < 6; ++i) {
      for (int j = 0; j < 6; ++j) {
        const double v = random.normal(1.0);
        system.matrix(6 * a + i, 6 * b + j) += v;
        system.matrix(6 * b + j, 6 * a + i) += v;
      }
    }
  };
  for (const auto& [a, b] : pairs) {
    const int pa = places[static_cast<std::size_t>(a)];
    const int pb = places[static_cast<std::size_t>(b)];
    system.places.emplace_back(pa, pb);
    fill(pa, pb);
  }
  for (int i = 0; i < unknowns; ++i) fill(i, i);
  const Eigen::VectorXd rows = system.matrix.cwiseAbs().rowwise().sum();
  system.matrix.diagonal() += rows;
  system.right = Eigen::VectorXd::NullaryExpr(6 * unknowns, [&] { return random.normal(1.0); });
  return system;
}

void fill(const System& system, BlockCholesky& cholesky) {
  cholesky.set_zero();
  const auto copy = [&](double* to, int row, int column) {
    Eigen::Map<Eigen::Matrix<double, 6, 6>>(to, 6, 6) = system.matrix.block<6, 6>(6 * row, 6 * column);
  };
  for (int i = 0; i < cholesky.size(); ++i) copy(cholesky.diagonal(i), i, i);
  for (const auto& [a, b] : system.places) {
    copy(cholesky.block(std::max(a, b), std::min(a, b)), std::max(a, b), std::min(a, b));
  }
}

TEST(BlockCholesky, SolvesWhatADenseFactorisationSolves) {
  Random random(1);
  for (const auto& [unknowns, loops] : {std::pair{1, 0}, {2, 0}, {7, 3}, {40, 15}, {90, 2000}}) {
    const System system = random_system(unknowns, chain_with_loops(unknowns, loops, random), random);
    BlockCholesky cholesky(unknowns, system.places, nullptr);
    for (int repeat = 0; repeat < 2; ++repeat) {  // the pattern serves again
      fill(system, cholesky);
      ASSERT_TRUE(cholesky.factor());
      Eigen::VectorXd x = system.right;
      cholesky.solve(x.data());
      const Eigen::VectorXd expected = system.matrix.llt().solve(system.right);
      EXPECT_LT((x - expected).norm(), 1e-10 * expected.norm()) << unknowns;
    }
  }
}

TEST(BlockCholesky, RowsListWhatMayBeFilled) {
  Random random(2);
  const System system = random_system(30, chain_with_loops(30, 20, random), random);
  BlockCholesky cholesky(30, system.places, nullptr);
  std::set<std::pair<int, int>> listed;
  for (int row = 0; row < 30; ++row) {
    int last = -1;
    for (const auto* entry = cholesky.row_begin(row); entry != cholesky.row_end(row); ++entry) {
      EXPECT_GT(entry->column, last);
      EXPECT_LT(entry->column, row);
      EXPECT_EQ(cholesky.block(entry->block), cholesky.block(row, entry->column));
      listed.insert({row, entry->column});
      last = entry->column;
    }
  }
  for (const auto& [a, b] : system.places) EXPECT_EQ(listed.count({std::max(a, b), std::min(a, b)}), 1U);
}

TEST(BlockCholesky, AChainFillsNothingIn) {
  Random random(3);
  const System system = random_system(200, chain_with_loops(200, 0, random), random);
  const BlockCholesky cholesky(200, system.places, nullptr);
  std::ptrdiff_t entries = 0;
  for (int row = 0; row < 200; ++row) entries += cholesky.row_end(row) - cholesky.row_begin(row);
  EXPECT_EQ(entries, 199);
}

TEST(BlockCholesky, WhatIsNotPositiveDefiniteIsTold) {
  Random random(4);
  System system = random_system(10, chain_with_loops(10, 5, random), random);
  BlockCholesky cholesky(10, system.places, nullptr);
  system.matrix(30, 30) = -1.0;
  fill(system, cholesky);
  EXPECT_FALSE(cholesky.factor());
  system.matrix(30, 30) = std::nan("");
  fill(system, cholesky);
  EXPECT_FALSE(cholesky.factor());
}

TEST(BlockCholesky, SameBytesForAnyNumberOfThreads) {
  Random random(5);
  const System system = random_system(120, chain_with_loops(120, 3000, random), random);
  Eigen::VectorXd reference;
  for (const int threads : {0, 1, 2, 3}) {
    const core::Executor executor(std::max(1, threads));
    core::Crew crew(&executor);
    BlockCholesky cholesky(120, system.places, threads > 0 ? &crew : nullptr);
    fill(system, cholesky);
    ASSERT_TRUE(cholesky.factor());
    Eigen::VectorXd x = system.right;
    cholesky.solve(x.data());
    if (threads == 0) reference = x;
    EXPECT_EQ(std::memcmp(x.data(), reference.data(), sizeof(double) * static_cast<std::size_t>(x.size())),
              0);
  }
}

}  // namespace
}  // namespace plumbline::optimize
