// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The viewer as HTML that contains everything and loads nothing: WebGL 2 code and data in the page.
#include <string>
#include <string_view>

#include "plumbline/viewer/scene.hpp"

namespace plumbline::viewer {

std::string base64(std::string_view bytes);

/// Size of a cloud's data in the page; bytes as they stand in it, base64 included.
struct Cost {
  std::size_t points = 0;
  std::size_t place_and_color = 0;
  std::size_t normals = 0;
  std::size_t layers = 0;  ///< of all layers of Points::layers
  std::size_t code = 0;    ///< scripts, styles, and the elements that they move
};

/// A part of a page, to be put inside <body>: well-formed, style and scripts in it. `still`: HTML that is
/// shown in its place where there is no WebGL 2. Same scene, same bytes. `cost` may be null.
std::string fragment(const Scene& scene, const std::string& still, Cost* cost = nullptr);
/// The same as a page of its own, which fills the window. `generator`: how it is known again.
std::string page(const Scene& scene, const std::string& generator, Cost* cost = nullptr);

/// One cloud as JSON, its data in it: a piece that a live page is sent. `z_up` as Scene::z_up.
std::string cloud_json(const Points& points, bool z_up);
/// A position in the page's axes: z up.
Eigen::Vector3d upright(const Eigen::Vector3d& place, bool z_up);

}  // namespace plumbline::viewer
