#include "hm/pipeline/common/mvog_file.hpp"

#include "hm/io/bytes/file_bytes.hpp"

namespace hm {
namespace {

constexpr double kPlanarLayers = 2.5;

}  // namespace

Result<MultiVolumeGrid> read_mvog(const std::filesystem::path& path) {
  const auto bytes = read_file_bytes(path);
  if (!bytes) return forward_error(bytes);
  auto map = MultiVolumeGrid::parse(std::as_bytes(std::span(*bytes)));
  if (!map) map.error().where = path.string() + (map.error().where.empty() ? "" : ": " + map.error().where);
  return map;
}

bool is_planar(const MultiVolumeGrid& map) {
  const Box3 bounds = map.bounds();
  return !bounds.isEmpty() && bounds.sizes().z() < kPlanarLayers * map.params().resolution_m;
}

Result<OccupancyGrid2D> plan_of(const MultiVolumeGrid& map, const SliceParams& heights) {
  if (!is_planar(map)) return map.slice(heights.slice_bottom_m, heights.slice_top_m);
  const Box3 bounds = map.bounds();
  return map.slice(bounds.min().z(), bounds.max().z());
}

}  // namespace hm
