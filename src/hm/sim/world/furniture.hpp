#pragma once
#include "hm/sim/world/house_builder.hpp"

namespace hm {

// Furniture, each in its own frame (see Place). Sizes in metres. Table, chair, stool, plant, floor lamp and
// pendant are centred; all others have their back at y = 0.

/// Width (x), depth (y) and height (z) of a piece of furniture.
struct Size {
  double width_m = 1, depth_m = 0.5, height_m = 1;
};

void add_table(const Place& place, const Size& size, HouseMaterial top, double leg_m);
void add_chair(const Place& place, HouseMaterial wood, HouseMaterial seat);
void add_stool(const Place& place, double height_m);
void add_office_chair(const Place& place);
void add_sofa(const Place& place, double width_m, HouseMaterial cloth);
void add_bed(const Place& place, double width_m, double length_m);
void add_bookshelf(const Place& place, const Size& size, HouseMaterial wood);
void add_wardrobe(const Place& place, const Size& size, HouseMaterial wood);
void add_cabinet(const Place& place, const Size& size, HouseMaterial wood, HouseMaterial top);
void add_plant(const Place& place, double height_m);
void add_floor_lamp(const Place& place);
void add_table_lamp(const Place& place);
void add_pendant(const Place& place);
/// Adds a picture with its lower edge at place.at.z().
void add_picture(const Place& place, double width_m, double height_m, HouseMaterial painting);
void add_curtains(const Place& place, double width_m);
void add_radiator(const Place& place, double width_m);
void add_screen(const Place& place, double width_m);
/// Adds a railing from place.at along x: posts, balusters of 2 cm and a handrail.
void add_railing(const Place& place, double length_m);
/// Adds a few vases, bowls and books on a surface of this size around place.at.
void add_objects(const Place& place, double width_m, double depth_m);

}  // namespace hm
