// Placement of furniture in the house, room by room, clear of the paths of house_tours.cpp.
#include <cmath>
#include <numbers>

#include "hm/sim/world/furniture.hpp"
#include "hm/sim/world/house_plan.hpp"

namespace hm {
namespace {

constexpr double kQuarter_rad = std::numbers::pi / 2;

/// Places in a room by the wall at their back.
struct RoomPlacer {
  HouseBuilder& builder;
  const RoomPlan& room;
  [[nodiscard]] Place south(double x, double z = 0) const { return {&builder, Vec3(x, room.y0, z), 0}; }
  [[nodiscard]] Place north(double x, double z = 0) const {
    return {&builder, Vec3(x, room.y1, z), 2 * kQuarter_rad};
  }
  [[nodiscard]] Place west(double y, double z = 0) const {
    return {&builder, Vec3(room.x0, y, z), -kQuarter_rad};
  }
  [[nodiscard]] Place east(double y, double z = 0) const {
    return {&builder, Vec3(room.x1, y, z), kQuarter_rad};
  }
  [[nodiscard]] Place free(double x, double y, double yaw_rad = 0, double z = 0) const {
    return {&builder, Vec3(x, y, z), yaw_rad};
  }
};

void furnish_living(const RoomPlacer& in) {
  in.free(2.3, 2.0).box(HouseMaterial::kRug, {-1.5, -0.9, 0}, {1.5, 0.9, 0.012});
  add_sofa(in.south(2.2), 2.4, HouseMaterial::kSofa);
  add_sofa(in.west(2.3), 0.95, HouseMaterial::kCushion);
  add_table(in.free(2.3, 1.75), {1.1, 0.6, 0.42}, HouseMaterial::kOak, 0.035);
  add_objects(in.free(2.3, 1.75, 0, 0.42), 0.9, 0.4);
  add_cabinet(in.north(2.2), {1.9, 0.42, 0.5}, HouseMaterial::kWhiteWood, HouseMaterial::kWalnut);
  add_screen(in.north(2.2, 0.5), 1.25);
  add_bookshelf(in.west(5.2), {1.7, 0.3, 2.1}, HouseMaterial::kOak);
  add_bookshelf(in.north(4.4), {1.2, 0.3, 1.4}, HouseMaterial::kOak);
  add_objects(in.north(4.4, 1.4), 1.0, 0.0);
  // The reading corner: a platform with a railing.
  in.free(6.6, 1.15).box(HouseMaterial::kOak, {-1.3, -1.15, 0}, {1.34, 1.0, 0.18});
  add_railing(in.free(5.35, 2.1, 0, 0.18), 1.3);
  add_railing(in.free(5.35, 0.1, kQuarter_rad, 0.18), 1.95);
  add_sofa(in.east(0.75, 0.18), 0.9, HouseMaterial::kSofa);
  add_floor_lamp(in.free(7.6, 1.75, 0, 0.18));
  add_plant(in.free(5.75, 0.45, 0, 0.18), 1.3);
  add_plant(in.free(0.4, 3.4), 1.5);
  add_floor_lamp(in.free(0.45, 0.5));
  add_picture(in.south(4.4, 1.3), 0.9, 0.65, HouseMaterial::kPaintingA);
  add_picture(in.east(5.6, 1.2), 1.0, 0.8, HouseMaterial::kPaintingB);
  add_picture(in.west(3.75, 1.4), 0.5, 0.6, HouseMaterial::kPaintingC);
  add_curtains(in.south(2.2), 1.8);
  add_curtains(in.south(6.4), 1.6);
  add_pendant(in.free(3.0, 2.2));
}

void furnish_dining(const RoomPlacer& in) {
  const Place table = in.free(10.2, 3.0);
  add_table(table, {1.0, 2.0, 0.75}, HouseMaterial::kWalnut, 0.04);
  add_objects(in.free(10.2, 3.0, kQuarter_rad, 0.75), 1.5, 0.5);
  for (const double y : {2.4, 3.0, 3.6}) {
    add_chair(in.free(9.62, y, -kQuarter_rad), HouseMaterial::kWalnut, HouseMaterial::kChairSeat);
    add_chair(in.free(10.78, y, kQuarter_rad), HouseMaterial::kWalnut, HouseMaterial::kChairSeat);
  }
  add_chair(in.free(10.2, 1.85, 0), HouseMaterial::kWalnut, HouseMaterial::kChairSeat);
  add_cabinet(in.east(2.6), {1.8, 0.42, 0.85}, HouseMaterial::kWalnut, HouseMaterial::kWalnut);
  add_objects(in.east(2.6, 0.85), 1.6, 0.0);
  add_picture(in.east(2.6, 1.3), 1.3, 0.8, HouseMaterial::kPaintingC);
  add_picture(in.west(1.4, 1.2), 0.7, 0.9, HouseMaterial::kPaintingA);
  add_plant(in.free(8.45, 0.45), 1.6);
  add_plant(in.free(12.0, 6.15), 1.2);
  add_radiator(in.south(9.4), 0.9);
  add_pendant(in.free(10.2, 3.0));
  add_picture(in.north(11.3, 1.3), 0.8, 0.6, HouseMaterial::kPaintingB);
}

void furnish_kitchen(const RoomPlacer& in) {
  add_cabinet(in.east(2.2), {3.1, 0.6, 0.9}, HouseMaterial::kWhiteWood, HouseMaterial::kGranite);
  add_cabinet(in.south(13.9), {2.6, 0.6, 0.9}, HouseMaterial::kWhiteWood, HouseMaterial::kGranite);
  in.east(3.1, 0.9).box(HouseMaterial::kBlackGlass, {-0.29, 0.06, 0}, {0.29, 0.56, 0.006});
  in.east(3.1).box(HouseMaterial::kBlackGlass, {-0.27, 0.6, 0.2}, {0.27, 0.61, 0.65});
  const Place wall_units = in.east(1.55, 1.45);
  for (const double x : {-0.9, -0.3, 0.3, 0.9})
    wall_units.box(HouseMaterial::kWhiteWood, {x - 0.295, 0, 0}, {x + 0.295, 0.34, 0.7});
  const Place hood = in.east(3.1, 1.55);
  hood.box(HouseMaterial::kSteel, {-0.3, 0, 0}, {0.3, 0.45, 0.08});
  hood.box(HouseMaterial::kSteel, {-0.12, 0, 0.08}, {0.12, 0.25, 1.15});
  in.east(4.25).box(HouseMaterial::kSteel, {-0.32, 0.02, 0.0}, {0.32, 0.65, 1.85});
  in.east(4.25).rod(HouseMaterial::kSteel, {0.24, 0.69, 0.8}, {0.24, 0.69, 1.4}, 0.012);
  const Place sink = in.south(13.6, 0.9);
  sink.box(HouseMaterial::kSteel, {-0.35, 0.1, 0}, {0.35, 0.5, 0.012});
  sink.rod(HouseMaterial::kSteel, {0, 0.08, 0}, {0, 0.08, 0.26}, 0.013);
  sink.rod(HouseMaterial::kSteel, {0, 0.08, 0.26}, {0, 0.25, 0.24}, 0.011);
  add_objects(in.south(14.6, 0.9), 0.8, 0.0);
  add_objects({&in.builder, Vec3(15.6, 1.6, 0.9), kQuarter_rad}, 1.2, 0.2);
  add_table(in.free(12.9, 2.9), {0.55, 1.4, 1.0}, HouseMaterial::kOak, 0.04);
  add_stool(in.free(13.25, 2.5), 0.7);
  add_stool(in.free(13.25, 3.2), 0.7);
  in.west(1.3, 1.3).box(HouseMaterial::kOak, {-0.5, 0, 0}, {0.5, 0.22, 0.025});
  add_objects({&in.builder, Vec3(12.68, 1.3, 1.325), -kQuarter_rad}, 0.9, 0.1);
  add_picture(in.west(3.9 - 0.4, 1.5), 0.5, 0.5, HouseMaterial::kPoster);
  add_pendant(in.free(12.95, 2.9));
}

void furnish_study(const RoomPlacer& in) {
  add_table(in.free(19.55, 2.7), {0.8, 1.8, 0.74}, HouseMaterial::kOak, 0.04);
  add_screen(in.east(2.9, 0.74), 0.62);
  add_screen(in.east(2.2, 0.74), 0.5);
  add_table_lamp(in.free(19.7, 3.45, 0, 0.74));
  add_office_chair(in.free(18.85, 2.7, -kQuarter_rad));
  add_bookshelf(in.west(2.0), {1.6, 0.3, 2.2}, HouseMaterial::kWalnut);
  add_bookshelf(in.west(3.8), {1.6, 0.3, 2.2}, HouseMaterial::kWalnut);
  add_bookshelf(in.south(16.75), {1.0, 0.3, 2.2}, HouseMaterial::kWalnut);
  add_sofa(in.east(5.6), 0.95, HouseMaterial::kChairSeat);
  add_plant(in.free(19.6, 0.45), 1.4);
  add_radiator(in.south(17.9), 0.9);
  add_cabinet(in.north(19.1), {1.2, 0.4, 0.8}, HouseMaterial::kBlackLacquer, HouseMaterial::kBlackLacquer);
  add_picture(in.north(19.1, 1.3), 0.9, 0.7, HouseMaterial::kPaintingC);
  add_picture(in.east(1.3, 1.4), 0.6, 0.45, HouseMaterial::kPaintingA);
  in.free(17.9, 3.3).box(HouseMaterial::kRug, {-0.7, -1.1, 0}, {0.7, 1.1, 0.012});
}

void furnish_bedroom(const RoomPlacer& in) {
  add_bed(in.west(11.7), 1.7, 2.1);
  for (const double y : {10.45, 12.95}) {
    add_cabinet(in.west(y), {0.45, 0.4, 0.5}, HouseMaterial::kOak, HouseMaterial::kOak);
    add_table_lamp({&in.builder, Vec3(0.2, y, 0.5), 0});
  }
  add_wardrobe(in.north(1.5), {2.4, 0.6, 2.2}, HouseMaterial::kPine);
  add_cabinet(in.east(11.4), {1.4, 0.45, 0.8}, HouseMaterial::kOak, HouseMaterial::kOak);
  add_objects(in.east(11.4, 0.8), 1.2, 0.0);
  in.east(11.4, 1.0).box(HouseMaterial::kMirror, {-0.45, 0, 0}, {0.45, 0.02, 1.0});
  in.free(2.6, 11.7).box(HouseMaterial::kRug, {-0.9, -1.2, 0}, {0.9, 1.2, 0.012});
  add_picture(in.west(11.7, 1.35), 1.2, 0.7, HouseMaterial::kPaintingB);
  add_picture(in.east(13.2, 1.3), 0.6, 0.8, HouseMaterial::kPaintingA);
  add_curtains(in.north(3.7), 1.1);
  add_plant(in.free(4.5, 14.5), 1.3);
  add_chair(in.free(0.6, 8.8, 0), HouseMaterial::kPine, HouseMaterial::kChairSeat);
  add_pendant(in.free(1.6, 11.7));
}

void furnish_bath(const RoomPlacer& in) {
  const Place tub = in.north(6.0);
  tub.box(HouseMaterial::kPorcelain, {-0.85, 0.02, 0}, {0.85, 0.75, 0.15});
  tub.box(HouseMaterial::kPorcelain, {-0.85, 0.02, 0.15}, {0.85, 0.08, 0.56});
  tub.box(HouseMaterial::kPorcelain, {-0.85, 0.69, 0.15}, {0.85, 0.75, 0.56});
  for (const double s : {-1.0, 1.0})
    tub.box(HouseMaterial::kPorcelain, {s * 0.82 - 0.03, 0.08, 0.15}, {s * 0.82 + 0.03, 0.69, 0.56});
  tub.rod(HouseMaterial::kSteel, {0.6, 0.03, 0.75}, {0.6, 0.2, 0.72}, 0.015);
  in.free(5.5, 13.72).box(HouseMaterial::kGlass, {-0.42, -0.006, 0.0}, {0.0, 0.006, 2.0});
  const Place toilet = in.west(12.0);
  toilet.box(HouseMaterial::kPorcelain, {-0.19, 0.02, 0.38}, {0.19, 0.2, 0.8});
  toilet.cone(HouseMaterial::kPorcelain, {Vec3(0, 0.4, 0), Vec3(0, 0.4, 0.4), 0.13, 0.2, 24});
  toilet.cone(HouseMaterial::kWhiteWood, {Vec3(0, 0.4, 0.4), Vec3(0, 0.4, 0.43), 0.21, 0.21, 24});
  add_cabinet(in.east(11.0), {1.2, 0.45, 0.82}, HouseMaterial::kPine, HouseMaterial::kPorcelain);
  in.east(11.0, 0.82).cone(HouseMaterial::kPorcelain, {Vec3(0, 0.25, 0), Vec3(0, 0.25, 0.12), 0.14, 0.2, 24});
  in.east(11.0, 0.82).rod(HouseMaterial::kSteel, {0, 0.05, 0}, {0, 0.05, 0.28}, 0.014);
  in.east(11.0, 1.15).box(HouseMaterial::kMirror, {-0.55, 0, 0}, {0.55, 0.02, 0.8});
  const Place washer = in.west(9.5);
  washer.box(HouseMaterial::kPorcelain, {-0.3, 0.02, 0}, {0.3, 0.6, 0.85});
  washer.cone(HouseMaterial::kBlackGlass, {Vec3(0, 0.6, 0.42), Vec3(0, 0.63, 0.42), 0.17, 0.15, 24});
  for (const double z : {0.5, 0.8, 1.1, 1.4})
    in.east(12.6).rod(HouseMaterial::kSteel, {-0.25, 0.07, z}, {0.25, 0.07, z}, 0.012);
  for (const double x : {-0.25, 0.25})
    in.east(12.6).rod(HouseMaterial::kSteel, {x, 0.07, 0.4}, {x, 0.07, 1.5}, 0.014);
  in.east(12.6).box(HouseMaterial::kBlanket, {-0.2, 0.055, 0.75}, {0.2, 0.09, 1.12});
  add_picture(in.west(10.9, 1.5), 0.4, 0.5, HouseMaterial::kPoster);
  in.free(6.2, 12.2).box(HouseMaterial::kCushion, {-0.3, -0.45, 0}, {0.3, 0.45, 0.012});
}

void furnish_kids(const RoomPlacer& in) {
  add_bed(in.north(8.15), 0.95, 2.0);
  add_table(in.free(10.2, 14.6), {1.4, 0.65, 0.7}, HouseMaterial::kPine, 0.035);
  add_chair(in.free(10.2, 14.05, 2 * kQuarter_rad), HouseMaterial::kPine, HouseMaterial::kChairSeat);
  add_table_lamp(in.free(9.7, 14.7, 0, 0.7));
  add_bookshelf(in.east(11.6), {1.8, 0.3, 1.2}, HouseMaterial::kPine);
  add_objects({&in.builder, Vec3(11.78, 11.6, 1.2), kQuarter_rad}, 1.6, 0.2);
  add_wardrobe(in.east(13.9), {1.2, 0.55, 1.9}, HouseMaterial::kWhiteWood);
  in.free(10, 11.6).box(HouseMaterial::kRug, {-0.8, -0.9, 0}, {0.8, 0.9, 0.012});
  in.free(9.7, 11.3, 0, 0.012).ellipsoid(HouseMaterial::kBall, {0, 0, 0.12}, {0.12, 0.12, 0.12});
  in.free(10.3, 12.1, 0, 0.012).ellipsoid(HouseMaterial::kPlasticBlue, {0, 0, 0.08}, {0.08, 0.08, 0.08});
  const Place blocks = in.free(10.3, 11.2, 0.4, 0.012);
  blocks.box(HouseMaterial::kPlasticRed, {-0.1, -0.1, 0}, {0.0, 0.0, 0.1});
  blocks.box(HouseMaterial::kPlasticBlue, {0.02, -0.08, 0}, {0.12, 0.02, 0.1});
  blocks.box(HouseMaterial::kPine, {-0.05, -0.08, 0.1}, {0.05, 0.0, 0.2});
  add_picture(in.west(11.0, 1.1), 0.9, 0.9, HouseMaterial::kPoster);
  add_picture(in.west(12.2, 1.4), 0.5, 0.6, HouseMaterial::kPaintingA);
  add_curtains(in.north(10.2), 1.3);
  add_stool(in.free(7.95, 9.2), 0.45);
  add_pendant(in.free(9.9, 11.6));
}

void furnish_guest(const RoomPlacer& in) {
  add_bed(in.north(13.6), 1.5, 2.0);
  add_cabinet(in.north(14.7), {0.45, 0.4, 0.5}, HouseMaterial::kWalnut, HouseMaterial::kWalnut);
  add_table_lamp(in.free(14.7, 14.8, 0, 0.5));
  add_wardrobe(in.east(10.6), {1.7, 0.55, 2.1}, HouseMaterial::kWalnut);
  add_table(in.free(14.1, 11.0), {0.8, 0.8, 0.6}, HouseMaterial::kPine, 0.03);
  add_objects(in.free(14.1, 11.0, 0, 0.6), 0.6, 0.5);
  add_sofa(in.east(13.2), 0.9, HouseMaterial::kBlanket);
  add_picture(in.west(10.8, 1.3), 1.0, 0.7, HouseMaterial::kPaintingC);
  add_picture(in.north(13.6, 1.4), 0.9, 0.6, HouseMaterial::kPaintingA);
  add_plant(in.free(12.45, 8.85), 1.5);
  add_radiator(in.north(15.7), 0.8);
  add_curtains(in.north(15.6), 0.9);
}

void furnish_workshop(const RoomPlacer& in) {
  const Place rack = in.east(11.2);
  for (const double x : {-1.6, 0.0, 1.6})
    for (const double y : {0.04, 0.46}) rack.rod(HouseMaterial::kSteel, {x, y, 0}, {x, y, 2.0}, 0.016);
  Rng& rng = in.builder.rng();
  for (const double z : {0.15, 0.75, 1.35, 1.9}) {
    rack.box(HouseMaterial::kSteel, {-1.65, 0.02, z}, {1.65, 0.48, z + 0.015});
    if (z > 1.5) continue;
    for (double x = -1.55; x < 1.1; x += rng.uniform(0.45, 0.65)) {
      const HouseMaterial material =
          rng.uniform() < 0.6 ? HouseMaterial::kCardboard : HouseMaterial::kPlasticBlue;
      rack.box(material, {x, 0.08, z + 0.015},
               {x + rng.uniform(0.25, 0.4), 0.44, z + rng.uniform(0.2, 0.45)});
    }
  }
  add_table(in.free(17.9, 14.6), {2.3, 0.65, 0.88}, HouseMaterial::kPine, 0.07);
  add_objects(in.free(17.9, 14.6, 0, 0.88), 2.0, 0.4);
  const Place board = in.north(16.95, 1.3);
  board.box(HouseMaterial::kCardboard, {-0.35, 0.0, 0}, {0.35, 0.02, 0.8});
  for (int i = 0; i < 5; ++i) {
    const double x = -0.28 + 0.14 * i;
    board.rod(i % 2 == 0 ? HouseMaterial::kSteel : HouseMaterial::kPlasticRed, {x, 0.035, 0.2},
              {x, 0.035, 0.65}, 0.012);
  }
  // A ladder that leans on the west wall.
  const Place ladder = in.west(10.9);
  for (const double x : {-0.2, 0.2}) ladder.rod(HouseMaterial::kSteel, {x, 0.5, 0}, {x, 0.03, 2.2}, 0.017);
  for (int rung = 1; rung < 8; ++rung) {
    const double share = rung / 8.0;
    ladder.rod(HouseMaterial::kSteel, {-0.2, 0.5 - 0.47 * share, 2.2 * share},
               {0.2, 0.5 - 0.47 * share, 2.2 * share}, 0.013);
  }
  in.west(12.6).box(HouseMaterial::kBlackLacquer, {-0.45, 0.02, 0}, {0.45, 0.45, 1.3});
  in.west(9.2).box(HouseMaterial::kCardboard, {-0.3, 0.05, 0}, {0.3, 0.55, 0.5});
  in.west(9.2).box(HouseMaterial::kCardboard, {-0.25, 0.1, 0.5}, {0.2, 0.5, 0.85});
}

void furnish_hall(HouseBuilder& builder) {
  const RoomPlan hall{"hall", 0, kHouseLength_m, kHallLow_y, kHallHigh_y, 0};
  const RoomPlacer in{builder, hall};
  in.free(1.3, 7.5).box(HouseMaterial::kRug, {-0.7, -0.45, 0}, {0.7, 0.45, 0.012});
  add_cabinet(in.south(11.7), {1.2, 0.3, 0.8}, HouseMaterial::kOak, HouseMaterial::kOak);
  add_objects(in.south(11.7, 0.8), 1.0, 0.0);
  in.south(11.7, 1.1).box(HouseMaterial::kMirror, {-0.4, 0, 0}, {0.4, 0.02, 0.9});
  const Place coats = in.south(1.6, 1.6);
  coats.box(HouseMaterial::kWalnut, {-0.6, 0, 0}, {0.6, 0.025, 0.12});
  for (int i = 0; i < 5; ++i)
    coats.rod(HouseMaterial::kBrass, {-0.5 + 0.25 * i, 0.025, 0.05}, {-0.5 + 0.25 * i, 0.1, 0.09}, 0.01);
  coats.ellipsoid(HouseMaterial::kSofa, {-0.25, 0.12, -0.42}, {0.2, 0.09, 0.5});
  coats.ellipsoid(HouseMaterial::kBlanket, {0.25, 0.12, -0.38}, {0.2, 0.09, 0.45});
  add_plant(in.free(19.6, 8.0), 1.1);
  constexpr HouseMaterial kPaintings[] = {HouseMaterial::kPaintingA, HouseMaterial::kPaintingC,
                                          HouseMaterial::kPaintingB, HouseMaterial::kPoster};
  for (int i = 0; i < 4; ++i) {
    add_picture(in.north(2.2 + 5.6 * i - (i == 3 ? 2.9 : 0), 1.3), 0.7, 0.55, kPaintings[i]);
    add_pendant(in.free(2.5 + 5 * i, 7.5));
  }
  add_picture(in.south(4.2, 1.3), 0.9, 0.6, HouseMaterial::kPaintingB);
  add_picture(in.south(15.7, 1.3), 0.6, 0.8, HouseMaterial::kPaintingA);
}

}  // namespace

void furnish(HouseBuilder& builder) {
  using Furnisher = void (*)(const RoomPlacer&);
  constexpr Furnisher kFurnishers[kHouseRooms] = {furnish_living, furnish_dining,  furnish_kitchen,
                                                  furnish_study,  furnish_bedroom, furnish_bath,
                                                  furnish_kids,   furnish_guest,   furnish_workshop};
  for (std::size_t i = 0; i < kHouseRooms; ++i) kFurnishers[i](RoomPlacer{builder, house_rooms()[i]});
  furnish_hall(builder);
}

}  // namespace hm
