#pragma once
#include <Eigen/Core>
#include <cstdint>

#include "hm/mvog/scan_layers.hpp"

namespace hm::mvog {

/// Point in map units: x and y in columns, z in levels.
using CellPoint = Eigen::Vector3d;

/// Rasterises the beams of one scan into observations of each column (dissertation 2.5.2, Fig. 2.16).
///
/// A beam misses the levels whose centre it crosses in a column, or, if it crosses none, the level in which
/// it leaves the column. Within one cell of the height of its end, a beam that is not level may graze the
/// surface it ends on, and would erase floors: if it crosses no centre there, it only brushes the level,
/// except in scans with `count_glancing`. A beam hits two levels (one cell) around its end, and marks the
/// columns within a quarter of a cell as beside its end. In the column of its end a beam flatter than 45
/// degrees misses nothing. For each level the strongest observation of the scan counts.
class BeamRaster {
 public:
  /// Begins a scan. All observations of the previous one must have been taken. Levels are stored from
  /// `bottom` up; columns take few words if most beams are little above it.
  void begin(const CellPoint& origin, int bottom, bool count_glancing);
  void add_return(const CellPoint& end);
  void add_no_return(const CellPoint& end);

  [[nodiscard]] ScanLayers& layers() { return layers_; }
  [[nodiscard]] const ScanLayers& layers() const { return layers_; }

 private:
  struct Walk;
  enum class BeamEnd { kFlatReturn, kSteepReturn, kNothing };
  void walk(const CellPoint& end, BeamEnd kind);
  template <bool kRises, bool kNearEnd>
  void walk_in_layer(Walk& walk, ScanLayer& layer);
  void mark_column(const Walk& walk, std::int64_t to_z);
  void mark_end(const CellPoint& end);

  ScanLayers layers_;
  int bottom_ = 0;  ///< lowest level of the scan
  CellPoint origin_ = CellPoint::Zero();
  int origin_x_ = 0, origin_y_ = 0;
  bool count_glancing_ = true;
};

}  // namespace hm::mvog
