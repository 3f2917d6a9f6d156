// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Filters of a user's own, in a shared object that the program loads with --plugin:
//
//   #include "plumbline/cloud/filters/filter_plugin.hpp"
//   ...                                          // class MyFilter : public plumbline::cloud::Filter
//   PLUMBLINE_FILTER_PLUGIN(registry) {
//     registry.add({"my_filter", "One line.", "A paragraph.", "- type: my_filter\n",
//                   [] { return std::make_unique<MyFilter>(); }});
//   }
//
// Built against the installed library (find_package(plumbline), target plumbline::plumbline) as a MODULE; an
// example project is in examples/plugin_filter. The program hands its registry to the plugin: there is only
// one.
#include <pcl/pcl_config.h>

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <string>

#include "plumbline/cloud/filters/filter.hpp"
#include "plumbline/core/version.hpp"

namespace plumbline::cloud {

/// Goes up when a header that plugins see changes (filter.hpp, core/options.hpp, core/error.hpp).
constexpr std::uint32_t kFilterInterface = 2;
constexpr std::uint32_t kFilterPluginMagic = 0x464c4250;
/// The one symbol of a plugin, an extern "C" function: const FilterPlugin* plumbline_filter_plugin().
constexpr const char* kFilterPluginSymbol = "plumbline_filter_plugin";

/// Description of a plugin. The first three members never change, so that any program can report why a plugin
/// does not fit.
struct FilterPlugin {
  std::uint32_t magic = kFilterPluginMagic;
  std::uint32_t interface = kFilterInterface;
  const char* built_with = nullptr;  ///< plugin_toolchain() where it was built
  void (*add)(FilterRegistry& registry) = nullptr;
};

#define PLUMBLINE_TEXT_(x) #x
#define PLUMBLINE_TEXT(x) PLUMBLINE_TEXT_(x)
/// Properties that must be equal on both sides for their objects to have the same layout.
inline std::string plugin_toolchain() {
  return std::string("plumbline ") + core::version() +
         ", PCL " PCL_VERSION_PRETTY ", Eigen alignment " PLUMBLINE_TEXT(
             EIGEN_MAX_ALIGN_BYTES) ", libstdc++ ABI " PLUMBLINE_TEXT(_GLIBCXX_USE_CXX11_ABI);
}
#undef PLUMBLINE_TEXT
#undef PLUMBLINE_TEXT_

/// Loads the shared object and adds its filters; it stays loaded until the program ends. Errors (kUsage) name
/// the file: missing, not a shared object, not a plugin, built for another version, a filter that is there
/// already; the registry is then as it was. Loading runs the file's code: only load files that you trust.
core::Result<void> load_filter_plugin(const std::filesystem::path& file, FilterRegistry& registry);

/// End of a message that a registry has no such filter: similar or allowed names, and the way to add one.
std::string missing_filter_hint(const std::string& type, const FilterRegistry& registry);

}  // namespace plumbline::cloud

/// Followed by the body of a function that adds filters to `registry`.
// NOLINTBEGIN(bugprone-macro-parentheses): a parameter's name cannot stand in parentheses.
#define PLUMBLINE_FILTER_PLUGIN(registry)                                                           \
  static void plumbline_add_filters(plumbline::cloud::FilterRegistry& registry);                    \
  extern "C" __attribute__((visibility("default"))) const plumbline::cloud::FilterPlugin*           \
  plumbline_filter_plugin() {                                                                       \
    static const std::string built_with = plumbline::cloud::plugin_toolchain();                     \
    static const plumbline::cloud::FilterPlugin plugin{plumbline::cloud::kFilterPluginMagic,        \
                                                       plumbline::cloud::kFilterInterface,          \
                                                       built_with.c_str(), &plumbline_add_filters}; \
    return &plugin;                                                                                 \
  }                                                                                                 \
  static void plumbline_add_filters(plumbline::cloud::FilterRegistry& registry)
// NOLINTEND(bugprone-macro-parentheses)
