// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/core/part.hpp"

#include <dlfcn.h>
#include <fmt/format.h>
#include <link.h>

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <system_error>
#include <utility>
#include <vector>

#include "plumbline/core/shortage.hpp"

namespace plumbline::core {
namespace {

namespace fs = std::filesystem;

/// The object that holds this code: the program, or a module that another program has loaded, as Python does.
void* own_object() {
  Dl_info info{};
  void* object = nullptr;
  if (dladdr(reinterpret_cast<const void*>(&own_object), &info) != 0)
    object = dlopen(info.dli_fname, RTLD_LAZY | RTLD_NOLOAD);
  return object != nullptr ? object : dlopen(nullptr, RTLD_LAZY);
}

/// Folders in which the dynamic linker looks for the libraries of that object: its RUNPATH, then the system's
/// folders. dlopen searches them itself, but not under a sanitizer. Never the current folder.
std::vector<fs::path> library_folders() {
  void* program = own_object();
  Dl_serinfo head{};
  if (program == nullptr || dlinfo(program, RTLD_DI_SERINFOSIZE, &head) != 0) return {};
  std::vector<std::max_align_t> room(head.dls_size / sizeof(std::max_align_t) + 1);
  auto* info = reinterpret_cast<Dl_serinfo*>(room.data());
  *info = head;
  if (dlinfo(program, RTLD_DI_SERINFO, info) != 0) return {};
  std::vector<fs::path> folders;
  const Dl_serpath* paths = info->dls_serpath;
  for (unsigned i = 0; i < info->dls_cnt; ++i) {
    if (fs::path folder(paths[i].dls_name); folder.is_absolute()) folders.push_back(std::move(folder));
  }
  return folders;
}

/// In a program of others that links this library, that program's libGLX would come before the stand-ins for
/// it in the part "viz": parts and what they load then take their own symbols first. Sanitizers refuse that.
int symbol_order() {
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  if (own_object() != dlopen(nullptr, RTLD_LAZY) && dlsym(RTLD_DEFAULT, "glXGetProcAddressARB") != nullptr)
    return RTLD_DEEPBIND;
#endif
  return 0;
}

/// Parts of Debian packages of their own.
std::string remedy(const std::string& name) {
  if (name == "dds") return "install the package plumbline-net";
  if (name == "bags") return "install the package plumbline-ros1";
  return "install it again";
}

}  // namespace

/// Loads a part of the program from its library folders; `layout` must be that of this build.
Result<const void*> load_part(const std::string& name, std::uint64_t layout) {
  const std::string file = fmt::format("plumbline_{}.so", name);
  const std::vector<fs::path> folders = library_folders();
  std::error_code ec;

  // Only in the library folders, never in the current one
  const auto folder = std::find_if(folders.begin(), folders.end(),
                                   [&](const fs::path& f) { return fs::exists(f / file, ec); });
  if (folder == folders.end()) {
    return failure(
        ErrorKind::kInternal,
        fmt::format("{}: this part of Plumbline is missing; {}. It belongs in {}", file, remedy(name),
                    folders.empty() ? "lib/plumbline" : folders.front().lexically_normal().string()));
  }

  // Errors that a new installation remedies
  const std::string path = (*folder / file).lexically_normal().string();
  const auto unfit = [&path](const std::string& why) {
    return failure(ErrorKind::kInternal,
                   fmt::format("{}: this part of Plumbline {}; install Plumbline again", path, why));
  };

  // Symbols stay local, so that parts do not mix
  void* handle = dlopen(path.c_str(), RTLD_LAZY | RTLD_LOCAL | symbol_order());
  if (handle == nullptr) {
    const char* words = dlerror();
    const std::string why = words == nullptr ? "unknown reason" : words;
    if (const std::string shortage = shortage_of_linker(why); !shortage.empty())
      return output_error(fmt::format("{}: cannot be loaded: {}", path, shortage));
    return unfit(fmt::format("cannot be loaded ({})", why));
  }

  // The entry point gives the table of functions
  using Entry = PartEntry (*)();
  const auto entry = reinterpret_cast<Entry>(dlsym(handle, "plumbline_part"));
  if (entry == nullptr) return unfit("has no functions");

  // Parts of another build may differ in their types
  const PartEntry found = entry();
  if (found.layout != layout) return unfit("was not built together with this program");
  return found.functions;
}

}  // namespace plumbline::core
