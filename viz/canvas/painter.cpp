// SPDX-License-Identifier: BSD-3-Clause
#include "canvas/painter.hpp"

#include <vtkBrush.h>
#include <vtkContext2D.h>
#include <vtkPen.h>
#include <vtkTextProperty.h>

#include <cmath>

#include "plumbline/core/text.hpp"

namespace plumbline::viz {
namespace {

unsigned char alpha(double opacity) { return static_cast<unsigned char>(std::lround(255.0 * opacity)); }

/// All properties are set, for VTK keeps them from call to call.
void set_text(vtkContext2D* context, double size_px, const Rgb& color, bool bold) {
  vtkTextProperty* property = context->GetTextProp();
  property->SetFontFamilyToArial();
  property->SetFontSize(static_cast<int>(std::lround(size_px)));
  property->SetBold(bold ? 1 : 0);
  property->SetItalic(0);
  property->SetShadow(0);
  property->SetOrientation(0.0);
  property->SetColor(color.r / 255.0, color.g / 255.0, color.b / 255.0);
  property->SetJustificationToLeft();
  property->SetVerticalJustificationToCentered();
}

}  // namespace

void Painter::polyline(const std::vector<Eigen::Vector2d>& points, const Rgb& color, double width_px,
                       double opacity) {
  if (points.size() < 2) return;

  // VTK takes flat coordinates.
  std::vector<float> xy;
  xy.reserve(2 * points.size());
  for (const auto& p : points) {
    xy.push_back(static_cast<float>(p.x()));
    xy.push_back(static_cast<float>(p.y()));
  }
  context_->GetPen()->SetLineType(vtkPen::SOLID_LINE);
  context_->GetPen()->SetColor(color.r, color.g, color.b, alpha(opacity));
  context_->GetPen()->SetWidth(static_cast<float>(width_px * scale_));
  context_->DrawPoly(xy.data(), static_cast<int>(points.size()));
}

void Painter::rectangle(const Eigen::Vector2d& corner, const Eigen::Vector2d& size, const Rgb& fill,
                        double opacity) {
  context_->GetPen()->SetLineType(vtkPen::NO_PEN);
  context_->GetBrush()->SetColor(fill.r, fill.g, fill.b, alpha(opacity));
  context_->DrawRect(static_cast<float>(corner.x()), static_cast<float>(corner.y()),
                     static_cast<float>(size.x()), static_cast<float>(size.y()));
}

void Painter::disc(const Eigen::Vector2d& centre, double radius_px, const Rgb& fill) {
  context_->GetPen()->SetLineType(vtkPen::NO_PEN);
  context_->GetBrush()->SetColor(fill.r, fill.g, fill.b, 255);
  const auto radius = static_cast<float>(radius_px * scale_);
  context_->DrawEllipse(static_cast<float>(centre.x()), static_cast<float>(centre.y()), radius, radius);
}

void Painter::ring(const Eigen::Vector2d& centre, double radius_px, const Rgb& color, double width_px) {
  disc(centre, radius_px + 0.5 * width_px, color);
  disc(centre, radius_px - 0.5 * width_px, Rgb{255, 255, 255});
}

void Painter::text(const Eigen::Vector2d& at, const std::string& text, double size_px, const Rgb& color,
                   Anchor anchor, bool bold) {
  if (text.empty()) return;
  set_text(context_, size_px * scale_, color, bold);
  vtkTextProperty* property = context_->GetTextProp();
  if (anchor == Anchor::kCentre) property->SetJustificationToCentered();
  if (anchor == Anchor::kRight) property->SetJustificationToRight();
  context_->DrawString(static_cast<float>(at.x()), static_cast<float>(at.y()), core::printable(text).c_str());
}

double Painter::text_width(const std::string& text, double size_px, bool bold) {
  set_text(context_, size_px * scale_, Rgb{}, bold);
  float bounds[4] = {0.0F, 0.0F, 0.0F, 0.0F};
  context_->ComputeStringBounds(core::printable(text).c_str(), bounds);
  return static_cast<double>(bounds[2]);
}

}  // namespace plumbline::viz
