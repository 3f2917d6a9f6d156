// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <stdexcept>

#include "filters/filter_tools.hpp"

namespace plumbline::cloud {

void FilterRegistry::add(FilterInfo info) {
  // Sorted by name, which must be unique
  const auto place =
      std::lower_bound(filters_.begin(), filters_.end(), info.type,
                       [](const FilterInfo& f, const std::string& type) { return f.type < type; });
  if (place != filters_.end() && place->type == info.type) {
    throw std::invalid_argument("filter '" + info.type + "' is registered twice");
  }
  filters_.insert(place, std::move(info));
}

const FilterInfo* FilterRegistry::find(const std::string& type) const {
  for (const auto& filter : filters_) {
    if (filter.type == type) return &filter;
  }
  return nullptr;
}

std::vector<std::string> FilterRegistry::types() const {
  std::vector<std::string> types;
  for (const auto& filter : filters_) types.push_back(filter.type);
  return types;
}

FilterRegistry builtin_filters() {
  FilterRegistry registry;
  const auto add = [&registry](auto... info) { (registry.add(info()), ...); };
  add(approximate_voxel_grid_filter, clusters_filter, color_filter, crop_box_filter, curvature_filter,
      flying_pixels_filter, incidence_angle_filter, merge_filter, mls_filter, normal_consistency_filter,
      normals_filter, pass_through_filter, plane_filter, radius_outlier_filter, random_sampling_filter,
      statistical_outlier_filter, tee_filter, transform_filter, uniform_sampling_filter, voxel_grid_filter);
  return registry;
}

}  // namespace plumbline::cloud
