// Extraction of volumes, slices and voxels from a published grid (dissertation 2.5.3).
#include <algorithm>
#include <cmath>

#include "hm/mvog/published_mvog.hpp"

namespace hm {

/// Sweeps both lists together, split at the boundaries of either.
std::vector<PublishedMvog::Stretch> PublishedMvog::stretches(const Cell& cell) {
  std::vector<double> walls;
  for (const auto* list : {&cell.positive, &cell.negative}) {
    for (const MvogVolume& volume : *list) {
      walls.push_back(double{volume.bottom});
      walls.push_back(double{volume.top});
    }
  }
  std::ranges::sort(walls);
  walls.erase(std::unique(walls.begin(), walls.end()), walls.end());
  std::vector<Stretch> found;
  auto positive = cell.positive.begin(), negative = cell.negative.begin();
  for (std::size_t i = 0; i + 1 < walls.size(); ++i) {
    const auto density = [&](auto& at, const std::vector<MvogVolume>& list) {
      while (at != list.end() && double{at->top} <= walls[i]) ++at;
      return at != list.end() && double{at->bottom} <= walls[i] ? double{at->density()} : 0.0;
    };
    const double hit = density(positive, cell.positive), miss = density(negative, cell.negative);
    if (hit + miss > 0) found.push_back({walls[i], walls[i + 1], hit / (hit + miss)});
  }
  return found;
}

std::vector<VerticalVolume> PublishedMvog::volumes_at(const Eigen::Vector2d& p_world,
                                                      double threshold) const {
  std::vector<VerticalVolume> volumes;
  const Eigen::Vector2i at = cell_of(p_world);
  const Cell* cell = find(at.x(), at.y());
  if (!cell) return volumes;
  for (const Stretch& stretch : stretches(*cell)) {
    const Occupancy state = stretch.probability >= threshold ? Occupancy::kOccupied : Occupancy::kFree;
    const double bottom_m = stretch.bottom * params_.resolution_m, top_m = stretch.top * params_.resolution_m;
    if (volumes.empty() || volumes.back().state != state || volumes.back().top_m != bottom_m) {
      volumes.push_back({bottom_m, top_m, stretch.probability, state});
      continue;
    }
    VerticalVolume& last = volumes.back();
    last.probability = (last.probability * last.height_m() + stretch.probability * (top_m - bottom_m)) /
                       (top_m - last.bottom_m);
    last.top_m = top_m;
  }
  return volumes;
}

OccupancyGrid2D PublishedMvog::slice(double bottom_m, double top_m) const {
  OccupancyGrid2D grid;
  grid.resolution_m = params_.resolution_m;
  grid.origin_m = params_.resolution_m * min_.cast<double>();
  grid.cells = {size_.x(), size_.y(), OccupancyGrid2D::kUnknown};
  for (int y = 0; y < size_.y(); ++y) {
    for (int x = 0; x < size_.x(); ++x) {
      std::uint8_t& cell = grid.cells(x, y);
      for (const Stretch& stretch : stretches(*find(x + min_.x(), y + min_.y()))) {
        if (stretch.top * params_.resolution_m <= bottom_m || stretch.bottom * params_.resolution_m >= top_m)
          continue;
        const auto percent = static_cast<std::uint8_t>(std::lround(100 * stretch.probability));
        cell = cell == OccupancyGrid2D::kUnknown ? percent : std::max(cell, percent);
      }
    }
  }
  return grid;
}

std::vector<OccupancyVoxel> PublishedMvog::voxels(double threshold) const {
  std::vector<OccupancyVoxel> all;
  const double size_m = params_.resolution_m;
  for (int y = min_.y(); y < min_.y() + size_.y(); ++y) {
    for (int x = min_.x(); x < min_.x() + size_.x(); ++x) {
      bool first = true;
      int last = 0;
      for (const Stretch& stretch : stretches(*find(x, y))) {
        const auto probability = static_cast<float>(stretch.probability);
        const Occupancy state = stretch.probability >= threshold ? Occupancy::kOccupied : Occupancy::kFree;
        for (int z = static_cast<int>(std::floor(stretch.bottom)); z < stretch.top; ++z) {
          if (first || z != last)
            all.push_back({(Eigen::Vector3d(x + 0.5, y + 0.5, z + 0.5) * size_m).cast<float>(),
                           static_cast<float>(size_m), probability, state});
          else if (probability > all.back().probability) {
            all.back().probability = probability;
            all.back().state = state;
          }
          first = false;
          last = z;
        }
      }
    }
  }
  return all;
}

PublishedMvog::Size PublishedMvog::size() const {
  Size size;
  size.cells = cells_.size();
  size.bytes = sizeof(*this) + cells_.capacity() * sizeof(Cell);
  for (const Cell& cell : cells_) {
    size.positive += cell.positive.size();
    size.negative += cell.negative.size();
    size.cells_known += !cell.positive.empty() || !cell.negative.empty();
    size.bytes += (cell.positive.capacity() + cell.negative.capacity()) * sizeof(MvogVolume);
  }
  size.bytes_published = (size.positive + size.negative) * sizeof(MvogVolume) + size.cells_known * 20;
  return size;
}

}  // namespace hm
