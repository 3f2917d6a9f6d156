// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Memory, files or threads that the system has no more of: no fault of the program or its input, and not for
// long.
#include <exception>
#include <new>
#include <string>

#include "plumbline/core/error.hpp"

namespace plumbline::core {

/// The name of a shortage and its remedy, for an errno; "": there is another cause.
std::string shortage_of(int cause);

/// The same for an exception of the standard library, OpenCV or oneTBB.
std::string shortage_of(const std::exception& problem);

/// The same for the message of the dynamic linker that refused to load a library.
std::string shortage_of_linker(const std::string& message);

/// True if no further file can be opened at this moment.
bool files_are_short();

/// The object that a library in C has made. Throws std::bad_alloc instead of a null pointer.
template <typename Object>
Object* made(Object* object) {
  if (object == nullptr) throw std::bad_alloc();
  return object;
}

/// A shortage as kOutput, any other exception as kInternal with its own words.
Error error_of(const std::exception& problem);

}  // namespace plumbline::core
