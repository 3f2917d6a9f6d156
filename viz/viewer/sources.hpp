// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The page's own code, made of this folder's *.js, *.glsl and *.css when the program is built
// (cmake/embed.cpp).

namespace plumbline::viewer {

extern const char* const kScript;      ///< to be closed by "})();"
extern const char* const kLiveScript;  ///< goes before that in live pages
extern const char* const kStyle;

}  // namespace plumbline::viewer
