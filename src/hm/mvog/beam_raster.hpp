#pragma once
#include <Eigen/Core>
#include <cstdint>

#include "hm/mvog/scan_layers.hpp"

namespace hm::mvog {

/// A point in map units: x and y in columns, z in levels.
using CellPoint = Eigen::Vector3d;

/// Turns the beams of one scan into what it says of each column (2.5.2, Fig. 2.16).
///
/// A beam misses the levels whose middle it crosses in a column, or the one that it leaves the column in
/// where it crosses none. Within a cell of the height of its end, a beam that is not level may be glancing
/// along the surface that it ends on, and such beams would erase floors: where it crosses no middle there, it
/// only brushes the level, but in scans that are told to count it. A beam hits a stretch of two levels (one
/// cell) around its end, and ends beside the columns that lie within a quarter of a cell. In the column of
/// its end a beam flatter than 45 degrees misses nothing. The scan's strongest saying counts for each place.
class BeamRaster {
 public:
  /// Begins a scan. All that the one before said must have been taken.
  /// Most of it should be at the level `bottom` or little above: then columns take few words.
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
  int bottom_ = 0;  ///< heights are counted from this level
  CellPoint origin_ = CellPoint::Zero();
  int origin_x_ = 0, origin_y_ = 0;
  bool count_glancing_ = true;
};

}  // namespace hm::mvog
