#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "hm/mvog/beam_raster.hpp"
#include "hm/mvog/column_runs.hpp"
#include "hm/mvog/multi_volume_grid.hpp"
#include "hm/mvog/tile_store.hpp"

namespace hm {

/// Implementation of MultiVolumeGrid. In map units a column is [x, x + 1) by [y, y + 1), and a level [k, k +
/// 1) is half a cell high.
struct MultiVolumeGrid::Impl {
  static constexpr double kMaxColumn = 1 << 28, kMaxBeamCells = 20000;
  static constexpr std::size_t kViews = 4;

  explicit Impl(const MvogParams& p);

  MvogParams params;
  double columns_per_m;
  mvog::ColumnUpdater updater;
  mvog::TileStore store;
  std::uint64_t revision = 0, scans = 0;
  std::size_t columns_refused = 0;  ///< in all
  /// Origins of the last scans, latest first; scans from the same origin count as one view.
  std::array<Eigen::Vector3d, kViews> views;
  std::size_t view_count = 0;

  mvog::BeamRaster raster;             ///< this and the following: working memory of insert()
  std::vector<std::uint16_t> updated;  ///< changed columns of a tile, concatenated
  std::array<std::size_t, mvog::kTileColumns> updated_from{}, updated_end{};
  bool changed = false;  ///< by this scan
  std::vector<std::uint16_t> block;

  [[nodiscard]] const mvog::CodeTables& tables() const { return updater.tables(); }
  [[nodiscard]] double level_m() const { return params.resolution_m / 2; }
  [[nodiscard]] Eigen::Vector3d to_cells(const Eigen::Vector3d& p_world) const {
    return {p_world.x() * columns_per_m, p_world.y() * columns_per_m, p_world.z() * (2 * columns_per_m)};
  }
  /// True for points inside the index range.
  [[nodiscard]] static bool can_hold(const Eigen::Vector3d& p) {
    return std::abs(p.x()) < kMaxColumn && std::abs(p.y()) < kMaxColumn && p.z() > mvog::kMinLevel + 2 &&
           p.z() < mvog::kMaxLevel - 2;
  }
  [[nodiscard]] mvog::RunCode code_at(const Eigen::Vector3d& p_world) const;
  /// Memory limit of the tiles.
  [[nodiscard]] std::size_t max_store_bytes() const {
    return params.max_map_mb > 0 ? static_cast<std::size_t>(params.max_map_mb) * 1000000 - sizeof(Impl) -
                                       sizeof(MultiVolumeGrid)
                                 : std::numeric_limits<std::size_t>::max();
  }

  bool note_view(const Eigen::Vector3d& p_world_origin);
  [[nodiscard]] int lowest_level(const BeamScan& scan) const;
  void rasterise(const BeamScan& scan, BeamScanStats& stats);
  bool make_block(const mvog::Tile* old, std::uint64_t different);
  void update_tile(const mvog::ScanLayers::Patch& patch, std::size_t tile, BeamScanStats& stats);
};

}  // namespace hm
