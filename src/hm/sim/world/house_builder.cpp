#include "hm/sim/world/house_builder.hpp"

#include <algorithm>
#include <cmath>

#include "hm/sim/world/house_plan.hpp"

namespace hm {
namespace {

Rgb8 varied(Rgb8 color, Rng& rng) {
  const auto channel = [&](std::uint8_t value) {
    return static_cast<std::uint8_t>(std::clamp(value + rng.uniform(-12.0, 12.0), 0.0, 255.0));
  };
  return {channel(color.r), channel(color.g), channel(color.b)};
}

/// Materials up to kFirstRoomWall, in the order of HouseMaterial.
std::vector<Material> common_materials() {
  using P = Pattern;
  constexpr auto kNone = Reflectance::kNoReturn;
  constexpr auto kYes = Reflectance::kNormal;
  return {
      {"ceiling", P::kPlain, {243, 241, 236}, {200, 200, 200}, 0.3f, kYes},
      {"outside", P::kStone, {196, 178, 150}, {150, 130, 110}, 0.2f, kYes},
      {"trim", P::kPlain, {240, 238, 232}, {220, 220, 220}, 0.3f, kYes},
      {"door", P::kWoodgrain, {186, 140, 92}, {140, 96, 58}, 0.2f, kYes},
      {"front_door", P::kWoodgrain, {96, 40, 30}, {60, 24, 18}, 0.2f, kYes},
      {"glass", P::kSky, {178, 212, 240}, {250, 250, 250}, 0.3f, kNone, true},
      {"hall_wall", P::kWallpaper, {232, 222, 200}, {190, 160, 120}, 0.22f, kYes},
      {"hall_floor", P::kTiles, {200, 176, 148}, {120, 104, 90}, 0.33f, kYes},
      {"oak", P::kWoodgrain, {196, 150, 98}, {150, 104, 60}, 0.2f, kYes},
      {"walnut", P::kWoodgrain, {116, 76, 48}, {76, 46, 30}, 0.2f, kYes},
      {"pine", P::kWoodgrain, {226, 190, 136}, {190, 146, 92}, 0.2f, kYes},
      {"white_wood", P::kPlain, {236, 234, 226}, {200, 200, 200}, 0.3f, kYes},
      {"steel", P::kPlain, {166, 170, 176}, {120, 120, 120}, 0.3f, kYes},
      {"brass", P::kPlain, {190, 150, 70}, {140, 110, 50}, 0.3f, kYes},
      {"black_glass", P::kPlain, {14, 15, 18}, {10, 10, 10}, 0.3f, kNone},
      {"black_lacquer", P::kPlain, {22, 20, 20}, {10, 10, 10}, 0.3f, kNone},
      {"mirror", P::kPlain, {196, 208, 214}, {180, 190, 200}, 0.3f, kNone},
      {"porcelain", P::kPlain, {246, 246, 244}, {230, 230, 230}, 0.3f, kYes},
      {"granite", P::kStone, {92, 90, 94}, {190, 186, 180}, 0.05f, kYes},
      {"sofa", P::kFabric, {74, 104, 132}, {56, 82, 110}, 0.04f, kYes},
      {"cushion", P::kWallpaper, {226, 170, 70}, {160, 70, 50}, 0.09f, kYes},
      {"chair_seat", P::kFabric, {150, 62, 52}, {120, 44, 40}, 0.03f, kYes},
      {"bedding", P::kFabric, {232, 230, 222}, {206, 212, 220}, 0.06f, kYes},
      {"blanket", P::kFabric, {96, 130, 96}, {206, 196, 150}, 0.12f, kYes},
      {"pillow", P::kFabric, {245, 240, 232}, {214, 206, 214}, 0.05f, kYes},
      {"rug", P::kWallpaper, {142, 46, 48}, {226, 196, 140}, 0.18f, kYes},
      {"curtain", P::kFabric, {206, 190, 160}, {180, 150, 120}, 0.09f, kYes},
      {"books", P::kBooks, {140, 80, 60}, {60, 70, 100}, 0.034f, kYes},
      {"painting_a", P::kPainting, {40, 80, 150}, {230, 170, 60}, 0.5f, kYes},
      {"painting_b", P::kPainting, {170, 50, 40}, {240, 220, 180}, 0.4f, kYes},
      {"painting_c", P::kPainting, {40, 110, 70}, {220, 200, 230}, 0.6f, kYes},
      {"poster", P::kPainting, {240, 90, 130}, {60, 200, 220}, 0.25f, kYes},
      {"frame", P::kWoodgrain, {120, 84, 44}, {70, 48, 26}, 0.1f, kYes},
      {"pot", P::kStone, {176, 96, 62}, {140, 70, 46}, 0.05f, kYes},
      {"soil", P::kLeaves, {70, 50, 36}, {40, 30, 22}, 0.1f, kYes},
      {"stem", P::kLeaves, {96, 112, 56}, {70, 80, 40}, 0.1f, kYes},
      {"leaf", P::kLeaves, {58, 132, 56}, {120, 176, 80}, 0.1f, kYes},
      {"shade", P::kFabric, {250, 232, 190}, {240, 214, 160}, 0.03f, kYes},
      {"ball", P::kTiles, {220, 60, 50}, {250, 240, 90}, 0.07f, kYes},
      {"cardboard", P::kPlanks, {186, 150, 106}, {160, 124, 84}, 0.1f, kYes},
      {"plastic_blue", P::kPlain, {40, 96, 180}, {30, 70, 140}, 0.1f, kYes},
      {"plastic_red", P::kPlain, {196, 50, 44}, {150, 40, 36}, 0.1f, kYes},
      {"radiator", P::kPlain, {232, 232, 230}, {210, 210, 210}, 0.1f, kYes},
  };
}

Material wall_material(const RoomPlan& room, std::size_t index) {
  constexpr Rgb8 kBase[kHouseRooms] = {{222, 206, 170}, {196, 214, 196}, {240, 232, 206},
                                       {176, 188, 208}, {226, 204, 208}, {214, 232, 236},
                                       {206, 226, 240}, {230, 222, 190}, {206, 204, 198}};
  constexpr Rgb8 kAccent[kHouseRooms] = {{166, 116, 78}, {110, 146, 110}, {168, 160, 146},
                                         {96, 110, 146}, {176, 120, 136}, {120, 170, 186},
                                         {240, 150, 90}, {150, 140, 90},  {150, 146, 140}};
  constexpr float kScale_m[kHouseRooms] = {0.24f, 0.3f, 0.15f, 0.2f, 0.26f, 0.2f, 0.28f, 0.22f, 0.3f};
  const bool tiled = room.name == "bath" || room.name == "kitchen";
  return {room.name + "_wall", tiled ? Pattern::kTiles : Pattern::kWallpaper,
          kBase[index],        kAccent[index],
          kScale_m[index],     Reflectance::kNormal};
}

Material floor_material(const RoomPlan& room) {
  if (room.name == "bath") return {"bath_floor", Pattern::kTiles, {92, 116, 124}, {220, 224, 224}, 0.2f, {}};
  if (room.name == "kitchen")
    return {"kitchen_floor", Pattern::kTiles, {208, 200, 186}, {110, 100, 92}, 0.3f, {}};
  if (room.name == "workshop")
    return {"workshop_floor", Pattern::kStone, {150, 150, 148}, {110, 108, 106}, 0.3f, {}};
  const bool dark = room.name == "study" || room.name == "bedroom";
  if (dark) return {room.name + "_floor", Pattern::kPlanks, {132, 88, 56}, {88, 56, 36}, 0.12f, {}};
  return {room.name + "_floor", Pattern::kPlanks, {200, 156, 104}, {156, 112, 68}, 0.14f, {}};
}

}  // namespace

HouseBuilder::HouseBuilder(std::uint64_t seed) : world_{"house", {}}, rng_(seed, 0x686f757365) {
  const std::vector<Material> common = common_materials();
  HM_CHECK(common.size() == static_cast<std::size_t>(HouseMaterial::kFirstRoomWall), "{} materials",
           common.size());
  for (const Material& material : common) world_.parts.push_back({material, {}});
  const std::vector<RoomPlan>& rooms = house_rooms();
  HM_CHECK(rooms.size() == kHouseRooms, "{} rooms", rooms.size());
  for (std::size_t i = 0; i < rooms.size(); ++i) world_.parts.push_back({wall_material(rooms[i], i), {}});
  for (const RoomPlan& room : rooms) world_.parts.push_back({floor_material(room), {}});
  for (WorldPart& part : world_.parts) {
    part.material.base = varied(part.material.base, rng_);
    part.material.accent = varied(part.material.accent, rng_);
  }
}

HouseMaterial HouseBuilder::room_wall(std::size_t room) {
  return static_cast<HouseMaterial>(static_cast<std::size_t>(HouseMaterial::kFirstRoomWall) + room);
}
HouseMaterial HouseBuilder::room_floor(std::size_t room) { return room_wall(room + kHouseRooms); }

Vec3 Place::world(const Vec3& local) const {
  const double c = std::cos(yaw_rad), s = std::sin(yaw_rad);
  return at + Vec3(c * local.x() - s * local.y(), s * local.x() + c * local.y(), local.z());
}

void Place::box(HouseMaterial material, const Vec3& low, const Vec3& high) const {
  append_turned_box(builder->mesh(material), world(0.5 * (low + high)), 0.5 * (high - low), yaw_rad);
}

void Place::rod(HouseMaterial material, const Vec3& a, const Vec3& b, double radius_m) const {
  append_rod(builder->mesh(material), {world(a), world(b), radius_m, radius_m, 10});
}

void Place::cone(HouseMaterial material, const Rod& local) const {
  Rod rod = local;
  rod.a = world(local.a), rod.b = world(local.b);
  append_rod(builder->mesh(material), rod);
}

void Place::ellipsoid(HouseMaterial material, const Vec3& center, const Vec3& radii) const {
  // A quarter turn swaps the radii; furniture stands at right angles where it has uneven ones.
  const double c = std::abs(std::cos(yaw_rad)), s = std::abs(std::sin(yaw_rad));
  const Vec3 turned(c * radii.x() + s * radii.y(), s * radii.x() + c * radii.y(), radii.z());
  append_ellipsoid(builder->mesh(material), world(center), turned, 10);
}

World make_house(std::uint64_t seed) {
  HouseBuilder builder(seed);
  build_shell(builder);
  furnish(builder);
  return builder.take();
}

}  // namespace hm
