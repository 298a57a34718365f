#pragma once
#include <cstddef>
#include <span>

#include "hm/core/rng.hpp"
#include "hm/geometry/box.hpp"
#include "hm/sim/world/solids.hpp"
#include "hm/sim/world/world.hpp"

namespace hm {

/// The materials of the house, in the order of its parts; the wallpapers of the rooms follow (kFirstRoomWall
/// + room), then the floors of the rooms.
enum class Stuff : std::size_t {
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

/// The world of the house while it grows.
class HouseBuilder {
 public:
  explicit HouseBuilder(std::uint64_t seed);

  TriangleMesh& mesh(Stuff stuff) { return world_.parts[static_cast<std::size_t>(stuff)].mesh; }
  [[nodiscard]] static Stuff room_wall(std::size_t room);
  [[nodiscard]] static Stuff room_floor(std::size_t room);
  Rng& rng() { return rng_; }
  [[nodiscard]] World take() { return std::move(world_); }

 private:
  World world_;
  Rng rng_;
};

/// A piece of furniture's own frame: y from its back to its front, z up; the origin `at` is on the floor,
/// in the middle of its back (what stands free has it in its middle).
struct Place {
  HouseBuilder* builder = nullptr;
  Vec3 at = Vec3::Zero();
  double yaw_rad = 0;

  [[nodiscard]] Vec3 world(const Vec3& local) const;
  void box(Stuff stuff, const Vec3& low, const Vec3& high) const;
  void rod(Stuff stuff, const Vec3& a, const Vec3& b, double radius_m) const;
  void cone(Stuff stuff, const Rod& local) const;
  void ellipsoid(Stuff stuff, const Vec3& center, const Vec3& radii) const;
};

/// Floors, ceilings, walls with their openings, doors, windows and skirting.
void build_shell(HouseBuilder& builder);
/// Everything that stands, hangs or grows in the rooms.
void furnish(HouseBuilder& builder);

}  // namespace hm
