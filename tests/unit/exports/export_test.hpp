// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Exports of clouds that a test makes.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "plumbline/cloud/io/cloud_io.hpp"
#include "plumbline/exports/export.hpp"

namespace plumbline::exports {

namespace fs = std::filesystem;

class ExportTest : public testing::Test {
 protected:
  ExportTest() {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    folder_ =
        fs::path(testing::TempDir()) / fmt::format("plumbline_{}.{}", info->test_suite_name(), info->name());
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  ~ExportTest() override { fs::remove_all(folder_); }

  static cloud::Point point(float x, float y, float z,
                            const Eigen::Vector3f& normal = Eigen::Vector3f::UnitZ(),
                            std::uint8_t red = 200) {
    cloud::Point p;
    p.getVector3fMap() = Eigen::Vector3f(x, y, z);
    p.getNormalVector3fMap() = normal;
    p.r = red;
    p.g = 100;
    p.b = 50;
    return p;
  }

  [[nodiscard]] ExportRequest request(const std::string& output) const {
    ExportRequest request;
    request.input = path("cloud.ply");
    request.output = path(output);
    return request;
  }
  [[nodiscard]] core::Result<ExportSummary> write(const ExportRequest& request) {
    return write_export(request, executor_, *core::null_log(), nullptr);
  }
  [[nodiscard]] fs::path path(const std::string& name) const { return folder_ / name; }
  [[nodiscard]] std::string bytes(const std::string& name) const {
    std::ifstream stream(path(name), std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
  }
  template <typename T>
  static T at(const std::string& bytes, std::size_t offset) {
    T value;
    std::memcpy(&value, bytes.data() + offset, sizeof(value));
    return value;
  }

  core::Executor executor_{2};

 private:
  fs::path folder_;
};

}  // namespace plumbline::exports
