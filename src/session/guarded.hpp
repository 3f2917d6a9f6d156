// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Exceptions and temporary folders of the calls of plumbline.hpp.
#include <exception>
#include <filesystem>
#include <memory>

#include "plumbline/core/error.hpp"

namespace plumbline::session {

/// The exception as an error; a bug is named as one.
core::Error as_error(const std::exception& problem);

/// The result of `work`; what it throws becomes an error.
template <typename Work>
auto guarded(const Work& work) -> decltype(work()) {
  try {
    return work();
  } catch (const std::exception& problem) {
    return tl::unexpected(as_error(problem));
  }
}

/// The folder that a run writes.
struct Place {
  std::filesystem::path output;
  std::shared_ptr<void> kept;  ///< removes a temporary folder with its last copy
};
/// `output`, or a temporary folder if that is empty. Errors (kOutput): it cannot be made.
core::Result<Place> place_of(const std::filesystem::path& output);

}  // namespace plumbline::session
