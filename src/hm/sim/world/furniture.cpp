#include "hm/sim/world/furniture.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace hm {

void add_table(const Place& place, const Size& size, HouseMaterial top, double leg_m) {
  const double x = size.width_m / 2, y = size.depth_m / 2, h = size.height_m;
  place.box(top, {-x, -y, h - 0.03}, {x, y, h});
  for (const double sx : {-1.0, 1.0}) {
    for (const double sy : {-1.0, 1.0}) {
      const double cx = sx * (x - 0.06), cy = sy * (y - 0.06), r = leg_m / 2;
      place.box(top, {cx - r, cy - r, 0}, {cx + r, cy + r, h - 0.03});
    }
    place.box(top, {sx * (x - 0.06) - 0.01, -y + 0.08, h - 0.1},
              {sx * (x - 0.06) + 0.01, y - 0.08, h - 0.03});
    place.box(top, {-x + 0.08, sx * (y - 0.06) - 0.01, h - 0.1},
              {x - 0.08, sx * (y - 0.06) + 0.01, h - 0.03});
  }
}

void add_chair(const Place& place, HouseMaterial wood, HouseMaterial seat) {
  constexpr double kHalf_m = 0.21, kLeg_m = 0.016;
  place.box(seat, {-kHalf_m, -kHalf_m, 0.43}, {kHalf_m, kHalf_m, 0.47});
  for (const double sx : {-1.0, 1.0}) {
    const double x = sx * (kHalf_m - 0.02);
    place.box(wood, {x - kLeg_m, 0.17, 0}, {x + kLeg_m, 0.17 + 2 * kLeg_m, 0.43});
    place.box(wood, {x - kLeg_m, -0.21, 0}, {x + kLeg_m, -0.21 + 2 * kLeg_m, 0.43});
    place.box(wood, {x - kLeg_m, -0.21, 0.47}, {x + kLeg_m, -0.21 + 2 * kLeg_m, 0.92});
    place.box(wood, {x - 0.01, -0.17, 0.2}, {x + 0.01, 0.17, 0.23});
  }
  for (const double z : {0.58, 0.7, 0.82}) place.box(wood, {-0.17, -0.205, z}, {0.17, -0.185, z + 0.07});
}

void add_stool(const Place& place, double height_m) {
  place.cone(HouseMaterial::kChairSeat, {Vec3(0, 0, height_m - 0.05), Vec3(0, 0, height_m), 0.16, 0.17, 20});
  for (int i = 0; i < 4; ++i) {
    const double a = std::numbers::pi * (0.25 + 0.5 * i), c = std::cos(a), s = std::sin(a);
    place.rod(HouseMaterial::kSteel, {0.19 * c, 0.19 * s, 0}, {0.12 * c, 0.12 * s, height_m - 0.05}, 0.013);
    const double b = a + std::numbers::pi / 2;
    place.rod(HouseMaterial::kSteel, {0.167 * c, 0.167 * s, 0.25},
              {0.167 * std::cos(b), 0.167 * std::sin(b), 0.25}, 0.009);
  }
}

void add_office_chair(const Place& place) {
  for (int i = 0; i < 5; ++i) {
    const double a = 2 * std::numbers::pi * i / 5;
    place.rod(HouseMaterial::kSteel, {0, 0, 0.1}, {0.3 * std::cos(a), 0.3 * std::sin(a), 0.07}, 0.018);
    place.ellipsoid(HouseMaterial::kSteel, {0.3 * std::cos(a), 0.3 * std::sin(a), 0.03}, {0.03, 0.03, 0.03});
  }
  place.rod(HouseMaterial::kSteel, {0, 0, 0.08}, {0, 0, 0.44}, 0.025);
  place.box(HouseMaterial::kSofa, {-0.24, -0.24, 0.44}, {0.24, 0.24, 0.51});
  place.box(HouseMaterial::kSteel, {-0.03, -0.27, 0.44}, {0.03, -0.24, 0.7});
  place.box(HouseMaterial::kSofa, {-0.22, -0.27, 0.62}, {0.22, -0.21, 1.1});
}

void add_sofa(const Place& place, double width_m, HouseMaterial cloth) {
  const double x = width_m / 2;
  place.box(cloth, {-x, 0.02, 0.1}, {x, 0.88, 0.32});
  place.box(cloth, {-x, 0.02, 0.32}, {x, 0.24, 0.82});
  for (const double s : {-1.0, 1.0}) {
    place.box(cloth, {std::min(s * x, s * (x - 0.18)), 0.24, 0.32},
              {std::max(s * x, s * (x - 0.18)), 0.88, 0.6});
    for (const double y : {0.1, 0.8})
      place.rod(HouseMaterial::kWalnut, {s * (x - 0.1), y, 0}, {s * (x - 0.1), y, 0.1}, 0.02);
  }
  const int seats = std::max(1, static_cast<int>(std::lround((width_m - 0.36) / 0.7)));
  const double step = (width_m - 0.36) / seats;
  for (int i = 0; i < seats; ++i) {
    const double left = -x + 0.18 + i * step;
    place.box(cloth, {left + 0.01, 0.26, 0.32}, {left + step - 0.01, 0.9, 0.46});
    if (i % 2 == 0)
      place.ellipsoid(HouseMaterial::kCushion, {left + step / 2, 0.36, 0.64}, {0.22, 0.11, 0.2});
  }
}

void add_bed(const Place& place, double width_m, double length_m) {
  const double x = width_m / 2;
  place.box(HouseMaterial::kOak, {-x, 0.02, 0.0}, {x, 0.07, 1.0});
  place.box(HouseMaterial::kOak, {-x, 0.07, 0.16}, {x, length_m, 0.32});
  for (const double s : {-1.0, 1.0})
    place.box(HouseMaterial::kOak, {s * (x - 0.05) - 0.035, length_m - 0.1, 0},
              {s * (x - 0.05) + 0.035, length_m - 0.03, 0.16});
  place.box(HouseMaterial::kBedding, {-x + 0.03, 0.09, 0.32}, {x - 0.03, length_m - 0.03, 0.52});
  place.box(HouseMaterial::kBlanket, {-x - 0.02, 0.75, 0.24}, {x + 0.02, length_m - 0.01, 0.56});
  const int pillows = width_m > 1.2 ? 2 : 1;
  for (int i = 0; i < pillows; ++i)
    place.ellipsoid(HouseMaterial::kPillow, {(i + 0.5) * width_m / pillows - x, 0.38, 0.58},
                    {0.32, 0.22, 0.1});
}

void add_bookshelf(const Place& place, const Size& size, HouseMaterial wood) {
  const double x = size.width_m / 2, d = size.depth_m, h = size.height_m, t = 0.022;
  place.box(wood, {-x, 0.02, 0}, {-x + t, d, h});
  place.box(wood, {x - t, 0.02, 0}, {x, d, h});
  place.box(wood, {-x + t, 0.02, 0.04}, {x - t, 0.03, h});
  Rng& rng = place.builder->rng();
  const int shelves = std::max(2, static_cast<int>(h / 0.36));
  for (int i = 0; i <= shelves; ++i) {
    const double z = 0.04 + (h - 0.04 - t) * i / shelves;
    place.box(wood, {-x + t, 0.03, z}, {x - t, d, z + t});
    if (i == shelves) break;
    double at = -x + t + 0.01;
    while (at < x - 0.25) {
      const double run = rng.uniform(0.15, 0.4), tall = rng.uniform(0.18, 0.28);
      const double end = std::min(at + run, x - t - 0.01), kind = rng.uniform();
      if (kind < 0.72) {
        place.box(HouseMaterial::kBooks, {at, 0.04, z + t}, {end, d - rng.uniform(0.03, 0.08), z + t + tall});
      } else if (kind < 0.86) {
        place.ellipsoid(HouseMaterial::kPorcelain, {at + 0.1, d / 2, z + t + 0.08}, {0.07, 0.07, 0.08});
      } else {
        place.box(HouseMaterial::kPlasticRed, {at, 0.06, z + t}, {at + 0.16, d - 0.05, z + t + 0.12});
      }
      at = end + rng.uniform(0.01, 0.1);
    }
  }
}

void add_wardrobe(const Place& place, const Size& size, HouseMaterial wood) {
  const double x = size.width_m / 2, d = size.depth_m, h = size.height_m;
  place.box(wood, {-x, 0.02, 0.06}, {x, d - 0.02, h});
  place.box(HouseMaterial::kWalnut, {-x + 0.03, 0.02, 0}, {x - 0.03, d - 0.06, 0.06});
  const int doors = std::max(2, static_cast<int>(std::lround(size.width_m / 0.55)));
  for (int i = 0; i < doors; ++i) {
    const double left = -x + size.width_m * i / doors, right = -x + size.width_m * (i + 1) / doors;
    place.box(wood, {left + 0.006, d - 0.02, 0.08}, {right - 0.006, d, h - 0.01});
    const double knob = i % 2 == 0 ? right - 0.06 : left + 0.06;
    place.rod(HouseMaterial::kBrass, {knob, d + 0.025, 0.95}, {knob, d + 0.025, 1.15}, 0.008);
    for (const double z : {0.97, 1.13})
      place.rod(HouseMaterial::kBrass, {knob, d, z}, {knob, d + 0.025, z}, 0.006);
  }
}

void add_cabinet(const Place& place, const Size& size, HouseMaterial wood, HouseMaterial top) {
  const double x = size.width_m / 2, d = size.depth_m, h = size.height_m;
  place.box(HouseMaterial::kWalnut, {-x + 0.02, 0.02, 0}, {x - 0.02, d - 0.06, 0.08});
  place.box(wood, {-x, 0.02, 0.08}, {x, d - 0.02, h - 0.035});
  place.box(top, {-x - 0.005, 0.02, h - 0.035}, {x + 0.005, d + 0.015, h});
  const int fronts = std::max(1, static_cast<int>(std::lround(size.width_m / 0.5)));
  for (int i = 0; i < fronts; ++i) {
    const double left = -x + size.width_m * i / fronts, right = -x + size.width_m * (i + 1) / fronts;
    const double split = i % 2 == 0 || h < 0.75 ? 0.1 : 0.55;
    place.box(wood, {left + 0.005, d - 0.02, split + 0.005}, {right - 0.005, d, h - 0.05});
    if (split > 0.2) place.box(wood, {left + 0.005, d - 0.02, 0.1}, {right - 0.005, d, split - 0.005});
    place.rod(HouseMaterial::kSteel, {left + 0.12, d + 0.02, h - 0.11}, {right - 0.12, d + 0.02, h - 0.11},
              0.007);
  }
}

void add_plant(const Place& place, double height_m) {
  place.cone(HouseMaterial::kPot, {Vec3(0, 0, 0), Vec3(0, 0, 0.3), 0.12, 0.17, 20});
  place.cone(HouseMaterial::kSoil, {Vec3(0, 0, 0.3), Vec3(0, 0, 0.305), 0.15, 0.15, 20});
  Rng& rng = place.builder->rng();
  for (int stem = 0; stem < 7; ++stem) {
    const double angle = 2 * std::numbers::pi * (stem + rng.uniform(0.0, 0.6)) / 7;
    const double tall = height_m * rng.uniform(0.65, 1.0), lean = rng.uniform(0.06, 0.24);
    const Vec3 out(std::cos(angle), std::sin(angle), 0), foot = 0.05 * out + Vec3(0, 0, 0.3);
    const Vec3 tip = out * (0.05 + lean) + Vec3(0, 0, tall);
    place.cone(HouseMaterial::kStem, {foot, tip, 0.008, 0.005, 6});
    const Vec3 side = Vec3(0, 0, 1).cross(out);
    for (int leaf = 0; leaf < 5; ++leaf) {
      const Vec3 at = foot + (tip - foot) * (0.35 + 0.16 * leaf);
      const double length = rng.uniform(0.12, 0.2), sideways = leaf % 2 == 0 ? 0.7 : -0.7;
      const Vec3 along = (out * 0.7 + side * sideways + Vec3(0, 0, rng.uniform(0.0, 0.6))).normalized();
      const Vec3 across = along.cross(Vec3(0, 0, 1)).normalized() * 0.035;
      const std::array<Vec3, 4> blade = {place.world(at), place.world(at + 0.5 * length * along + across),
                                         place.world(at + length * along),
                                         place.world(at + 0.5 * length * along - across)};
      const Vec3 normal = (blade[1] - blade[0]).cross(blade[2] - blade[0]).normalized();
      append_prism(place.builder->mesh(HouseMaterial::kLeaf), blade, 0.003 * normal);
    }
  }
}

void add_floor_lamp(const Place& place) {
  place.cone(HouseMaterial::kBrass, {Vec3(0, 0, 0), Vec3(0, 0, 0.025), 0.15, 0.14, 24});
  place.rod(HouseMaterial::kBrass, {0, 0, 0.025}, {0, 0, 1.5}, 0.012);
  place.cone(HouseMaterial::kShade, {Vec3(0, 0, 1.4), Vec3(0, 0, 1.68), 0.2, 0.13, 24});
}

void add_table_lamp(const Place& place) {
  place.ellipsoid(HouseMaterial::kPorcelain, {0, 0, 0.1}, {0.07, 0.07, 0.1});
  place.rod(HouseMaterial::kBrass, {0, 0, 0.15}, {0, 0, 0.28}, 0.008);
  place.cone(HouseMaterial::kShade, {Vec3(0, 0, 0.25), Vec3(0, 0, 0.42), 0.14, 0.09, 20});
}

void add_pendant(const Place& place) {
  place.cone(HouseMaterial::kBrass, {Vec3(0, 0, 2.67), Vec3(0, 0, 2.7), 0.06, 0.06, 16});
  place.rod(HouseMaterial::kBrass, {0, 0, 2.36}, {0, 0, 2.67}, 0.008);
  place.cone(HouseMaterial::kShade, {Vec3(0, 0, 2.18), Vec3(0, 0, 2.36), 0.2, 0.08, 24});
}

void add_picture(const Place& place, double width_m, double height_m, HouseMaterial painting) {
  const double x = width_m / 2, f = 0.035;
  place.box(painting, {-x + f, 0, f}, {x - f, 0.015, height_m - f});
  place.box(HouseMaterial::kFrame, {-x, 0, 0}, {x, 0.03, f});
  place.box(HouseMaterial::kFrame, {-x, 0, height_m - f}, {x, 0.03, height_m});
  place.box(HouseMaterial::kFrame, {-x, 0, f}, {-x + f, 0.03, height_m - f});
  place.box(HouseMaterial::kFrame, {x - f, 0, f}, {x, 0.03, height_m - f});
}

void add_curtains(const Place& place, double width_m) {
  const double x = width_m / 2 + 0.3;
  place.rod(HouseMaterial::kBrass, {-x - 0.05, 0.09, 2.42}, {x + 0.05, 0.09, 2.42}, 0.014);
  for (const double s : {-1.0, 1.0}) {
    for (int fold = 0; fold < 6; ++fold) {
      const double at = s * (x - 0.04 - 0.07 * fold);
      place.rod(HouseMaterial::kCurtain, {at, 0.09, 0.06}, {at, 0.09, 2.38}, fold % 2 == 0 ? 0.045 : 0.035);
    }
  }
}

void add_radiator(const Place& place, double width_m) {
  const double x = width_m / 2;
  place.box(HouseMaterial::kRadiator, {-x, 0.05, 0.14}, {x, 0.075, 0.68});
  const int fins = static_cast<int>(width_m / 0.06);
  for (int i = 0; i < fins; ++i) {
    const double at = -x + 0.03 + (width_m - 0.06) * i / (fins - 1);
    place.box(HouseMaterial::kRadiator, {at - 0.015, 0.075, 0.16}, {at + 0.015, 0.11, 0.66});
  }
  for (const double s : {-1.0, 1.0})
    place.rod(HouseMaterial::kRadiator, {s * (x - 0.05), 0.06, 0}, {s * (x - 0.05), 0.06, 0.14}, 0.012);
}

void add_screen(const Place& place, double width_m) {
  const double x = width_m / 2, h = width_m * 0.58;
  place.box(HouseMaterial::kBlackGlass, {-x, 0.03, 0.08}, {x, 0.06, 0.08 + h});
  place.box(HouseMaterial::kSteel, {-0.03, 0.0, 0.0}, {0.03, 0.03, 0.1 + h / 2});
  place.box(HouseMaterial::kSteel, {-x / 3, -0.02, 0.0}, {x / 3, 0.12, 0.012});
}

void add_railing(const Place& place, double length_m) {
  const int steps = std::max(2, static_cast<int>(std::lround(length_m / 0.11)));
  for (int i = 0; i <= steps; ++i) {
    const double x = length_m * i / steps;
    const bool post = i == 0 || i == steps;
    place.rod(post ? HouseMaterial::kWalnut : HouseMaterial::kWhiteWood, {x, 0, 0}, {x, 0, 0.9},
              post ? 0.03 : 0.01);
  }
  place.box(HouseMaterial::kWalnut, {-0.04, -0.03, 0.9}, {length_m + 0.04, 0.03, 0.95});
}

void add_objects(const Place& place, double width_m, double depth_m) {
  Rng& rng = place.builder->rng();
  const int count = std::max(2, static_cast<int>(width_m / 0.3));
  for (int i = 0; i < count; ++i) {
    const double x = width_m * ((i + 0.5) / count - 0.5) + rng.uniform(-0.04, 0.04);
    const double y = rng.uniform(-0.3, 0.3) * depth_m, kind = rng.uniform();
    if (kind < 0.3) {
      const double r = rng.uniform(0.04, 0.07);
      place.cone(HouseMaterial::kPorcelain, {Vec3(x, y, 0), Vec3(x, y, 1.5 * r), 0.6 * r, r, 20});
      place.cone(HouseMaterial::kPorcelain, {Vec3(x, y, 1.5 * r), Vec3(x, y, 3.2 * r), r, 0.4 * r, 20});
      place.cone(HouseMaterial::kPorcelain, {Vec3(x, y, 3.2 * r), Vec3(x, y, 3.7 * r), 0.4 * r, 0.6 * r, 20});
    } else if (kind < 0.55) {
      const double h = rng.uniform(0.03, 0.09);
      place.box(HouseMaterial::kBooks, {x - 0.1, y - 0.07, 0}, {x + 0.1, y + 0.07, h});
    } else if (kind < 0.75) {
      place.cone(HouseMaterial::kPlasticBlue, {Vec3(x, y, 0), Vec3(x, y, 0.09), 0.03, 0.04, 16});
    } else if (kind < 0.9) {
      place.cone(HouseMaterial::kPot, {Vec3(x, y, 0), Vec3(x, y, 0.07), 0.06, 0.11, 20});
    } else {
      place.ellipsoid(HouseMaterial::kPlasticRed, {x, y, 0.04}, {0.04, 0.04, 0.04});
    }
  }
}

}  // namespace hm
