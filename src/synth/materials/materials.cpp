// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>

#include "materials/texture_draw.hpp"
#include "plumbline/synth/scene.hpp"

namespace plumbline::synth {

namespace {
// name, drawn by, r, g, b, tile m, pixels, infrared, gloss, glow, large
constexpr std::array kMaterials = {
    Material{"brick", draw_brick, 0.55F, 0.28F, 0.20F, 1.0, 512, 0.5F, 0.0F, 0.0F, true},
    Material{"cardboard", draw_cardboard, 0.55F, 0.40F, 0.24F, 1.0, 512, 0.6F, 0.0F, 0.0F, false},
    Material{"carpet", draw_carpet, 0.22F, 0.25F, 0.32F, 0.8, 512, 0.4F, 0.0F, 0.0F, true},
    Material{"ceiling", draw_ceiling, 0.78F, 0.78F, 0.75F, 1.2, 512, 0.8F, 0.0F, 0.0F, true},
    Material{"ceramic", draw_plain, 0.80F, 0.80F, 0.76F, 0.3, 64, 0.7F, 0.3F, 0.0F, false},
    Material{"cloth", draw_cloth, 0.80F, 0.79F, 0.74F, 3.2, 1024, 0.8F, 0.0F, 0.0F, true},
    Material{"cover", draw_poster, 0.5F, 0.4F, 0.35F, 0.25, 128, 0.5F, 0.1F, 0.0F, false},
    Material{"curtain", draw_fabric, 0.60F, 0.33F, 0.25F, 0.4, 256, 0.5F, 0.0F, 0.0F, false},
    Material{"door", draw_door, 0.55F, 0.38F, 0.22F, 2.0, 512, 0.5F, 0.1F, 0.0F, false},
    Material{"fabric", draw_fabric, 0.16F, 0.22F, 0.38F, 0.3, 256, 0.35F, 0.0F, 0.0F, false},
    Material{"hall", draw_plain, 0.66F, 0.64F, 0.60F, 4.0, 512, 0.6F, 0.0F, 0.0F, true},
    Material{"lampshade", draw_fabric, 0.85F, 0.76F, 0.60F, 0.3, 128, 0.6F, 0.0F, 0.8F, false},
    Material{"leaf", draw_fabric, 0.14F, 0.32F, 0.11F, 0.2, 128, 0.6F, 0.1F, 0.0F, false},
    Material{"light", draw_plain, 0.95F, 0.95F, 0.90F, 0.5, 64, 0.0F, 0.0F, 6.0F, false},
    Material{"lino", draw_lino, 0.30F, 0.31F, 0.32F, 1.6, 512, 0.4F, 0.1F, 0.0F, true},
    Material{"metal", draw_cardboard, 0.45F, 0.46F, 0.48F, 0.4, 256, 0.3F, 0.8F, 0.0F, false},
    Material{"paint_blue", draw_plaster, 0.35F, 0.48F, 0.58F, 1.6, 512, 0.6F, 0.0F, 0.0F, true},
    Material{"paint_green", draw_plaster, 0.50F, 0.58F, 0.42F, 1.6, 512, 0.6F, 0.0F, 0.0F, true},
    Material{"paint_grey", draw_plain, 0.55F, 0.56F, 0.57F, 0.6, 256, 0.6F, 0.1F, 0.0F, false},
    Material{"paint_white", draw_plain, 0.82F, 0.82F, 0.80F, 0.6, 256, 0.8F, 0.1F, 0.0F, false},
    Material{"paper", draw_plain, 0.80F, 0.78F, 0.72F, 0.25, 128, 0.8F, 0.0F, 0.0F, false},
    Material{"picture", draw_picture, 0.5F, 0.5F, 0.5F, 1.0, 512, 0.5F, 0.2F, 0.0F, false},
    Material{"plaster", draw_plaster, 0.74F, 0.71F, 0.64F, 1.6, 512, 0.8F, 0.0F, 0.0F, true},
    Material{"plastic_black", draw_plain, 0.035F, 0.035F, 0.04F, 0.3, 64, 0.06F, 0.3F, 0.0F, false},
    Material{"plastic_blue", draw_plain, 0.10F, 0.22F, 0.52F, 0.3, 64, 0.4F, 0.3F, 0.0F, false},
    Material{"poster", draw_poster, 0.6F, 0.6F, 0.6F, 1.0, 512, 0.7F, 0.1F, 0.0F, false},
    Material{"poster_wall", draw_poster, 0.6F, 0.6F, 0.6F, 1.2, 1024, 0.7F, 0.0F, 0.0F, true},
    Material{"rug", draw_rug, 0.45F, 0.20F, 0.16F, 1.0, 512, 0.4F, 0.0F, 0.0F, false},
    Material{"screen", draw_screen, 0.10F, 0.12F, 0.16F, 0.6, 512, 0.03F, 0.6F, 0.9F, false},
    Material{"sign", draw_sign, 0.7F, 0.7F, 0.7F, 0.3, 256, 0.7F, 0.1F, 0.0F, false},
    Material{"sofa", draw_fabric, 0.34F, 0.36F, 0.30F, 0.4, 256, 0.4F, 0.0F, 0.0F, false},
    Material{"tag", draw_tag, 0.5F, 0.5F, 0.5F, 0.2, 512, 0.7F, 0.0F, 0.0F, false, true},
    Material{"terracotta", draw_plain, 0.50F, 0.24F, 0.14F, 0.4, 128, 0.5F, 0.0F, 0.0F, false},
    Material{"tiles", draw_tiles, 0.62F, 0.60F, 0.55F, 1.2, 512, 0.6F, 0.3F, 0.0F, true},
    Material{"books", draw_books, 0.4F, 0.3F, 0.25F, 0.5, 256, 0.5F, 0.0F, 0.0F, false},
    Material{"whiteboard", draw_whiteboard, 0.85F, 0.86F, 0.86F, 1.8, 1024, 0.8F, 0.5F, 0.0F, false},
    Material{"window_view", draw_window, 0.8F, 0.85F, 0.9F, 1.2, 512, 0.0F, 0.9F, 1.3F, false},
    Material{"wood", draw_wood, 0.56F, 0.39F, 0.23F, 1.0, 512, 0.6F, 0.1F, 0.0F, false},
    Material{"wood_dark", draw_wood, 0.26F, 0.15F, 0.08F, 1.0, 512, 0.4F, 0.1F, 0.0F, false},
    Material{"planks", draw_planks, 0.50F, 0.33F, 0.19F, 1.6, 1024, 0.5F, 0.15F, 0.0F, true},
};
}  // namespace

const Material* find_material(const std::string& name) {
  for (const Material& material : kMaterials) {
    if (name == material.name) return &material;
  }
  return nullptr;
}

const std::vector<std::string>& material_names() {
  static const std::vector<std::string> kNames = [] {
    std::vector<std::string> names;
    for (const Material& material : kMaterials) names.emplace_back(material.name);
    std::sort(names.begin(), names.end());
    return names;
  }();
  return kNames;
}

}  // namespace plumbline::synth
