// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <stdexcept>

#include "filters/filter_tools.hpp"

namespace plumbline::cloud {

void FilterRegistry::add(FilterInfo info) {
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
  registry.add(approximate_voxel_grid_filter());
  registry.add(clusters_filter());
  registry.add(color_filter());
  registry.add(crop_box_filter());
  registry.add(curvature_filter());
  registry.add(flying_pixels_filter());
  registry.add(incidence_angle_filter());
  registry.add(merge_filter());
  registry.add(mls_filter());
  registry.add(normal_consistency_filter());
  registry.add(normals_filter());
  registry.add(pass_through_filter());
  registry.add(plane_filter());
  registry.add(radius_outlier_filter());
  registry.add(random_sampling_filter());
  registry.add(statistical_outlier_filter());
  registry.add(tee_filter());
  registry.add(transform_filter());
  registry.add(uniform_sampling_filter());
  registry.add(voxel_grid_filter());
  return registry;
}

}  // namespace plumbline::cloud
