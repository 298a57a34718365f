#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <string>

#include "hm/geometry/image.hpp"

namespace hm {

/// What a depth sensor gets back from a surface.
enum class Reflectance : std::uint8_t {
  kNormal,    ///< a reading
  kNoReturn,  ///< none: glass, mirrors, black lacquer
};

/// The pattern of a surface: a function of the position in the world only, so that every view sees the same.
enum class Pattern : std::uint8_t {
  kPlain,
  kPlanks,
  kTiles,
  kWallpaper,
  kWoodgrain,
  kFabric,
  kStone,
  kBooks,
  kPainting,
  kLeaves,
  kSky,
};

/// How a surface looks and answers. `scale_m` is the size of the pattern's repeating piece.
struct Material {
  std::string name;
  Pattern pattern = Pattern::kPlain;
  Rgb8 base{200, 200, 200};
  Rgb8 accent{120, 120, 120};
  float scale_m = 0.3f;
  Reflectance reflectance = Reflectance::kNormal;
  bool clear = false;  ///< a laser's pulse goes through: what lies behind answers
};

/// The diffuse colour (0..1 a channel) of a material at a point of a surface with this unit normal.
Eigen::Vector3f albedo(const Material& material, const Eigen::Vector3f& p_world,
                       const Eigen::Vector3f& normal);

}  // namespace hm
