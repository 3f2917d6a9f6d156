// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace plumbline::cli {

/// Three lines: the program's version, the libraries that it was built with, the format of map.db.
std::string version_text();

}  // namespace plumbline::cli
