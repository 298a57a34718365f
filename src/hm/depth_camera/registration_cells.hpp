#pragma once
#include <limits>
#include <vector>

#include "hm/geometry/se3.hpp"

namespace hm::detail {

/// How the pixels of a depth camera are seen by another camera: a reading of z metres at pixel (x, y) lies at
/// z directions (x, y, 1) + origin_m, homogeneous, in pixels of the other one.
struct PixelMap {
  Mat3 directions;
  Vec3 origin_m;
  int width = 0, height = 0;        ///< of the depth camera
  int to_width = 0, to_height = 0;  ///< of the other one
};

/// Cells are the other camera's pixels with a border around them, wide enough for all readings that are not
/// too near.
struct RegistrationCells {
  static constexpr int kMostWithinReach = 1 << 16;  ///< of a row
  struct Rows {
    int first = 0, last = 0;
  };
  int left = 0, top = 0;     ///< cells before the image's first pixel; left is a whole line of the cache
  int stride = 0, rows = 0;  ///< in all
  double nearest_m = std::numeric_limits<double>::infinity();  ///< readings nearer than that go anywhere
  double most_z = 0;          ///< what a reading of 1 has there, less the origin's
  std::vector<Rows> reached;  ///< for each row of the depth camera: where its other readings go
};

/// Whether there are not too many cells for pictures of this size.
bool has_cells_for(int to_width, int to_height);

/// For pictures that has_cells_for(). Where more cells would be within reach of a row than can be, every
/// reading is too near.
RegistrationCells registration_cells(const PixelMap& map);

}  // namespace hm::detail
