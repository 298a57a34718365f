#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <string>

#include "hm/geometry/image.hpp"

namespace hm {

/// Response of a surface to a depth sensor.
enum class Reflectance : std::uint8_t {
  kNormal,    ///< a reading
  kNoReturn,  ///< none: glass, mirrors, black lacquer
};

/// Texture of a surface, a function of the world position only, so that it is consistent over views.
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

/// Appearance and reflectance of a surface. `scale_m` is the period of the pattern.
struct Material {
  std::string name;
  Pattern pattern = Pattern::kPlain;
  Rgb8 base{200, 200, 200};
  Rgb8 accent{120, 120, 120};
  float scale_m = 0.3f;
  Reflectance reflectance = Reflectance::kNormal;
  bool clear = false;  ///< transparent to a laser
};

/// Diffuse colour (0..1 per channel) of a material at a surface point with this unit normal.
Eigen::Vector3f albedo(const Material& material, const Eigen::Vector3f& p_world,
                       const Eigen::Vector3f& normal);

}  // namespace hm
