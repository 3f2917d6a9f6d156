// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Tools for drawing textures. Private to the module.
#include <cstdint>
#include <opencv2/core.hpp>

#include "materials/materials.hpp"

namespace plumbline::synth {

// ---- texture_fields.cpp ----

/// Sum of octaves of smooth noise of about unit size that wraps round; `cx`, `cy` cells over the whole
/// picture at the lowest octave, each further one `falloff` times as strong.
cv::Mat1f fractal(cv::Size size, int cx, int cy, int octaves, float falloff, std::uint64_t seed);
/// Independent noise for each texel, uniform in [-1, 1].
cv::Mat1f grain(cv::Size size, std::uint64_t seed);
/// Mean reflectance of a material.
cv::Vec3f tone(const Material& m);
cv::Scalar scalar(const cv::Vec3f& v);
/// base * (1 + amount * field)
void modulate(Canvas& canvas, const cv::Mat1f& field, float amount);

// ---- texture_surfaces.cpp: tiling surfaces ----

Canvas draw_plain(const Material& m, cv::Size size, std::uint64_t seed);
Canvas draw_plaster(const Material& m, cv::Size size, std::uint64_t seed);
Canvas draw_ceiling(const Material& m, cv::Size size, std::uint64_t seed);
Canvas draw_carpet(const Material& m, cv::Size size, std::uint64_t seed);
Canvas draw_wood(const Material& m, cv::Size size, std::uint64_t seed);
Canvas draw_planks(const Material& m, cv::Size size, std::uint64_t seed);
Canvas draw_brick(const Material& m, cv::Size size, std::uint64_t seed);
Canvas draw_cloth(const Material& m, cv::Size size, std::uint64_t seed);
Canvas draw_fabric(const Material& m, cv::Size size, std::uint64_t seed);
Canvas draw_rug(const Material& m, cv::Size size, std::uint64_t seed);
Canvas draw_door(const Material& m, cv::Size size, std::uint64_t seed);
Canvas draw_tiles(const Material& m, cv::Size size, std::uint64_t seed);
Canvas draw_cardboard(const Material& m, cv::Size size, std::uint64_t seed);
Canvas draw_lino(const Material& m, cv::Size size, std::uint64_t seed);

// ---- texture_prints.cpp: what is printed, written or seen on something, drawn once over a surface ----

Canvas draw_poster(const Material& m, cv::Size size, std::uint64_t seed);
Canvas draw_picture(const Material& m, cv::Size size, std::uint64_t seed);
Canvas draw_whiteboard(const Material& m, cv::Size size, std::uint64_t seed);
Canvas draw_sign(const Material& m, cv::Size size, std::uint64_t seed);
Canvas draw_books(const Material& m, cv::Size size, std::uint64_t seed);
Canvas draw_window(const Material& m, cv::Size size, std::uint64_t seed);
Canvas draw_screen(const Material& m, cv::Size size, std::uint64_t seed);

// ---- texture_tags.cpp ----

/// The AprilTag of number `seed`, with a white border as wide as one of its cells.
Canvas draw_tag(const Material& m, cv::Size size, std::uint64_t seed);

}  // namespace plumbline::synth
