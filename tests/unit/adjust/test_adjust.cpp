// SPDX-License-Identifier: BSD-3-Clause
// Collocation, and what was measured as text.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "plumbline/adjust/collocation.hpp"
#include "plumbline/adjust/control.hpp"

namespace plumbline::adjust {
namespace {

/// Numbers that differ, the same each time.
double number(int i, int j) { return std::sin(12.9898 * i + 78.233 * j); }

CollocationProblem problem(int count) {
  CollocationProblem p;
  p.r.resize(count);
  p.g.resize(count, 2);
  Eigen::MatrixXd root(count, count);
  for (int i = 0; i < count; ++i) {
    p.r(i) = number(i, 1);
    p.g.row(i) << number(i, 2), number(i, 3);
    for (int j = 0; j < count; ++j) root(i, j) = 0.3 * number(i, 4 + j);
    p.rows.push_back(1);
  }
  p.covariance = root * root.transpose() + 0.2 * Eigen::MatrixXd::Identity(count, count);
  p.prior_sigma = Eigen::VectorXd::Constant(2, 3.0);
  return p;
}

TEST(Collocation, ChecksEachObservationAgainstThePredictionOfAllOthers) {
  constexpr int kCount = 7;
  const CollocationProblem whole = problem(kCount);
  const CollocationSolution solved = solve_collocation(whole);
  for (int k = 0; k < kCount; ++k) {
    CollocationProblem rest = whole;
    rest.rows.pop_back();
    std::vector<int> kept;
    for (int i = 0; i < kCount; ++i) {
      if (i != k) kept.push_back(i);
    }
    rest.r = whole.r(kept).eval();
    rest.g = whole.g(kept, Eigen::all).eval();
    rest.covariance = whole.covariance(kept, kept).eval();
    const CollocationSolution without = solve_collocation(rest);
    const Eigen::RowVectorXd carried = whole.covariance(std::vector<int>{k}, kept);
    const double predicted = (whole.g.row(k) * without.q + carried * without.weights).value();
    EXPECT_NEAR(solved.checks[static_cast<std::size_t>(k)].difference(0), whole.r(k) - predicted, 1e-9);
  }
}

TEST(Control, ReadsLengthsWithUnitsAndRefusesOthers) {
  const auto length = length_of({"0,0,1", "3, 4, 1", "501 cm+-3mm"});
  ASSERT_TRUE(length.has_value()) << length.error().message;
  EXPECT_DOUBLE_EQ(length->length_m, 5.01);
  EXPECT_DOUBLE_EQ(length->sigma_m, 0.003);
  for (const char* wrong : {"", "-1m", "4.5 kg", "5m+-0", "five"})
    EXPECT_FALSE(length_of({"0,0,1", "3,4,1", wrong}).has_value()) << wrong;
  EXPECT_FALSE(length_of({"0,0", "3,4,1", "5m"}).has_value());
  EXPECT_FALSE(length_of({"0,0,0", "0,0,0.01", "5m"}).has_value());
  EXPECT_FALSE(pair_of(ControlKind::kPlumb, {"0,0,0", "1,0,0.1"}).has_value());
}

TEST(Control, ReadsTablesOfPointsAndNamesTheLineThatIsNone) {
  const auto file = std::filesystem::path(testing::TempDir()) / "control.csv";
  std::ofstream(file)
      << "name,x,y,z,E,N,H,sigma\nP1,1,2,3,500001,5400002,103,0.01\n\n4,5,6,500004,5400005,106\n";
  const auto points = read_points(file);
  ASSERT_TRUE(points.has_value()) << points.error().message;
  ASSERT_EQ(points->size(), 2U);
  EXPECT_EQ((*points)[0].name, "point P1");
  EXPECT_DOUBLE_EQ((*points)[0].sigma_m, 0.01);
  EXPECT_DOUBLE_EQ((*points)[1].world.x(), 500004.0);
  std::ofstream(file) << "P1,1,2,3,500001,5400002,103\nP2,1,2,3,500001,x,103\n";
  const auto wrong = read_points(file);
  ASSERT_FALSE(wrong.has_value());
  EXPECT_NE(wrong.error().message.find("control.csv:2: "), std::string::npos);
}

}  // namespace
}  // namespace plumbline::adjust
