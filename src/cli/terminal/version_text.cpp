// SPDX-License-Identifier: BSD-3-Clause
#include "terminal/version_text.hpp"

#include <fmt/format.h>

#include "plumbline/core/version.hpp"
#include "plumbline/maps/store.hpp"

namespace plumbline::cli {

std::string version_text() {
  return fmt::format("plumbline {}\nbuilt with {}\nmap.db format {}", core::version(), PLUMBLINE_LIBRARIES,
                     maps::kStoreFormat);
}

}  // namespace plumbline::cli
