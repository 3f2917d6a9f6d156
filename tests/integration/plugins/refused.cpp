// SPDX-License-Identifier: BSD-3-Clause
// Shared objects that are no plugins for this program; which one is said on the compiler's command line.
#include "plumbline/cloud/filters/filter_plugin.hpp"

using plumbline::cloud::FilterPlugin;

#define EXPORTED extern "C" __attribute__((visibility("default")))

#if defined(FOREIGN)  // another library altogether
EXPORTED int plumbline_something_else() { return 1; }
#else
EXPORTED const FilterPlugin* plumbline_filter_plugin() {
  static const std::string toolchain = plumbline::cloud::plugin_toolchain();
  static FilterPlugin plugin;
  plugin.built_with = toolchain.c_str();
  plugin.add = [](plumbline::cloud::FilterRegistry&) {};
#if defined(STRANGER)  // the same name, something else behind it
  plugin.magic = 7;
#elif defined(OLD)
  plugin.interface = 0;
#elif defined(OTHER_LIBRARIES)
  plugin.built_with = "plumbline 0.0.1, PCL 1.12.1, Eigen alignment 32, libstdc++ ABI 1";
#elif !defined(NOTHING)
#error "what kind of plugin?"
#endif
  return &plugin;
}
#endif
