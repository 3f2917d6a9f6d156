// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vtkSmartPointer.h>

#include <functional>

class vtkContext2D;
class vtkContextActor;

namespace plumbline::viz {

/// An actor that calls `paint` whenever the window is drawn.
vtkSmartPointer<vtkContextActor> make_overlay(std::function<void(vtkContext2D*)> paint);

}  // namespace plumbline::viz
