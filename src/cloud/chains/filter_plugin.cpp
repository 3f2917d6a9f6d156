// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/cloud/filters/filter_plugin.hpp"

#include <dlfcn.h>
#include <fmt/format.h>

#include <exception>
#include <system_error>
#include <utility>

namespace plumbline::cloud {
namespace {

using Entry = const FilterPlugin* (*)();

/// Never closed again: the filters' code is in it.
core::Result<Entry> open_plugin(const std::filesystem::path& file) {
  std::error_code error;
  if (!std::filesystem::exists(file, error)) return core::usage_error("no such file");
  if (!std::filesystem::is_regular_file(file, error)) return core::usage_error("is not a file");
  // With a folder in its name dlopen looks nowhere else.
  void* handle = dlopen(std::filesystem::absolute(file).c_str(), RTLD_NOW | RTLD_LOCAL);
  if (handle == nullptr) {
    const char* why = dlerror();
    return core::usage_error(fmt::format("cannot be loaded: {}", why == nullptr ? "unknown reason" : why));
  }
  void* symbol = dlsym(handle, kFilterPluginSymbol);
  if (symbol == nullptr) {
    return core::usage_error(fmt::format(
        "is not a Plumbline plugin: it has no {} (see PLUMBLINE_FILTER_PLUGIN)", kFilterPluginSymbol));
  }
  return reinterpret_cast<Entry>(symbol);
}

/// "" or why the plugin does not fit this program.
std::string check_fit(const FilterPlugin* plugin) {
  if (plugin == nullptr || plugin->magic != kFilterPluginMagic) {
    return fmt::format("is not a Plumbline plugin: its {} was not made by PLUMBLINE_FILTER_PLUGIN",
                       kFilterPluginSymbol);
  }
  if (plugin->interface != kFilterInterface) {
    return fmt::format("was built for filter interface {}, this program has {}; build it again against {}",
                       plugin->interface, kFilterInterface, plugin_toolchain());
  }
  if (plugin->built_with == nullptr || plugin_toolchain() != plugin->built_with) {
    return fmt::format("was built with {}, this program with {}; build it again",
                       plugin->built_with == nullptr ? "unknown libraries" : plugin->built_with,
                       plugin_toolchain());
  }
  return plugin->add == nullptr ? "adds no filters" : "";
}

std::string add_filters(const FilterPlugin& plugin, FilterRegistry& registry) {
  // A copy: a plugin that fails leaves the registry as it was
  FilterRegistry more = registry;
  try {
    plugin.add(more);
  } catch (const std::exception& problem) {
    return problem.what();
  }
  if (more.filters().size() == registry.filters().size()) return "adds no filters";
  registry = std::move(more);
  return "";
}

}  // namespace

core::Result<void> load_filter_plugin(const std::filesystem::path& file, FilterRegistry& registry) {
  const auto fail = [&file](const std::string& what) {
    return core::usage_error(fmt::format("plugin {}: {}", file.string(), what));
  };
  const auto entry = open_plugin(file);
  if (!entry) return fail(entry.error().message);

  // Nothing of a plugin for another version is called
  const FilterPlugin* plugin = (*entry)();
  std::string problem = check_fit(plugin);
  if (problem.empty()) problem = add_filters(*plugin, registry);
  if (!problem.empty()) return fail(problem);
  return {};
}

std::string missing_filter_hint(const std::string& type, const FilterRegistry& registry) {
  return core::hint(type, registry.types()) +
         "; filters of your own are loaded by the program's --plugin FILE.so";
}

}  // namespace plumbline::cloud
