// SPDX-License-Identifier: BSD-3-Clause
// VTK off-screen with Debian's packages: Debian builds VTK for X11 and its GLEW for GLX, so VTK's generic
// window gets an OSMesa (software) context, and GLEW's four calls to GLX end in drawing.cpp instead of in
// libGL. OSMesa must come before VTK in the link order, so that the gl* functions are OSMesa's.
#include "canvas/offscreen.hpp"

#include <GL/osmesa.h>
#include <vtkAutoInit.h>
#include <vtkCallbackCommand.h>
#include <vtkNew.h>
#include <vtkUnsignedCharArray.h>

VTK_MODULE_INIT(vtkRenderingOpenGL2)
VTK_MODULE_INIT(vtkRenderingContextOpenGL2)
VTK_MODULE_INIT(vtkRenderingFreeType)

namespace plumbline::viz {

struct OffscreenWindow::Context {
  OSMesaContext osmesa = nullptr;
  std::vector<std::uint8_t> color_buffer;  // OSMesa's default framebuffer, RGBA
  int width = 0;
  int height = 0;

  [[nodiscard]] bool make_current() {
    return OSMesaMakeCurrent(osmesa, color_buffer.data(), GL_UNSIGNED_BYTE, width, height) == GL_TRUE;
  }
  ~Context() {
    if (osmesa != nullptr) OSMesaDestroyContext(osmesa);
  }
};

core::Result<std::unique_ptr<OffscreenWindow>> OffscreenWindow::open(int width_px, int height_px) {
  const int attributes[] = {OSMESA_FORMAT,
                            OSMESA_RGBA,
                            OSMESA_DEPTH_BITS,
                            24,
                            OSMESA_STENCIL_BITS,
                            8,
                            OSMESA_PROFILE,
                            OSMESA_CORE_PROFILE,
                            OSMESA_CONTEXT_MAJOR_VERSION,
                            3,
                            OSMESA_CONTEXT_MINOR_VERSION,
                            2,
                            0};

  // OSMesa draws into memory, without a display.
  std::unique_ptr<OffscreenWindow> result(new OffscreenWindow);
  result->context_ = std::make_unique<Context>();
  Context& context = *result->context_;
  context.width = width_px;
  context.height = height_px;
  context.color_buffer.resize(4 * static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px));
  context.osmesa = OSMesaCreateContextAttribs(attributes, nullptr);

  if (context.osmesa == nullptr || !context.make_current()) {
    return core::failure(core::ErrorKind::kInternal,
                         "no OpenGL context from OSMesa (is Debian's libosmesa6 installed?)");
  }

  result->window_ = vtkSmartPointer<vtkGenericOpenGLRenderWindow>::New();
  vtkGenericOpenGLRenderWindow* window = result->window_;

  // VTK asks if the context is current.
  vtkNew<vtkCallbackCommand> is_current;
  is_current->SetCallback(
      [](vtkObject*, unsigned long, void*, void* answer) { *static_cast<bool*>(answer) = true; });
  window->AddObserver(vtkCommand::WindowIsCurrentEvent, is_current);

  // The context belongs to OSMesa, not to VTK.
  window->SetReadyForRendering(true);
  window->SetOwnContext(0);
  window->SetIsDirect(1);
  window->SetSupportsOpenGL(1);
  window->SetSize(width_px, height_px);
  window->SetMultiSamples(0);  // pictures are drawn larger and scaled down instead
  if (!window->InitializeFromCurrentContext()) {
    return core::failure(core::ErrorKind::kInternal, "VTK cannot use the OpenGL context of OSMesa");
  }
  return result;
}

OffscreenWindow::~OffscreenWindow() {
  if (context_ != nullptr && window_ != nullptr && context_->make_current()) window_->Finalize();
  window_ = nullptr;
}

cv::Mat4b OffscreenWindow::draw() {
  window_->Render();
  vtkNew<vtkUnsignedCharArray> pixels;
  window_->GetRGBACharPixelData(0, 0, context_->width - 1, context_->height - 1, 0, pixels, 0);
  return cv::Mat4b(context_->height, context_->width, reinterpret_cast<cv::Vec4b*>(pixels->GetPointer(0)))
      .clone();
}

}  // namespace plumbline::viz
