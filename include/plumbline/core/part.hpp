// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Parts: what is seldom used and needs many libraries (VTK, most of PCL, OpenCV's image formats). Their
// loading takes longer than all the rest of a program's start, so they are shared objects of their own,
// plumbline_<name>.so in lib/plumbline, which the first caller of a function of theirs loads. A part's
// functions are a struct of pointers:
//
//   struct Drawing {                                               // in a header that both sides include
//     static constexpr const char* kPart = "viz";
//     static constexpr std::uint64_t layout() { return core::layout_of<Drawing, Scene>(); }
//     core::Result<void> (*draw)(const Scene& scene);
//   };
//   PLUMBLINE_PART(plumbline::viz::Drawing, &draw)                  // in the part
//
//   const auto& drawing = core::part<Drawing>();                   // in the program
//   if (!drawing) return tl::unexpected(drawing.error());
//   return (*drawing)->draw(scene);
#include <cstdint>
#include <string>

#include "plumbline/core/error.hpp"

namespace plumbline::core {

/// Tells whether program and part lay out the types alike that pass between them: they are built together,
/// but files may be mixed up later.
template <typename... Types>
constexpr std::uint64_t layout_of() {
  std::uint64_t hash = 14695981039346656037ULL;  // FNV-1a over the sizes
  ((hash = (hash ^ sizeof(Types)) * 1099511628211ULL), ...);
  return hash;
}

/// Result of a part's only symbol, the extern "C" function plumbline_part().
struct PartEntry {
  std::uint64_t layout = 0;
  const void* functions = nullptr;
};

/// Loads plumbline_<name>.so from one of the folders of the program's own libraries (its RUNPATH); it stays
/// loaded. Errors (kInternal) name the file, what is wrong and the remedy. Thread-safe.
Result<const void*> load_part(const std::string& name, std::uint64_t layout);

/// The functions of a part, loaded by the first call; later calls cost nothing. Thread-safe.
template <typename Functions>
const Result<const Functions*>& part() {
  static const Result<const Functions*> loaded =
      load_part(Functions::kPart, Functions::layout()).map([](const void* functions) {
        return static_cast<const Functions*>(functions);
      });
  return loaded;
}

}  // namespace plumbline::core

/// Once in a part, outside of any namespace: the struct and its members.
#define PLUMBLINE_PART(Functions, ...)                                                            \
  extern "C" __attribute__((visibility("default"))) plumbline::core::PartEntry plumbline_part() { \
    static const Functions functions{__VA_ARGS__};                                                \
    return {Functions::layout(), &functions};                                                     \
  }
