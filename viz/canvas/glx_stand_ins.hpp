// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// GLEW's four calls to GLX (offscreen.cpp), for the end of one source of the program and one of the part. In
// the program they come before libGLX, which OpenCV loads together with it; in the part they serve where the
// program is another's, such as Python, and does not hold them.
#include <cstring>

#include "canvas/drawing.hpp"

extern "C" {

__attribute__((visibility("default"))) void* glXGetCurrentDisplay() {
  static char any;  // GLEW only checks that there is one
  return &any;
}

__attribute__((visibility("default"))) int glXQueryVersion(void* /*display*/, int* major, int* minor) {
  if (major != nullptr) *major = 1;
  if (minor != nullptr) *minor = 4;
  return 1;
}

__attribute__((visibility("default"))) const char* glXGetClientString(void* /*display*/, int /*name*/) {
  return "";
}

__attribute__((visibility("default"))) plumbline::viz::Drawing::GlFunction glXGetProcAddressARB(
    const unsigned char* name) {
  const char* text = reinterpret_cast<const char*>(name);
  if (std::strcmp(text, "glXGetCurrentDisplay") == 0) {
    return reinterpret_cast<plumbline::viz::Drawing::GlFunction>(&glXGetCurrentDisplay);
  }

  // Nothing else of GLX exists here.
  return std::strncmp(text, "glX", 3) == 0 ? nullptr : plumbline::viz::offscreen_function(text);
}

}  // extern "C"
