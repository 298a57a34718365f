#pragma once
#include <algorithm>
#include <cmath>
#include <limits>

#include "hm/geometry/se3.hpp"

namespace hm {

/// Ray in units of cells: p(t) = origin + t * direction.
struct CellRay {
  Vec3 origin;
  Vec3 direction;
};

/// Visits the cells (unit cubes with integer corners) that a ray crosses between t_begin and t_end, in order
/// (Amanatides & Woo 1987): visit(Eigen::Vector3i cell, double t_exit). Crossings are computed from the cell
/// index, not accumulated, so that a traversal started anywhere on the ray finds the same cells.
template <class Visitor>
void walk_cells(const CellRay& ray, double t_begin, double t_end, Visitor&& visit) {
  if (!(t_begin < t_end)) return;
  Eigen::Vector3i cell = (ray.origin + t_begin * ray.direction).array().floor().cast<int>();
  Eigen::Vector3i step;
  Vec3 inverse;
  for (int axis = 0; axis < 3; ++axis) {
    step[axis] = ray.direction[axis] > 0 ? 1 : ray.direction[axis] < 0 ? -1 : 0;
    inverse[axis] = step[axis] != 0 ? 1.0 / ray.direction[axis] : 0.0;
  }
  const auto crossing = [&](int axis) {
    if (step[axis] == 0) return std::numeric_limits<double>::infinity();
    return (cell[axis] + (step[axis] > 0 ? 1 : 0) - ray.origin[axis]) * inverse[axis];
  };
  Vec3 t_next(crossing(0), crossing(1), crossing(2));
  while (true) {
    const int axis =
        t_next.x() < t_next.y() ? (t_next.x() < t_next.z() ? 0 : 2) : (t_next.y() < t_next.z() ? 1 : 2);
    visit(std::as_const(cell), std::min(t_next[axis], t_end));
    if (!(t_next[axis] < t_end)) return;
    cell[axis] += step[axis];
    t_next[axis] = crossing(axis);
  }
}

/// Clips [t_begin, t_end] to the part of a ray inside the box [low, high]; empty when t_begin >= t_end.
inline void clip_to_box(const CellRay& ray, const Vec3& low, const Vec3& high, double& t_begin,
                        double& t_end) {
  for (int axis = 0; axis < 3; ++axis) {
    if (ray.direction[axis] == 0) {
      if (ray.origin[axis] < low[axis] || ray.origin[axis] >= high[axis]) t_end = t_begin;
      continue;
    }
    const double a = (low[axis] - ray.origin[axis]) / ray.direction[axis];
    const double b = (high[axis] - ray.origin[axis]) / ray.direction[axis];
    t_begin = std::max(t_begin, std::min(a, b));
    t_end = std::min(t_end, std::max(a, b));
  }
}

}  // namespace hm
