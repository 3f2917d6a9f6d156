// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cmath>

#include "scene/builder.hpp"
#include "scene/random.hpp"

namespace plumbline::synth {

using Eigen::Vector3d;
using geometry::Rigid3;

void add_table(Builder& b, const Rigid3& f, const Vector3d& size, const std::string& material) {
  const double x = 0.5 * size.x(), y = 0.5 * size.y(), h = size.z(), leg = 0.05;
  b.box(f, {-x, -y, h - 0.03}, {x, y, h}, {material});

  // A leg at each corner.
  for (const double sx : {-1.0, 1.0}) {
    for (const double sy : {-1.0, 1.0}) {
      const double cx = sx * (x - leg), cy = sy * (y - leg);
      b.box(f, {cx - 0.5 * leg, cy - 0.5 * leg, 0.0}, {cx + 0.5 * leg, cy + 0.5 * leg, h - 0.03}, {material});
    }
  }
}

void add_desk(Builder& b, const Rigid3& f, const Vector3d& size, const std::string& material) {
  const double x = 0.5 * size.x(), y = 0.5 * size.y(), h = size.z();
  b.box(f, {-x, -y, h - 0.03}, {x, y, h}, {material});
  b.box(f, {-x + 0.02, -y + 0.05, 0.0}, {-x + 0.05, y - 0.03, h - 0.03}, {material});
  b.box(f, {-x + 0.05, y - 0.06, 0.25}, {x - 0.45, y - 0.04, h - 0.03}, {material});
  // Drawers under the right end.
  b.box(f, {x - 0.45, -y + 0.05, 0.04}, {x - 0.03, y - 0.03, h - 0.03}, {"paint_grey"});
  for (int i = 0; i < 3; ++i) {
    const double z0 = 0.06 + i * (h - 0.12) / 3.0, z1 = z0 + (h - 0.12) / 3.0 - 0.015;
    b.box(f, {x - 0.44, -y + 0.035, z0}, {x - 0.04, -y + 0.05, z1}, {material});
    b.box(f, {x - 0.30, -y + 0.01, z1 - 0.06}, {x - 0.18, -y + 0.035, z1 - 0.045}, {"metal"});
  }
}

void add_chair(Builder& b, const Rigid3& f, const std::string& material) {
  b.box(f, {-0.24, -0.23, 0.44}, {0.24, 0.23, 0.51}, {material});
  const Rigid3 back = placed(f, {0.0, 0.22, 0.56}, {-0.15, Vector3d::UnitX()});
  b.box(back, {-0.22, 0.0, 0.0}, {0.22, 0.05, 0.48}, {material});
  b.box(f, {-0.03, 0.20, 0.42}, {0.03, 0.235, 0.60}, {"plastic_black"});

  // Column, base and casters.
  b.cylinder(f, {{0.0, 0.0, 0.08}, 0.028, 0.028, 0.36, 10}, {"metal"});
  for (int i = 0; i < 5; ++i) {
    const Rigid3 arm = placed(f, Vector3d::Zero(), {2.0 * M_PI * i / 5.0 + 0.3, Vector3d::UnitZ()});
    b.box(arm, {0.02, -0.02, 0.06}, {0.30, 0.02, 0.09}, {"plastic_black"});
    b.box(arm, {0.26, -0.02, 0.0}, {0.30, 0.02, 0.06}, {"plastic_black"});
  }

  // Armrests on both sides.
  for (const double s : {-1.0, 1.0}) {
    b.box(f, {s * 0.27 - 0.025, -0.14, 0.66}, {s * 0.27 + 0.025, 0.14, 0.69}, {"plastic_black"});
    b.box(f, {s * 0.27 - 0.015, -0.02, 0.47}, {s * 0.27 + 0.015, 0.02, 0.66}, {"plastic_black"});
  }
}

void add_shelf(Builder& b, const Rigid3& f, const Vector3d& size, const std::string& material, bool books) {
  const double x = 0.5 * size.x(), y = 0.5 * size.y(), h = size.z(), t = 0.022;
  b.box(f, {-x, -y, 0.0}, {-x + t, y, h}, {material});
  b.box(f, {x - t, -y, 0.0}, {x, y, h}, {material});
  b.box(f, {-x + t, y - 0.01, 0.0}, {x - t, y, h}, {material});

  // Boards, about 36 cm apart.
  const int boards = std::max(2, static_cast<int>(std::lround(h / 0.36)) + 1);
  Rng rng(static_cast<std::uint64_t>(b.seed()), 0x5e1f);
  for (int i = 0; i < boards; ++i) {
    const double z = 0.05 + (h - 0.05 - t) * i / (boards - 1);
    b.box(f, {-x + t, -y, z}, {x - t, y - 0.01, z + t}, {material});
    if (!books || i + 1 == boards) continue;

    // Books, with gaps.
    const double room = (h - 0.05 - t) / (boards - 1) - t;
    double at = -x + t + 0.01;
    int run = 0;

    while (at < x - t - 0.08) {
      const double width = std::min(rng.uniform(0.12, 0.42), x - t - 0.01 - at);
      if (rng.uniform() < 0.82) {
        const double height = room * rng.uniform(0.62, 0.92), depth = rng.uniform(0.14, 0.9 * size.y());
        const Skin side{"paper"};
        Skin spines{"books", true, b.seed() * 64 + i * 8 + run};
        b.box(f, {at, -y + 0.02, z + t}, {at + width, std::min(-y + 0.02 + depth, y - 0.02), z + t + height},
              side, &spines);
      }

      at += width + rng.uniform(0.0, 0.08);
      ++run;
    }
  }
}

void add_cabinet(Builder& b, const Rigid3& f, const Vector3d& size, const std::string& material, int doors) {
  const double x = 0.5 * size.x(), y = 0.5 * size.y(), h = size.z();
  b.box(f, {-x, -y + 0.02, 0.05}, {x, y, h}, {material});
  b.box(f, {-x + 0.03, -y + 0.05, 0.0}, {x - 0.03, y, 0.05}, {"plastic_black"});

  // Doors with handles.
  for (int i = 0; i < doors; ++i) {
    const double x0 = -x + size.x() * i / doors + 0.004, x1 = -x + size.x() * (i + 1) / doors - 0.004;
    b.box(f, {x0, -y, 0.06}, {x1, -y + 0.018, h - 0.005}, {material});
    const double hx = i % 2 == 0 ? x1 - 0.05 : x0 + 0.03;
    b.box(f, {hx, -y - 0.03, 0.5 * h - 0.06}, {hx + 0.02, -y, 0.5 * h + 0.06}, {"metal"});
  }
}

void add_sofa(Builder& b, const Rigid3& f, const Vector3d& size, const std::string& material) {
  const double x = 0.5 * size.x(), y = 0.5 * size.y(), h = size.z(), arm = 0.16;
  b.box(f, {-x + arm, -y, 0.08}, {x - arm, y - 0.2, 0.30}, {material});
  b.box(f, {-x, -y, 0.05}, {-x + arm, y, 0.58}, {material});
  b.box(f, {x - arm, -y, 0.05}, {x, y, 0.58}, {material});
  b.box(f, {-x + arm, y - 0.22, 0.05}, {x - arm, y, h}, {material});

  // Cushions for each seat.
  const int cushions = size.x() > 1.3 ? 2 : 1;
  const double width = (size.x() - 2.0 * arm) / cushions;
  for (int i = 0; i < cushions; ++i) {
    const double x0 = -x + arm + width * i + 0.006, x1 = x0 + width - 0.012;
    b.box(f, {x0, -y - 0.01, 0.30}, {x1, y - 0.22, 0.44}, {material});
    const Rigid3 tilted = placed(f, {0.0, y - 0.24, 0.44}, {-0.18, Vector3d::UnitX()});
    b.box(tilted, {x0, -0.12, 0.0}, {x1, 0.0, h - 0.50}, {material});
  }

  // A pillow in the corner.
  const Rigid3 turned = placed(f, {-x + arm + 0.24, y - 0.36, 0.45}, {0.35, Vector3d::UnitZ()});
  const Rigid3 pillow = placed(turned, Vector3d::Zero(), {-0.45, Vector3d::UnitX()});
  b.box(pillow, {-0.2, -0.06, 0.0}, {0.2, 0.05, 0.36}, {"rug"});
}

void add_monitor(Builder& b, const Rigid3& f, double width, bool stand) {
  const double height = width * 0.6, lift = stand ? 0.14 : -0.5 * height;
  const Skin screen{"screen", true};
  b.box(f, {-0.5 * width, -0.03, lift}, {0.5 * width, 0.01, lift + height}, {"plastic_black"});
  b.box(f, {-0.5 * width + 0.015, -0.034, lift + 0.02}, {0.5 * width - 0.015, -0.029, lift + height - 0.015},
        {"plastic_black"}, &screen);
  if (!stand) return;

  // Neck and foot.
  b.box(f, {-0.04, 0.01, 0.02}, {0.04, 0.04, lift + 0.12}, {"plastic_black"});
  b.box(f, {-0.13, -0.08, 0.0}, {0.13, 0.10, 0.015}, {"plastic_black"});
}

void add_plant(Builder& b, const Rigid3& f, double height) {
  const double pot = 0.3 * height;

  // Pot and stem.
  b.cylinder(f, {Vector3d::Zero(), 0.11, 0.15, pot, 16}, {"terracotta"});
  b.cylinder(f, {{0.0, 0.0, pot}, 0.015, 0.008, 0.55 * height, 6}, {"leaf"});
  Rng rng(static_cast<std::uint64_t>(b.seed()), 0x91a7);

  // Leaves around the stem.
  for (int i = 0; i < 22; ++i) {
    const double z = rng.uniform(pot + 0.1 * height, 0.85 * height), yaw = rng.uniform(0.0, 2.0 * M_PI);
    const double length = rng.uniform(0.16, 0.34), width = rng.uniform(0.05, 0.1),
                 rise = rng.uniform(-0.2, 0.9);
    const Rigid3 turned = placed(f, {0.0, 0.0, z}, {yaw, Vector3d::UnitZ()});
    const Rigid3 leaf = placed(turned, Vector3d::Zero(), {-rise, Vector3d::UnitY()});

    const double t = 0.0015;
    for (const double s : {-1.0, 1.0}) {  // both sides of the leaf
      std::vector<Vector3d> p = {{0.02, 0.0, s * t},
                                 {0.35 * length, -0.5 * width, s * t},
                                 {length, 0.0, s * t},
                                 {0.35 * length, 0.5 * width, s * t}};

      // Both sides face outwards.
      if (s < 0.0) std::swap(p[1], p[3]);
      for (Vector3d& corner : p) corner = leaf * corner;
      b.polygon(p, leaf.rotation.col(0), {"leaf"});
    }
  }
}

namespace {
void add_lamp(Builder& b, const Rigid3& f, const Vector3d& center, double hu, double hv, double power) {
  Lamp lamp;
  lamp.center = f * center;
  lamp.half_u = f.rotation * Vector3d(hu, 0.0, 0.0);
  lamp.half_v = f.rotation * Vector3d(0.0, hv, 0.0);
  lamp.normal = f.rotation * Vector3d(0.0, 0.0, -1.0);
  lamp.power = power;
  b.scene().lamps.push_back(lamp);
}
}  // namespace

void add_floor_lamp(Builder& b, const Rigid3& f, double height, double power) {
  b.cylinder(f, {Vector3d::Zero(), 0.14, 0.13, 0.025, 20}, {"metal"});
  b.cylinder(f, {{0.0, 0.0, 0.025}, 0.012, 0.012, height - 0.25, 8}, {"metal"});
  b.cylinder(f, {{0.0, 0.0, height - 0.26}, 0.19, 0.13, 0.26, 20}, {"lampshade"});
  add_lamp(b, f, {0.0, 0.0, height - 0.29}, 0.12, 0.12, power);
}

void add_ceiling_lamp(Builder& b, const Rigid3& f, double width, double depth, double power) {
  b.box(f, {-0.5 * width - 0.02, -0.5 * depth - 0.02, -0.05}, {0.5 * width + 0.02, 0.5 * depth + 0.02, 0.0},
        {"paint_white"});
  b.box(f, {-0.5 * width, -0.5 * depth, -0.06}, {0.5 * width, 0.5 * depth, -0.049}, {"light"});
  add_lamp(b, f, {0.0, 0.0, -0.09}, 0.5 * width, 0.5 * depth, power);
}

void add_clutter(Builder& b, const Rigid3& f, double width, double depth, int count) {
  Rng rng(static_cast<std::uint64_t>(b.seed()), 0xc1077e5);
  static const std::array<const char*, 5> kCovers = {"cover", "paper", "cardboard", "cover", "plastic_blue"};

  for (int i = 0; i < count; ++i) {
    // One thing in each cell of the surface.
    const double cell = width / count;
    const Vector3d at(-0.5 * width + cell * (i + rng.uniform(0.35, 0.65)), rng.uniform(-0.32, 0.32) * depth,
                      0.0);
    const Rigid3 item = placed(f, at, {rng.uniform(-0.6, 0.6), Vector3d::UnitZ()});
    const double kind = rng.uniform();

    // Cups, else books and boxes.
    if (kind < 0.25) {
      const Skin skin{rng.uniform() < 0.5 ? "ceramic" : "plastic_blue"};
      b.cylinder(item, {Vector3d::Zero(), 0.038, 0.042, rng.uniform(0.09, 0.13), 14}, skin);
    } else {
      const double w = std::min(0.5 * cell, rng.uniform(0.07, 0.16)), d = rng.uniform(0.08, 0.14);
      const double h = kind < 0.6 ? rng.uniform(0.015, 0.05) : rng.uniform(0.08, 0.22);

      // Each cover has a different print.
      const Skin cover{kCovers[static_cast<std::size_t>(rng.uniform(0.0, 4.999))], true, b.seed() * 16 + i};
      b.box(item, {-w, -d, 0.0}, {w, d, h}, cover, &cover);
    }
  }
}

void add_curtain(Builder& b, const Rigid3& f, double width, double height, double fold,
                 const std::string& material) {
  const int folds = std::max(2, static_cast<int>(std::lround(width / fold)));
  const double step = width / (2 * folds), deep = 0.5 * fold;
  for (int i = 0; i < 2 * folds; ++i) {
    const double x0 = -0.5 * width + i * step, x1 = x0 + step;
    const double y0 = i % 2 == 0 ? 0.0 : -deep, y1 = i % 2 == 0 ? -deep : 0.0;
    const Vector3d a = f * Vector3d(x0, y0, 0.0), c = f * Vector3d(x1, y1, 0.0);
    const Vector3d up = f.rotation.col(2) * height;
    const Vector3d half = f.rotation.col(1) * 0.0015;

    // Both sides of each pleat.
    b.polygon({a - half, c - half, c + up - half, a + up - half}, c - a, {material});
    b.polygon({c + half, a + half, a + up + half, c + up + half}, a - c, {material});
  }
}

void add_panel(Builder& b, const Rigid3& f, const Panel& panel) {
  const double x = 0.5 * panel.width, z = 0.5 * panel.height;
  const Skin print{panel.print, true}, rim{panel.rim};
  b.box(f, {-x, -panel.thickness, -z}, {x, 0.0, z}, rim, &print);
  if (!panel.bars) return;

  // Bars around the print.
  const double bar = 0.03, out = panel.thickness + 0.012;
  b.box(f, {-x - bar, -out, -z - bar}, {-x, 0.0, z + bar}, rim);
  b.box(f, {x, -out, -z - bar}, {x + bar, 0.0, z + bar}, rim);
  b.box(f, {-x, -out, z}, {x, 0.0, z + bar}, rim);
  b.box(f, {-x, -out, -z - bar}, {x, 0.0, -z}, rim);
}

}  // namespace plumbline::synth
