#pragma once
#include <span>
#include <vector>

#include "hm/tsdf/grid/volume_grid.hpp"
#include "hm/tsdf/projection/projection_scan.hpp"
#include "hm/tsdf/projection/scan_stats.hpp"

namespace hm {

/// A volume that a scan is written into, and what the scan did to it.
struct ScannedVolume {
  VolumeKey key;
  Volume* volume = nullptr;     ///< nullptr: it is not there, and nothing happens
  bool created = false;         ///< by this scan
  bool colors_created = false;  ///< likewise
  bool had_interior = false;    ///< its interior mark (VolumeGrid::may_hold_interior) before the scan
  VolumeUpdate update;
  // What carving left (see note_contents):
  bool holds_known = false;
  bool holds_interior = false;  ///< a known voxel at distance <= 0
};

/// After the scan carved in a volume: looks at what is left. Volumes may be looked at on several threads.
void note_contents(ScannedVolume& scanned);

/// Ends a scan, its volumes sorted by z, y, x: counts, lists what changed in the same order, renews the
/// interior marks, and gives back volumes and colour planes that the scan made for nothing. Volumes that
/// carving took weight from, and those around them, go when no surface needs them any more: a volume is kept
/// while it, or one of its 26 neighbours, holds a voxel on or behind a surface; one whose voxels are all
/// unknown goes anyway.
void finalise_scan(VolumeGrid& grid, std::span<const ScannedVolume> scanned, ScanStats& stats);

}  // namespace hm
