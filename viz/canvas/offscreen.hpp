// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A render window of VTK without any display.
#include <vtkGenericOpenGLRenderWindow.h>
#include <vtkSmartPointer.h>

#include <memory>
#include <opencv2/core/mat.hpp>

#include "plumbline/core/error.hpp"

namespace plumbline::viz {

/// Owns an OSMesa context and the VTK window drawn with it. Add renderers to window(), then draw().
class OffscreenWindow {
 public:
  /// Width and height in pixels, [1, 16384]. Fails with kInternal when no OpenGL context can be made.
  static core::Result<std::unique_ptr<OffscreenWindow>> open(int width_px, int height_px);
  ~OffscreenWindow();
  OffscreenWindow(const OffscreenWindow&) = delete;
  OffscreenWindow& operator=(const OffscreenWindow&) = delete;

  [[nodiscard]] vtkGenericOpenGLRenderWindow* window() const { return window_; }
  /// Renders what the window holds and reads it back: RGBA, rows from the bottom to the top. Where a renderer
  /// has a transparent background colours are multiplied by their opacity.
  cv::Mat4b draw();

 private:
  OffscreenWindow() = default;

  struct Context;
  std::unique_ptr<Context> context_;
  vtkSmartPointer<vtkGenericOpenGLRenderWindow> window_;
};

}  // namespace plumbline::viz
