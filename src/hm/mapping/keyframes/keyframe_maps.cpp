#include "hm/mapping/keyframes/keyframe_maps.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <unordered_map>

#include "hm/odometry/feature/depth_uncertainty.hpp"

namespace hm {
namespace {

constexpr Rgb8 kGrey{128, 128, 128};
constexpr int kOccupancyStride_px = 3;  // 2 cm apart at 4 m: cells of occupancy maps are larger

struct Cell {
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();  ///< of offsets from the cell's corner
  std::uint32_t count = 0, r = 0, g = 0, b = 0;
};

struct CellKey {
  std::int32_t x = 0, y = 0, z = 0;
  bool operator==(const CellKey&) const = default;
};
struct CellHash {
  std::size_t operator()(const CellKey& key) const {
    const auto mix = [](std::int32_t value) {
      return static_cast<std::uint64_t>(static_cast<std::uint32_t>(value));
    };
    return static_cast<std::size_t>((mix(key.x) * 73856093u) ^ (mix(key.y) * 19349669u << 16u) ^
                                    (mix(key.z) * 83492791u << 32u) ^ mix(key.y));
  }
};

Rgb8 mean_color(const Cell& cell) {
  const auto mean = [&](std::uint32_t sum) {
    return static_cast<std::uint8_t>((sum + cell.count / 2) / cell.count);
  };
  return {mean(cell.r), mean(cell.g), mean(cell.b)};
}

bool has(const std::vector<std::string>& kinds, const char* kind) {
  return std::find(kinds.begin(), kinds.end(), kind) != kinds.end();
}

KeyframePointParams point_params(const KeyframeMapParams& wanted, int stride_px) {
  KeyframePointParams params;
  params.stride_px = stride_px;
  params.max_depth_m = wanted.slam.map_depth_m;
  params.max_sigma_m = wanted.max_depth_sigma_m;
  params.top_m = wanted.slam.map_top_m;
  params.up = wanted.up;
  params.noise = wanted.depth_noise;
  return params;
}

void add_keyframe(const RgbdFrame& frame, const PinholeCamera& camera, const KeyframeMapParams& wanted,
                  KeyframeMaps& maps) {
  if (maps.points) maps.points->add(keyframe_points(frame, camera, point_params(wanted, 1)));
  if (!maps.occupancy && !maps.volumes) return;
  const ColoredPoints sparse = keyframe_points(frame, camera, point_params(wanted, kOccupancyStride_px));
  if (maps.colors) maps.colors->add(sparse);
  if (maps.occupancy) maps.occupancy->insert(sparse.p_map, sparse.p_map_origin);
  if (maps.volumes) maps.volumes->insert(sparse.p_map, sparse.p_map_origin);
}

}  // namespace

ColoredPoints keyframe_points(const RgbdFrame& frame, const PinholeCamera& camera,
                              const KeyframePointParams& params) {
  ColoredPoints points;
  const SE3& T = *frame.T_world_camera;
  points.p_map_origin = T.translation();
  const bool colored =
      frame.color.width() == frame.depth.width() && frame.color.height() == frame.depth.height();
  for (int y = 0; y < frame.depth.height(); y += params.stride_px)
    for (int x = 0; x < frame.depth.width(); x += params.stride_px) {
      const double depth = frame.depth.depth_m(x, y);
      if (depth <= 0 || depth > params.max_depth_m) continue;
      const auto certain = mixture_depth(frame.depth, x, y, params.noise);
      if (!certain || certain->variance_m2 > params.max_sigma_m * params.max_sigma_m) continue;
      const Vec3 p = T * camera.unproject(Vec2(x, y), depth);
      if (params.top_m != 0 && p.dot(params.up) > params.top_m) continue;
      points.p_map.push_back(p.cast<float>());
      points.colors.push_back(colored ? frame.color(x, y) : kGrey);
    }
  return points;
}

struct PointMap::Impl {
  double voxel_m = 0.01;
  std::unordered_map<CellKey, Cell, CellHash> cells;

  [[nodiscard]] CellKey key_of(const Eigen::Vector3f& p) const {
    const auto at = [&](float value) {
      return static_cast<std::int32_t>(std::floor(static_cast<double>(value) / voxel_m));
    };
    return {at(p.x()), at(p.y()), at(p.z())};
  }
  [[nodiscard]] Eigen::Vector3f corner_of(const CellKey& key) const {
    return (Vec3(key.x, key.y, key.z) * voxel_m).cast<float>();
  }
};

PointMap::PointMap(double voxel_m) : impl_(std::make_unique<Impl>()) { impl_->voxel_m = voxel_m; }
PointMap::~PointMap() = default;
PointMap::PointMap(PointMap&&) noexcept = default;
PointMap& PointMap::operator=(PointMap&&) noexcept = default;

std::size_t PointMap::size() const { return impl_->cells.size(); }

void PointMap::add(const ColoredPoints& points) {
  for (std::size_t i = 0; i < points.p_map.size(); ++i) {
    const CellKey key = impl_->key_of(points.p_map[i]);
    Cell& cell = impl_->cells[key];
    cell.sum += points.p_map[i] - impl_->corner_of(key);
    ++cell.count;
    cell.r += points.colors[i].r, cell.g += points.colors[i].g, cell.b += points.colors[i].b;
  }
}

TriangleMesh PointMap::points() const {
  std::vector<CellKey> keys;
  keys.reserve(impl_->cells.size());
  for (const auto& [key, cell] : impl_->cells) keys.push_back(key);
  std::sort(keys.begin(), keys.end(), [](const CellKey& a, const CellKey& b) {
    return std::tie(a.z, a.y, a.x) < std::tie(b.z, b.y, b.x);
  });
  TriangleMesh cloud;
  for (const CellKey& key : keys) {
    const Cell& cell = impl_->cells.at(key);
    cloud.vertices.push_back(impl_->corner_of(key) + cell.sum / static_cast<float>(cell.count));
    cloud.colors.push_back(mean_color(cell));
  }
  return cloud;
}

Rgb8 PointMap::color_at(const Eigen::Vector3f& p_map, Rgb8 otherwise) const {
  const auto cell = impl_->cells.find(impl_->key_of(p_map));
  return cell == impl_->cells.end() ? otherwise : mean_color(cell->second);
}

KeyframeMaps make_keyframe_maps(const FrameSource& frames, const CorrectedKeyframes& keyframes,
                                const KeyframeMapParams& wanted, const RunContext& run) {
  KeyframeMaps maps;
  const auto kinds = map_kinds(wanted.slam);
  if (!kinds || kinds->empty()) return maps;
  if (has(*kinds, "points")) maps.points = std::make_unique<PointMap>(wanted.slam.points_voxel_m);
  if (has(*kinds, "octomap")) {
    MvogParams cells = wanted.mvog;
    cells.resolution_m = wanted.slam.octomap_resolution_m;
    maps.occupancy = std::make_unique<MultiVolumeGrid>(cells);
    maps.colors = std::make_unique<PointMap>(cells.resolution_m);
  }
  if (has(*kinds, "mvog")) maps.volumes = std::make_unique<MultiVolumeGrid>(wanted.mvog);
  const PinholeCamera camera = frames.camera();
  const std::size_t total = keyframes.keyframes().size();
  for (const CorrectedKeyframe& keyframe : keyframes.keyframes()) {
    if (run.stop.stop_requested()) break;
    if (keyframe.map != 0) continue;
    auto frame = frames.read(keyframe.frame_index);
    if (!frame) {
      ++maps.unreadable;
      continue;
    }
    frame->T_world_camera = keyframe.T_map_camera;
    add_keyframe(*frame, camera, wanted, maps);
    ++maps.keyframes;
    if (run.progress) run.progress({"making maps of keyframes", maps.keyframes, total, {}});
  }
  return maps;
}

std::vector<Rgb8> voxel_colors(const KeyframeMaps& maps, std::span<const OccupancyVoxel> voxels) {
  constexpr Rgb8 kWithout{255, 255, 255};
  std::vector<Rgb8> colors;
  for (const OccupancyVoxel& voxel : voxels)
    colors.push_back(voxel.state == Occupancy::kOccupied
                         ? maps.colors->color_at(voxel.p_world_centre, kWithout)
                         : kWithout);
  return colors;
}

}  // namespace hm
