#pragma once
#include <cstddef>
#include <span>

#include "hm/core/rng.hpp"
#include "hm/geometry/box.hpp"
#include "hm/sim/world/solids.hpp"
#include "hm/sim/world/world.hpp"

namespace hm {

/// Materials of the house, in the order of its parts; followed by the wallpapers of the rooms (kFirstRoomWall
/// + room), then the floors of the rooms.
enum class HouseMaterial : std::size_t {
  kCeiling,
  kOutside,
  kTrim,
  kDoor,
  kFrontDoor,
  kGlass,
  kHallWall,
  kHallFloor,
  kOak,
  kWalnut,
  kPine,
  kWhiteWood,
  kSteel,
  kBrass,
  kBlackGlass,
  kBlackLacquer,
  kMirror,
  kPorcelain,
  kGranite,
  kSofa,
  kCushion,
  kChairSeat,
  kBedding,
  kBlanket,
  kPillow,
  kRug,
  kCurtain,
  kBooks,
  kPaintingA,
  kPaintingB,
  kPaintingC,
  kPoster,
  kFrame,
  kPot,
  kSoil,
  kStem,
  kLeaf,
  kShade,
  kBall,
  kCardboard,
  kPlasticBlue,
  kPlasticRed,
  kRadiator,
  kFirstRoomWall,
};
inline constexpr std::size_t kHouseRooms = 9;

/// Builder of the house's world.
class HouseBuilder {
 public:
  explicit HouseBuilder(std::uint64_t seed);

  TriangleMesh& mesh(HouseMaterial material) { return world_.parts[static_cast<std::size_t>(material)].mesh; }
  [[nodiscard]] static HouseMaterial room_wall(std::size_t room);
  [[nodiscard]] static HouseMaterial room_floor(std::size_t room);
  Rng& rng() { return rng_; }
  [[nodiscard]] World take() { return std::move(world_); }

 private:
  World world_;
  Rng rng_;
};

/// Frame of a piece of furniture: y from its back to its front, z up; the origin `at` is on the floor, at the
/// centre of its back (free-standing furniture: at its centre).
struct Place {
  HouseBuilder* builder = nullptr;
  Vec3 at = Vec3::Zero();
  double yaw_rad = 0;

  [[nodiscard]] Vec3 world(const Vec3& local) const;
  void box(HouseMaterial material, const Vec3& low, const Vec3& high) const;
  void rod(HouseMaterial material, const Vec3& a, const Vec3& b, double radius_m) const;
  void cone(HouseMaterial material, const Rod& local) const;
  void ellipsoid(HouseMaterial material, const Vec3& center, const Vec3& radii) const;
};

/// Builds floors, ceilings, walls with their openings, doors, windows and skirting.
void build_shell(HouseBuilder& builder);
/// Adds all furniture and objects to the rooms.
void furnish(HouseBuilder& builder);

}  // namespace hm
