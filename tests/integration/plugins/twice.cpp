// SPDX-License-Identifier: BSD-3-Clause
// Adds a filter under a name that is taken.
#include "plumbline/cloud/filters/filter_plugin.hpp"

PLUMBLINE_FILTER_PLUGIN(registry) {
  plumbline::cloud::FilterInfo info = *registry.find("crop_box");
  info.type = "fresh";
  registry.add(info);
  info.type = "crop_box";
  registry.add(info);
}
