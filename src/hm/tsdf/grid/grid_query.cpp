#include "hm/tsdf/grid/grid_query.hpp"

#include <array>
#include <cmath>
#include <cstdint>

#include "hm/core/check.hpp"
#include "hm/core/parallel.hpp"
#include "hm/tsdf/grid/volume_grid.hpp"

namespace hm {
namespace {

constexpr std::size_t kPointsPerRange = 1024;
/// Voxel indices beyond this are outside every map.
constexpr double kFarthestVoxel = 1e9;

/// Eight voxels around a point, x fastest, then y, then z.
struct Corners {
  std::array<double, 8> distances_m{};
  std::array<double, 8> weights{};
  std::array<ColorVoxel, 8> colors{};
};

/// Looks up voxels, with a cache of the eight volumes around a corner.
class CornerReader {
 public:
  explicit CornerReader(const VolumeGrid& grid) : grid_(grid) {}

  /// False when one of them is unknown.
  bool read(const Eigen::Vector3i& low, Corners& corners) {
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Vector3i at = low + Eigen::Vector3i(corner & 1, corner >> 1 & 1, corner >> 2);
      const Volume* volume = find({at.x() >> 3, at.y() >> 3, at.z() >> 3});
      if (!volume) return false;
      const int offset = voxel_offset(at.x() & 7, at.y() & 7, at.z() & 7);
      const TsdfVoxel voxel = volume->voxels[offset];
      if (voxel.weight() == 0) return false;
      const auto i = static_cast<std::size_t>(corner);
      corners.distances_m[i] = voxel.sdf() * grid_.sdf_unit_m();
      corners.weights[i] = static_cast<double>(voxel.weight()) / kWeightOne;
      corners.colors[i] = volume->colors ? volume->colors[offset] : ColorVoxel{};
    }
    return true;
  }

 private:
  const Volume* find(VolumeKey key) {
    Entry& entry = entries_[static_cast<std::size_t>((key.x & 1) | (key.y & 1) << 1 | (key.z & 1) << 2)];
    if (!entry.filled || entry.key != key) entry = {key, grid_.find(key), true};
    return entry.volume;
  }

  struct Entry {
    VolumeKey key;
    const Volume* volume = nullptr;
    bool filled = false;
  };
  const VolumeGrid& grid_;
  std::array<Entry, 8> entries_;
};

double share(int corner, const Vec3& fraction) {
  return ((corner & 1) != 0 ? fraction.x() : 1 - fraction.x()) *
         ((corner & 2) != 0 ? fraction.y() : 1 - fraction.y()) *
         ((corner & 4) != 0 ? fraction.z() : 1 - fraction.z());
}

double weight_at(const std::array<double, 8>& weights, const Vec3& fraction) {
  double sum = 0;
  for (int corner = 0; corner < 8; ++corner)
    sum += share(corner, fraction) * weights[static_cast<std::size_t>(corner)];
  return sum;
}

/// Weighted mean of the available colours, with trilinear weights.
std::optional<Rgb8> color_at(const std::array<ColorVoxel, 8>& colors, const Vec3& fraction) {
  Vec3 sum = Vec3::Zero();
  double shares = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const ColorVoxel color = colors[static_cast<std::size_t>(corner)];
    if (color.weight() == 0) continue;
    const double part = share(corner, fraction);
    sum += part * Vec3(color.r(), color.g(), color.b());
    shares += part;
  }
  if (shares <= 0) return std::nullopt;
  const auto channel = [&](double value) { return static_cast<std::uint8_t>(std::lround(value / shares)); };
  return Rgb8{channel(sum.x()), channel(sum.y()), channel(sum.z())};
}

GridSample sample_at(const VolumeGrid& grid, CornerReader& reader, const Vec3& p_world) {
  GridSample sample;
  const Vec3 at = p_world / grid.voxel_size_m() - Vec3::Constant(0.5);
  if (!(at.array().abs() < kFarthestVoxel).all()) return sample;  // nor NaN
  const Vec3 low = at.array().floor();
  Corners corners;
  if (!reader.read(low.cast<int>(), corners)) return sample;
  const Vec3 fraction = at - low;
  const VolumeGrid::Sample distance = VolumeGrid::blend(corners.distances_m, fraction, grid.voxel_size_m());
  sample.known = true;
  sample.distance_m = distance.distance_m;
  sample.gradient = distance.gradient;
  sample.weight = weight_at(corners.weights, fraction);
  sample.color = color_at(corners.colors, fraction);
  return sample;
}

}  // namespace

GridSample query_grid(const VolumeGrid& grid, const Vec3& p_world) {
  CornerReader reader(grid);
  return sample_at(grid, reader, p_world);
}

void query_grid(const VolumeGrid& grid, std::span<const Vec3> p_world, std::span<GridSample> samples,
                const ParallelLoop& loop) {
  HM_CHECK(p_world.size() == samples.size(), "{} points, {} samples", p_world.size(), samples.size());
  loop.for_ranges(p_world.size(), kPointsPerRange, [&](std::size_t begin, std::size_t end) {
    CornerReader reader(grid);
    for (std::size_t i = begin; i < end; ++i) samples[i] = sample_at(grid, reader, p_world[i]);
  });
}

}  // namespace hm
