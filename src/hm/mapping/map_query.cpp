#include "hm/mapping/map_query.hpp"

#include <system_error>
#include <utility>
#include <vector>

#include "hm/mapping/map_store.hpp"
#include "hm/mesh/whole_mesh.hpp"
#include "hm/tsdf/grid/volume_grid.hpp"

namespace hm {
namespace {

Result<void> write_grid(const std::filesystem::path& path, VolumeGrid& grid, const std::string& program) {
  MapHeader header;
  header.voxel_size_m = grid.voxel_size_m();
  header.sdf_unit_m = grid.sdf_unit_m();
  header.program_version = program;
  auto file = MapFile::create(path, header);
  if (!file) return forward_error(file);
  MapSaver saver(std::move(*file));
  std::vector<ChangedVolume> all;
  for (const VolumeKey& key : grid.sorted_keys()) all.push_back({key, 0, false});
  saver.note(all);
  return saver.save(grid, header);
}

}  // namespace

MapQuery::MapQuery(const VolumeGrid& grid) : grid_(&grid) {}
MapQuery::MapQuery(VolumeGrid&& grid)
    : own_(std::make_unique<VolumeGrid>(std::move(grid))), grid_(own_.get()) {}
MapQuery::~MapQuery() = default;
MapQuery::MapQuery(MapQuery&&) noexcept = default;
MapQuery& MapQuery::operator=(MapQuery&&) noexcept = default;

Result<MapQuery> MapQuery::open(const std::filesystem::path& path, const std::optional<Box3>& region,
                                std::size_t max_bytes) {
  const auto file = MapFile::open(path, MapOpenMode::kRead);
  if (!file) return forward_error(file);
  auto grid = load_grid(*file, {region, max_bytes});
  if (!grid) return forward_error(grid);
  return MapQuery(std::move(*grid));
}

GridSample MapQuery::at(const Vec3& p_world) const { return query_grid(*grid_, p_world); }
void MapQuery::at(std::span<const Vec3> p_world, std::span<GridSample> samples,
                  const ParallelLoop& loop) const {
  query_grid(*grid_, p_world, samples, loop);
}

double MapQuery::voxel_size_m() const { return grid_->voxel_size_m(); }
Box3 MapQuery::bounds() const { return grid_->bounds(); }
std::size_t MapQuery::volume_count() const { return grid_->volume_count(); }
TriangleMesh MapQuery::mesh(const ParallelLoop& loop) const {
  return extract_mesh(*grid_, MeshParams(), loop);
}

Result<void> save_map(const std::filesystem::path& path, VolumeGrid& grid, const std::string& program) {
  std::filesystem::path partial = path;
  partial += ".partial";
  std::error_code failure;
  if (auto written = write_grid(partial, grid, program); !written) {
    std::filesystem::remove(partial, failure);
    return written;
  }
  std::filesystem::rename(partial, path, failure);
  if (failure)
    return fail(ErrorCode::kUnreadable, path.string(), "cannot be replaced: {}", failure.message());
  return {};
}

}  // namespace hm
