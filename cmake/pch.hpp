// SPDX-License-Identifier: BSD-3-Clause
// Precompiled header of modules that see Eigen and OpenCV's matrices, but not PCL.
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>
