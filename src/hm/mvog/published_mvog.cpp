#include "hm/mvog/published_mvog.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "hm/core/check.hpp"

namespace hm {
namespace {

constexpr double kMaxCells = 1 << 26;  ///< of the dense array
constexpr double kNever = std::numeric_limits<double>::infinity();

Eigen::Vector2i floor_cell(const Eigen::Vector3d& p) {
  return {static_cast<int>(std::floor(p.x())), static_cast<int>(std::floor(p.y()))};
}

/// Density of the volume that contains a height; 0 without one.
double density_at(std::span<const MvogVolume> list, double z) {
  const auto above =
      std::ranges::upper_bound(list, z, {}, [](const MvogVolume& v) { return double{v.bottom}; });
  if (above == list.begin()) return 0;
  const MvogVolume& volume = *std::prev(above);
  return z < volume.top ? static_cast<double>(volume.density()) : 0;
}

}  // namespace

MvogVolume make_mvog_volume(float z1, float z2) {
  float bottom = std::min(z1, z2), top = std::max(z1, z2);
  if (top - bottom < 1) {
    bottom = (bottom + top) / 2 - 0.5F;
    top = bottom + 1;
  }
  return {bottom, top, top - bottom};
}

void insert_mvog_volume(std::vector<MvogVolume>& list, MvogVolume volume, float gap) {
  std::size_t first = 0;
  while (first < list.size() && list[first].top + gap < volume.bottom) ++first;
  std::size_t end = first;
  for (; end < list.size() && list[end].bottom - gap <= volume.top; ++end) {
    const MvogVolume& other = list[end];
    const float between = std::max({0.0F, other.bottom - volume.top, volume.bottom - other.top});
    volume = {std::min(volume.bottom, other.bottom), std::max(volume.top, other.top),
              volume.mass + other.mass + between * (volume.density() + other.density()) / 2};
  }
  if (first == end) {
    list.insert(list.begin() + static_cast<std::ptrdiff_t>(first), volume);
    return;
  }
  list[first] = volume;
  list.erase(list.begin() + static_cast<std::ptrdiff_t>(first + 1),
             list.begin() + static_cast<std::ptrdiff_t>(end));
}

PublishedMvog::PublishedMvog(const PublishedMvogParams& params) : params_(params) {
  HM_CHECK(params.resolution_m > 0 && params.gap_cell >= 0);
  const int side = std::max(2, static_cast<int>(std::ceil(params.initial_size_m / params.resolution_m)));
  min_ = {-side / 2, -side / 2};
  size_ = {side, side};
  cells_.resize(static_cast<std::size_t>(side) * static_cast<std::size_t>(side));
}

Eigen::Vector2i PublishedMvog::cell_of(const Eigen::Vector2d& p_world) const {
  return floor_cell({p_world.x() / params_.resolution_m, p_world.y() / params_.resolution_m, 0});
}

const PublishedMvog::Cell* PublishedMvog::find(int x, int y) const {
  const Eigen::Vector2i local = Eigen::Vector2i(x, y) - min_;
  if ((local.array() < 0).any() || (local.array() >= size_.array()).any()) return nullptr;
  return &cells_[static_cast<std::size_t>(local.y()) * static_cast<std::size_t>(size_.x()) +
                 static_cast<std::size_t>(local.x())];
}

PublishedMvog::Cell& PublishedMvog::cell(int x, int y) { return const_cast<Cell&>(*find(x, y)); }

/// Doubles the offending axis until the array holds both cells (k.1). False when it would be too large.
bool PublishedMvog::make_room(const Eigen::Vector2i& a, const Eigen::Vector2i& b) {
  Eigen::Vector2i min = min_, size = size_;
  for (int axis = 0; axis < 2; ++axis) {
    while (std::min(a[axis], b[axis]) < min[axis] || std::max(a[axis], b[axis]) >= min[axis] + size[axis]) {
      if (2.0 * size.x() * size.y() > kMaxCells) return false;
      min[axis] -= size[axis] / 2;
      size[axis] *= 2;
    }
  }
  if (min == min_ && size == size_) return true;
  std::vector<Cell> cells(static_cast<std::size_t>(size.x()) * static_cast<std::size_t>(size.y()));
  std::size_t from = 0;
  for (int y = 0; y < size_.y(); ++y)
    for (int x = 0; x < size_.x(); ++x)
      cells[static_cast<std::size_t>(y + min_.y() - min.y()) * static_cast<std::size_t>(size.x()) +
            static_cast<std::size_t>(x + min_.x() - min.x())] = std::move(cells_[from++]);
  cells_ = std::move(cells);
  min_ = min;
  size_ = size;
  return true;
}

BeamScanStats PublishedMvog::insert(const BeamScan& scan) {
  BeamScanStats stats;
  const Eigen::Vector3d from = scan.p_world_origin / params_.resolution_m;
  for (const Eigen::Vector3f& p : scan.p_world_returns) {
    if (!p.allFinite() || !from.allFinite()) {
      ++stats.not_finite;
      continue;
    }
    const Eigen::Vector3d to = p.cast<double>() / params_.resolution_m;
    const bool far = from.cwiseAbs().maxCoeff() > kMaxCells || to.cwiseAbs().maxCoeff() > kMaxCells;
    if (far || !make_room(floor_cell(from), floor_cell(to))) {
      ++stats.out_of_bounds;
      continue;
    }
    add_beam(from, to);
    ++stats.returns;
  }
  return stats;
}

void PublishedMvog::add_beam(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  if (params_.model_negative_space) add_free_space(from, to);
  const Eigen::Vector2i end = floor_cell(to);
  const auto z = static_cast<float>(to.z());
  insert_mvog_volume(cell(end.x(), end.y()).positive, make_mvog_volume(z - 0.5F, z + 0.5F), params_.gap_cell);
}

/// Negative volumes along the beam (2.5.2, Fig. 2.16); in the cell of its end by the beam's slope
/// (Fig. 2.17).
void PublishedMvog::add_free_space(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  Eigen::Vector2i at = floor_cell(from);
  const Eigen::Vector3d d = to - from;
  Eigen::Array2i walls = (floor_cell(to) - at).array().abs();
  Eigen::Array2i step;
  Eigen::Array2d next;
  for (int axis = 0; axis < 2; ++axis) {
    step[axis] = d[axis] < 0 ? -1 : 1;
    next[axis] = walls[axis] ? (at[axis] + (step[axis] > 0) - from[axis]) / d[axis] : kNever;
  }
  const auto add = [&](double z1, double z2) {
    insert_mvog_volume(cell(at.x(), at.y()).negative,
                       make_mvog_volume(static_cast<float>(z1), static_cast<float>(z2)), params_.gap_cell);
  };
  double z = from.z();
  while (walls.sum() > 0) {
    const int axis = next[0] < next[1] ? 0 : 1;
    const double z_out = from.z() + d.z() * next[axis];
    add(z, z_out);
    z = z_out;
    at[axis] += step[axis];
    next[axis] = --walls[axis] > 0 ? next[axis] + std::abs(1 / d[axis]) : kNever;
  }
  const double level = d.head<2>().norm();  // a vertical beam is steeper than any slope
  if (d.z() > level && z < to.z() - 0.5) add(z, to.z() - 0.5);
  if (d.z() < -level && z > to.z() + 0.5) add(to.z() + 0.5, z);
}

std::optional<double> PublishedMvog::probability_at(const Eigen::Vector3d& p_world) const {
  const Eigen::Vector3d p = p_world / params_.resolution_m;
  if (!p.allFinite() || p.cwiseAbs().maxCoeff() > kMaxCells) return std::nullopt;
  const Eigen::Vector2i at = floor_cell(p);
  const Cell* cell = find(at.x(), at.y());
  if (!cell) return std::nullopt;
  const double hit = density_at(cell->positive, p.z()), miss = density_at(cell->negative, p.z());
  if (hit + miss <= 0) return std::nullopt;
  return hit / (hit + miss);
}

Occupancy PublishedMvog::at(const Eigen::Vector3d& p_world, double threshold) const {
  const auto p = probability_at(p_world);
  return !p ? Occupancy::kUnknown : *p >= threshold ? Occupancy::kOccupied : Occupancy::kFree;
}

std::span<const MvogVolume> PublishedMvog::positive(int x, int y) const {
  const Cell* cell = find(x, y);
  return cell ? std::span<const MvogVolume>(cell->positive) : std::span<const MvogVolume>();
}

std::span<const MvogVolume> PublishedMvog::negative(int x, int y) const {
  const Cell* cell = find(x, y);
  return cell ? std::span<const MvogVolume>(cell->negative) : std::span<const MvogVolume>();
}

}  // namespace hm
