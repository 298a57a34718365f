#pragma once
#include <span>
#include <vector>

#include "hm/tsdf/grid/volume_grid.hpp"
#include "hm/tsdf/projection/projection_scan.hpp"
#include "hm/tsdf/projection/scan_stats.hpp"

namespace hm {

/// Volume updated by a scan, and the effect of the scan on it.
struct ScannedVolume {
  VolumeKey key;
  Volume* volume = nullptr;     ///< nullptr: does not exist, no update
  bool created = false;         ///< by this scan
  bool colors_created = false;  ///< likewise
  bool had_interior = false;    ///< its interior mark (VolumeGrid::may_hold_interior) before the scan
  VolumeUpdate update;
  // Contents after carving (see note_contents):
  bool holds_known = false;
  bool holds_interior = false;  ///< a known voxel at distance <= 0
};

/// Determines the contents of a volume after carving. May be called for different volumes on several threads.
void note_contents(ScannedVolume& scanned);

/// Ends a scan; its volumes must be sorted by z, y, x. Counts, lists the changed volumes in the same order,
/// updates the interior marks, and releases volumes and colour planes that the scan created but did not use.
/// Carved volumes and their neighbours are released when no surface needs them: a volume is kept while it or
/// one of its 26 neighbours holds a voxel on or behind a surface; one with only unknown voxels is always
/// released.
void finalise_scan(VolumeGrid& grid, std::span<const ScannedVolume> scanned, ScanStats& stats);

}  // namespace hm
