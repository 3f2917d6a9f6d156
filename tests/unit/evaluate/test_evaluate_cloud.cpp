// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>

#include "evaluate_worlds.hpp"
#include "plumbline/evaluate/cloud.hpp"

namespace {

using namespace plumbline;
using namespace plumbline::evaluate;
using namespace plumbline::evaluate::worlds;

const core::Executor& two_threads() {
  static const core::Executor executor(2);
  return executor;
}

core::Result<CloudReport> run(const SurfaceSamples& cloud, const Reference& reference,
                              CloudOptions options = {}) {
  return evaluate_cloud(cloud, &reference, options, {}, two_threads());
}

SurfaceSamples without_normals(SurfaceSamples samples) {
  samples.normals.clear();
  return samples;
}

void expect_all_mm(const Statistics& s, double mm, double tolerance) {
  EXPECT_NEAR(s.mean, mm, tolerance);
  EXPECT_NEAR(s.median, mm, tolerance);
  EXPECT_NEAR(s.rmse, mm, tolerance);
  EXPECT_NEAR(s.p90, mm, tolerance);
  EXPECT_NEAR(s.max, mm, tolerance);
}

TEST(EvaluateCloud, IdenticalCloudsAreAtZero) {
  const SurfaceSamples room = box({1.0, 0.8, 0.6}, 0.02);
  const auto report = run(room, reference_of(room));
  ASSERT_TRUE(report) << report.error().message;
  expect_all_mm(report->accuracy_mm, 0.0, 0.0);
  expect_all_mm(report->completeness_mm, 0.0, 0.0);
  ASSERT_EQ(report->at.size(), 4U);
  for (const auto& score : report->at) {
    EXPECT_EQ(score.precision, 1.0);
    EXPECT_EQ(score.recall, 1.0);
    EXPECT_EQ(score.f, 1.0);
  }
  EXPECT_NEAR(report->normal_consistency.value(), 1.0, 1e-6);
  EXPECT_EQ(report->points, room.points.size());
  EXPECT_NEAR(report->spacing_mm, 20.0, 0.01);
  EXPECT_NEAR(report->density_per_m2, 2500.0, 100.0);
}

TEST(EvaluateCloud, ShiftedPlaneGivesItsShiftAgainstAMesh) {
  for (const double shift : {0.001, 0.010, 0.037}) {
    SCOPED_TRACE(shift);
    const auto report = run(plane(1.0, shift, 0.01), reference_of(square_mesh(1.0F)));
    ASSERT_TRUE(report) << report.error().message;
    expect_all_mm(report->accuracy_mm, 1000.0 * shift, 1e-3);
    EXPECT_NEAR(report->completeness_mm.median, 1000.0 * shift, 1e-3);
    EXPECT_NEAR(report->completeness_mm.mean, 1000.0 * shift,
                0.1);  // the mesh's border reaches half a cell further
  }
}

TEST(EvaluateCloud, SaysWhenCloudAndReferenceAreHardlyInOneFrame) {
  const auto apart = run(plane(1.0, 0.5, 0.01), reference_of(square_mesh(1.0F)));
  ASSERT_TRUE(apart);
  ASSERT_EQ(apart->warnings.size(), 1U);
  EXPECT_NE(apart->warnings[0].find("--align se3"), std::string::npos);
  const auto near = run(plane(1.0, 0.05, 0.01), reference_of(square_mesh(1.0F)));
  ASSERT_TRUE(near);
  EXPECT_TRUE(near->warnings.empty());
}

TEST(EvaluateCloud, ShiftedPlaneGivesItsShiftAgainstACloudSampledOtherwise) {
  const SurfaceSamples truth = plane(1.5, 0.0, 0.013);
  SurfaceSamples cloud;
  add_rectangle(cloud, {0.25, 0.25, 0.02}, {1, 0, 0}, {0, 1, 0}, 0.007);
  for (const bool normals : {true, false}) {
    const auto report = normals ? run(cloud, reference_of(truth))
                                : run(without_normals(cloud), reference_of(without_normals(truth)));
    ASSERT_TRUE(report) << report.error().message;
    expect_all_mm(report->accuracy_mm, 20.0, 1e-3);
    EXPECT_EQ(report->normal_consistency.has_value(), normals);
  }
  const auto back = run(truth, reference_of(cloud));
  EXPECT_NEAR(back->completeness_mm.median, 20.0, 1e-3);
  EXPECT_NEAR(back->completeness_mm.p90, 20.0, 1e-3);
}

TEST(EvaluateCloud, DensityOfRandomSamplesDoesNotEnter) {
  const SurfaceSamples truth = random_plane(1.2, 0.0, 12000, 1);
  SurfaceSamples cloud = random_plane(1.0, 0.005, 10000, 2);
  for (auto& p : cloud.points) p += Eigen::Vector3f(0.1F, 0.1F, 0.0F);
  const auto report = run(cloud, reference_of(truth));
  ASSERT_TRUE(report);
  EXPECT_NEAR(report->accuracy_mm.mean, 5.0, 0.05);
  EXPECT_NEAR(report->accuracy_mm.median, 5.0, 1e-3);
  CloudOptions options;
  options.distance = SampleDistance::kPoint;
  EXPECT_GT(run(cloud, reference_of(truth), options)->accuracy_mm.mean, 6.0);
}

TEST(EvaluateCloud, DistancesToAMeshAreThoseOfTheBox) {
  const Eigen::Vector3d size(1.0, 0.6, 0.4);
  Random random(12);
  SurfaceSamples cloud;
  for (int i = 0; i < 4000; ++i) {
    const Eigen::Vector3d p(3.0 * random() - 1.0, 2.0 * random() - 0.7, 1.6 * random() - 0.6);
    cloud.points.emplace_back(p.cast<float>());
  }
  const auto report = run(cloud, reference_of(box_mesh(size.cast<float>())));
  ASSERT_TRUE(report);
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    const Eigen::Vector3d p = cloud.points[i].cast<double>();
    const Eigen::Vector3d beyond = (p - size).cwiseMax(-p);  // > 0 outside
    const double expected = beyond.maxCoeff() > 0.0 ? beyond.cwiseMax(0.0).norm() : -beyond.maxCoeff();
    ASSERT_NEAR(report->error_m[i], expected, 1e-6) << i;
  }
}

TEST(EvaluateCloud, DistancesToPointsAreThoseOfASearchThroughAll) {
  Random random(13);
  SurfaceSamples cloud, truth;
  for (int i = 0; i < 700; ++i) {
    const double x = random(), y = random();
    cloud.points.emplace_back(Eigen::Vector3d(x, y, random()).cast<float>());
    truth.points.emplace_back(Eigen::Vector3d(2.0 * y, x, random()).cast<float>());
  }
  CloudOptions options;
  options.distance = SampleDistance::kPoint;
  const auto report = run(cloud, reference_of(truth), options);
  ASSERT_TRUE(report);
  const auto nearest = [](const Eigen::Vector3f& q, const SurfaceSamples& among) {
    float best = 1e9F;
    for (const auto& p : among.points) best = std::min(best, (p - q).norm());
    return best;
  };
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    ASSERT_NEAR(report->error_m[i], nearest(cloud.points[i], truth), 1e-6F);
    ASSERT_NEAR(report->reference_error_m[i], nearest(truth.points[i], cloud), 1e-6F);
  }
}

TEST(EvaluateCloud, ADistanceOnTheThresholdCounts) {
  const auto report = run(plane(0.5, 0.010, 0.01), reference_of(square_mesh(0.5F)));
  ASSERT_TRUE(report);
  EXPECT_EQ(report->at[0].precision, 0.0);
  EXPECT_EQ(report->at[0].f, 0.0);
  EXPECT_EQ(report->at[1].precision, 1.0);
  EXPECT_EQ(report->at[2].recall, 1.0);
}

TEST(EvaluateCloud, HalfACubeHasRecallOneHalf) {
  const SurfaceSamples cube = box({1.0, 1.0, 1.0}, 0.01);
  SurfaceSamples half;
  for (std::size_t i = 0; i < cube.points.size(); ++i) {
    if (cube.points[i].x() > 0.5F) continue;
    half.points.push_back(cube.points[i]);
    half.normals.push_back(cube.normals[i]);
  }
  const auto report = run(half, reference_of(cube));
  ASSERT_TRUE(report);
  expect_all_mm(report->accuracy_mm, 0.0, 1e-6);
  EXPECT_EQ(report->at[0].precision, 1.0);
  EXPECT_NEAR(report->at[0].recall, 0.5, 1e-3);
  EXPECT_NEAR(report->at[0].f, 2.0 / 3.0, 1e-3);
  EXPECT_NEAR(report->at[1].recall, 0.5, 0.01);  // one row of samples lies 10 mm past the cut
  const auto against_mesh = run(half, reference_of(box_mesh({1.0F, 1.0F, 1.0F})));
  EXPECT_NEAR(against_mesh->at[0].recall, 0.5, 0.01);
  EXPECT_NEAR(against_mesh->accuracy_mm.max, 0.0, 1e-4);
}

TEST(EvaluateCloud, AHoleIsNotBridged) {
  SurfaceSamples holed;
  const SurfaceSamples full = plane(1.0, 0.0, 0.01);
  for (std::size_t i = 0; i < full.points.size(); ++i) {
    if ((full.points[i].head<2>() - Eigen::Vector2f(0.5F, 0.5F)).norm() < 0.2F) continue;
    holed.points.push_back(full.points[i]);
    holed.normals.push_back(full.normals[i]);
  }
  const auto report = run(holed, reference_of(full));
  ASSERT_TRUE(report);
  EXPECT_NEAR(report->completeness_mm.max, 200.0, 15.0);
  EXPECT_NEAR(report->at[2].recall, 1.0 - 3.14159 * 0.18 * 0.18, 0.01);
}

TEST(EvaluateCloud, OnlyVisibleSamplesCount) {
  SurfaceSamples truth = plane(1.0, 0.0, 0.02);
  SurfaceSamples cloud;
  for (std::size_t i = 0; i < truth.points.size(); ++i) {
    const bool seen = truth.points[i].y() < 0.3F;
    truth.visible.push_back(seen ? 1 : 0);
    if (!seen) continue;
    cloud.points.push_back(truth.points[i]);
    cloud.normals.push_back(truth.normals[i]);
  }
  const auto report = run(cloud, reference_of(truth));
  ASSERT_TRUE(report);
  EXPECT_TRUE(report->visibility_used);
  EXPECT_EQ(report->at[0].recall, 1.0);
  EXPECT_EQ(report->reference_points, cloud.points.size());
  EXPECT_EQ(report->reference_points + report->reference_hidden, truth.points.size());
  CloudOptions all;
  all.visible_only = false;
  EXPECT_NEAR(run(cloud, reference_of(truth), all)->at[0].recall, 0.3, 1e-6);
  truth.visible.assign(truth.points.size(), 0);
  EXPECT_EQ(run(cloud, reference_of(truth)).error().kind, core::ErrorKind::kInput);
}

TEST(EvaluateCloud, NormalConsistencyOfTurnedNormals) {
  const SurfaceSamples truth = plane(0.6, 0.0, 0.01);
  SurfaceSamples cloud = truth;
  for (auto& n : cloud.normals)
    n = Eigen::Vector3f(std::sin(0.5F), 0.0F, -std::cos(0.5F));  // the sign is free
  EXPECT_NEAR(run(cloud, reference_of(truth))->normal_consistency.value(), std::cos(0.5), 1e-5);
}

TEST(EvaluateCloud, NormalsThatDoNotFitThePointsAreNotUsed) {
  const SurfaceSamples truth = plane(0.6, 0.0, 0.01);
  SurfaceSamples cloud = plane(0.6, 0.005, 0.01);
  for (auto& n : cloud.normals) n = Eigen::Vector3f::UnitX();
  const auto report = run(cloud, reference_of(truth));
  ASSERT_TRUE(report);
  EXPECT_NEAR(report->completeness_mm.mean, 5.0, 1e-3);
  EXPECT_FALSE(report->normal_consistency);
  EXPECT_FALSE(report->warnings.empty());
}

TEST(EvaluateCloud, NanPointsOfTheCloudAreCountedAndLeftOut) {
  SurfaceSamples cloud = plane(0.5, 0.01, 0.01);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  cloud.points[3].y() = nan;
  cloud.points[40].x() = std::numeric_limits<float>::infinity();
  cloud.normals[50] = Eigen::Vector3f(nan, nan, nan);
  const auto report = run(cloud, reference_of(square_mesh(0.5F)));
  ASSERT_TRUE(report);
  EXPECT_EQ(report->not_finite, 2U);
  EXPECT_EQ(report->points, cloud.points.size() - 2);
  EXPECT_NEAR(report->accuracy_mm.max, 10.0, 1e-3);
  ASSERT_EQ(report->error_m.size(), cloud.points.size());
  EXPECT_TRUE(std::isnan(report->error_m[3]));
  EXPECT_TRUE(std::isnan(report->error_m[40]));
  EXPECT_NEAR(report->error_m[50], 0.01F, 1e-6F);
}

TEST(EvaluateCloud, RefusesWhatCannotBeMeasured) {
  const SurfaceSamples good = plane(0.5, 0.0, 0.05);
  SurfaceSamples nan = good;
  nan.points[7].z() = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(run({}, reference_of(good)).error().message, "the cloud has no points");
  const auto bad_reference = run(good, reference_of(nan));
  ASSERT_FALSE(bad_reference);
  EXPECT_EQ(bad_reference.error().kind, core::ErrorKind::kInput);
  EXPECT_NE(bad_reference.error().message.find("1 of 100 points"), std::string::npos);
  EXPECT_NE(run(good, reference_of(SurfaceSamples{})).error().message.find("no points"), std::string::npos);
  SurfaceSamples all_nan;
  all_nan.points.assign(3, Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN()));
  EXPECT_EQ(run(all_nan, reference_of(good)).error().kind, core::ErrorKind::kInput);
  TriangleMesh broken = square_mesh(1.0F);
  broken.triangles.push_back({0, 1, 9});
  EXPECT_NE(run(good, reference_of(broken)).error().message.find("out of range"), std::string::npos);
  TriangleMesh flat = square_mesh(0.0F);
  EXPECT_NE(run(good, reference_of(flat)).error().message.find("no area"), std::string::npos);
  CloudOptions options;
  options.mesh_spacing_m = 0.0;
  EXPECT_EQ(run(good, reference_of(good), options).error().kind, core::ErrorKind::kUsage);
}

TEST(EvaluateCloud, OnePointAgainstOnePoint) {
  SurfaceSamples a, b;
  a.points = {{0, 0, 0}};
  b.points = {{0, 0.003F, 0.004F}};
  const auto report = run(a, reference_of(b));
  ASSERT_TRUE(report) << report.error().message;
  EXPECT_NEAR(report->accuracy_mm.mean, 5.0, 1e-5);
  EXPECT_NEAR(report->completeness_mm.mean, 5.0, 1e-5);
  EXPECT_EQ(report->wall.patches, 0U);
  EXPECT_FALSE(report->warnings.empty());
}

TEST(EvaluateCloud, ManyPointsAtOnePlace) {
  SurfaceSamples heap;
  heap.points.assign(5000, Eigen::Vector3f(1.0F, 2.0F, 3.0F));
  const auto report = run(heap, reference_of(heap));
  ASSERT_TRUE(report);
  EXPECT_EQ(report->accuracy_mm.max, 0.0);
  EXPECT_EQ(report->density_per_m2, 0.0);
}

TEST(EvaluateCloud, WithoutReferenceThicknessAndDensityOnly) {
  const SurfaceSamples cloud = plane(1.0, 0.0, 0.01);
  const auto report = evaluate_cloud(cloud, nullptr, {}, {}, two_threads());
  ASSERT_TRUE(report);
  EXPECT_FALSE(report->has_reference);
  EXPECT_GT(report->wall.patches, 0U);
  const auto json = nlohmann::json::parse(to_json(*report));
  EXPECT_FALSE(json.contains("accuracy_mm"));
  EXPECT_TRUE(json["wall_thickness_mm"]["rms"].is_number());
  EXPECT_NEAR(json["density"]["points_per_m2"].get<double>(), 1e4, 500.0);
}

TEST(EvaluateCloud, JsonHasTheDocumentedKeys) {
  const auto report = run(plane(1.0, 0.004, 0.01), reference_of(square_mesh(1.0F)));
  ASSERT_TRUE(report);
  const auto json = nlohmann::json::parse(to_json(*report));
  for (const char* key : {"mean", "median", "rmse", "p90"}) {
    EXPECT_TRUE(json["accuracy_mm"][key].is_number()) << key;
    EXPECT_TRUE(json["completeness_mm"][key].is_number()) << key;
  }
  for (const char* key : {"5mm", "10mm", "20mm", "50mm"}) {
    EXPECT_TRUE(json["at"][key]["precision"].is_number()) << key;
    EXPECT_TRUE(json["at"][key]["recall"].is_number()) << key;
    EXPECT_TRUE(json["at"][key]["f"].is_number()) << key;
  }
  EXPECT_TRUE(json["normal_consistency"].is_number());
  EXPECT_TRUE(json["wall_thickness_mm"]["rms"].is_number());
  EXPECT_EQ(json["alignment"]["type"].get<std::string>(), "none");
  EXPECT_NE(to_text(*report).find("accuracy"), std::string::npos);
}

TEST(EvaluateCloud, SameBytesForAnyNumberOfThreads) {
  SurfaceSamples cloud = box({2.0, 1.5, 1.0}, 0.02);
  Random random(3);
  for (auto& p : cloud.points) p += 0.01F * Eigen::Vector3d(random(), random(), random()).cast<float>();
  const Reference reference = reference_of(box({2.0, 1.5, 1.0}, 0.03));
  CloudOptions options;
  options.align = CloudAlignment::kSe3;
  const core::Executor one(1), five(5);
  const auto a = evaluate_cloud(cloud, &reference, options, {}, one);
  const auto b = evaluate_cloud(cloud, &reference, options, {}, five);
  ASSERT_TRUE(a);
  ASSERT_TRUE(b);
  EXPECT_EQ(to_json(*a), to_json(*b));
  EXPECT_EQ(std::memcmp(a->error_m.data(), b->error_m.data(), a->error_m.size() * sizeof(float)), 0);
}

TEST(AlignCloud, IcpFindsAMovedRoom) {
  const SurfaceSamples room = box({3.0, 2.0, 2.4}, 0.04);
  const Eigen::Isometry3d reference_from_cloud =
      Eigen::Translation3d(0.06, -0.05, 0.04) *
      Eigen::AngleAxisd(0.02, Eigen::Vector3d(1, 2, -1).normalized());
  const SurfaceSamples cloud = moved(box({3.0, 2.0, 2.4}, 0.05), reference_from_cloud.inverse());
  CloudOptions options;
  options.align = CloudAlignment::kSe3;
  for (const Reference& reference : {reference_of(room), reference_of(box_mesh({3.0F, 2.0F, 2.4F}))}) {
    const auto report = run(cloud, reference, options);
    ASSERT_TRUE(report);
    EXPECT_TRUE(report->alignment.icp_converged);
    EXPECT_LT(report->accuracy_mm.p90, 0.01);
    EXPECT_LT(
        (report->alignment.reference_from_cloud.isometry().matrix() - reference_from_cloud.matrix()).norm(),
        1e-5);
  }
  EXPECT_GT(run(cloud, reference_of(room))->accuracy_mm.mean, 20.0);
}

TEST(AlignCloud, TrajectoriesBridgeWhatIcpCannot) {
  const SurfaceSamples room = box({3.0, 2.0, 2.4}, 0.04);
  const Eigen::Isometry3d reference_from_cloud =
      Eigen::Translation3d(20.0, -7.0, 1.0) *
      Eigen::AngleAxisd(2.0, Eigen::Vector3d(0.2, 0.1, 1.0).normalized());
  const SurfaceSamples cloud = moved(room, reference_from_cloud.inverse());
  TrajectoryPair pair;
  Random random(4);
  for (int i = 0; i < 60; ++i) {
    const Eigen::Vector3d place(1.5 + std::cos(0.1 * i), 1.0 + 0.5 * std::sin(0.1 * i), 1.2 + 0.01 * i);
    const Eigen::Vector3d noise(random() - 0.5, random() - 0.5, random() - 0.5);
    pair.truth.push_back({0.1 * i, {Eigen::Matrix3d::Identity(), place}});
    pair.estimate.push_back(
        {0.1 * i, {Eigen::Matrix3d::Identity(), reference_from_cloud.inverse() * place + 0.02 * noise}});
  }
  const Reference reference = reference_of(room);
  CloudOptions options;
  options.align = CloudAlignment::kSe3;
  const auto report = evaluate_cloud(cloud, &reference, options, {pair}, two_threads());
  ASSERT_TRUE(report) << report.error().message;
  EXPECT_EQ(report->alignment.trajectory_poses, 60U);
  EXPECT_LT(report->alignment.trajectory_rmse_m, 0.02);
  EXPECT_LT(report->accuracy_mm.p90, 0.05);
  const auto lost = evaluate_cloud(cloud, &reference, options, {}, two_threads());
  ASSERT_TRUE(lost);
  EXPECT_FALSE(lost->warnings.empty());
  EXPECT_TRUE(lost->alignment.failed);
  for (auto& pose : pair.truth) pose.stamp += 1e5;
  const auto apart = evaluate_cloud(cloud, &reference, options, {pair}, two_threads());
  ASSERT_FALSE(apart);
  EXPECT_NE(apart.error().message.find("do not overlap in time"), std::string::npos);
}

/// Samples whose points are less `shift` and lie where those of `samples` lie, seen from `origin`.
SurfaceSamples shifted(SurfaceSamples samples, const Eigen::Vector3d& origin, const Eigen::Vector3d& shift) {
  for (auto& p : samples.points) p = (p.cast<double>() + origin - shift).cast<float>();
  samples.shift = shift;
  return samples;
}

TEST(EvaluateCloud, LargeCoordinatesAreMeasuredLessTheirShifts) {
  const Eigen::Vector3d utm(691000, 5334000, 520);
  const SurfaceSamples room = box({1.0, 0.8, 0.6}, 0.02);
  const SurfaceSamples cloud = shifted(room, utm, utm + Eigen::Vector3d(5, -3, 0));
  Reference reference = reference_of(box_mesh({1.0F, 0.8F, 0.6F}));
  reference.shift = utm;
  const auto report = run(cloud, reference);
  ASSERT_TRUE(report) << report.error().message;
  expect_all_mm(report->accuracy_mm, 0.0, 0.01);
  EXPECT_NEAR(report->spacing_mm, 20.0, 0.01);
  EXPECT_LT(report->alignment.reference_from_cloud.translation.norm(), 1e-6);
  ASSERT_FALSE(report->planes.empty());
  const WallPlane& plane = report->planes.front();
  const double inside_m = plane.normal.dot(utm + Eigen::Vector3d(0.5, 0.4, 0.3)) - plane.offset_m;
  EXPECT_GT(inside_m, 0.29);
  EXPECT_LT(inside_m, 0.51);

  reference.shift.setZero();
  const auto apart = run(cloud, reference);
  ASSERT_FALSE(apart);
  EXPECT_NE(apart.error().message.find("the cloud and reference lie 5379 km apart"), std::string::npos);
}

TEST(AlignCloud, PlacementsAreInTheCoordinatesOfTheFiles) {
  const Eigen::Vector3d utm(691000, 5334000, 520);
  const SurfaceSamples room = box({3.0, 2.0, 2.4}, 0.04);
  const Eigen::Isometry3d turned = Eigen::Translation3d(0.06, -0.05, 0.04) *
                                   Eigen::AngleAxisd(0.02, Eigen::Vector3d(1, 2, -1).normalized());
  TrajectoryPair pair;
  for (int i = 0; i < 60; ++i) {
    const Eigen::Vector3d place(1.5 + std::cos(0.1 * i), 1.0 + 0.5 * std::sin(0.1 * i), 1.2 + 0.01 * i);
    pair.truth.push_back({0.1 * i, {Eigen::Matrix3d::Identity(), utm + place}});
    pair.estimate.push_back({0.1 * i, {Eigen::Matrix3d::Identity(), turned.inverse() * place}});
  }

  Reference reference = reference_of(room);
  reference.shift = utm;
  CloudOptions options;
  options.align = CloudAlignment::kSe3;
  const SurfaceSamples local = moved(room, turned.inverse());
  const auto report = evaluate_cloud(local, &reference, options, {pair}, two_threads());
  ASSERT_TRUE(report) << report.error().message;
  EXPECT_FALSE(report->alignment.failed);
  EXPECT_LT(report->accuracy_mm.p90, 0.05);
  const Eigen::Vector3d origin = report->alignment.reference_from_cloud * Eigen::Vector3d::Zero();
  EXPECT_LT((origin - utm - turned.translation()).norm(), 1e-4);
}

TEST(AlignCloud, APlaneLeavesThreeDirectionsAsTheyWereAndSaysSo) {
  SurfaceSamples cloud;
  add_rectangle(cloud, {0.3, 0.3, 0.02}, {1, 0, 0}, {0, 1, 0}, 0.02);
  CloudOptions options;
  options.align = CloudAlignment::kSe3;
  const auto report = run(cloud, reference_of(plane(2.0, 0.0, 0.02)), options);
  ASSERT_TRUE(report);
  EXPECT_NEAR(report->accuracy_mm.max, 0.0, 1e-3);
  EXPECT_LT((report->alignment.reference_from_cloud.translation - Eigen::Vector3d(0, 0, -0.02)).norm(), 1e-6);
  ASSERT_FALSE(report->warnings.empty());
  EXPECT_NE(report->warnings.back().find("single plane"), std::string::npos);
}

}  // namespace
