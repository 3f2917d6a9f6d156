// SPDX-License-Identifier: BSD-3-Clause
// Adds a filter under a name that is taken.
#include "plumbline/cloud/filter_plugin.hpp"

PLUMBLINE_FILTER_PLUGIN(registry) {
  plumbline::cloud::FilterInfo info = *registry.find("range");
  info.type = "fresh";
  registry.add(info);
  info.type = "range";
  registry.add(info);
}
