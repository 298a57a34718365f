#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "hm/geometry/occupancy.hpp"
#include "hm/geometry/occupancy_grid_2d.hpp"
#include "hm/mvog/beam_scan.hpp"

namespace hm {

/// A volume of the published grid, in cells: density = mass / height is about the mean number of
/// observations of that slab.
struct MvogVolume {
  float bottom = 0, top = 0, mass = 0;
  [[nodiscard]] float density() const { return mass / (top - bottom); }
  bool operator==(const MvogVolume&) const = default;
};
static_assert(sizeof(MvogVolume) == 12);

/// A new volume between two heights: at least one cell high (grown on both sides), density 1.
MvogVolume make_mvog_volume(float z1, float z2);
/// Inserts a volume into a sorted list of disjoint volumes, absorbing every one that it touches or that is
/// closer than `gap` cells; the mass of the gap itself is counted with the densities beside it.
void insert_mvog_volume(std::vector<MvogVolume>& list, MvogVolume volume, float gap = 0);

struct MvogMapParams {
  double resolution_m = 0.10;
  double initial_size_m = 10;
  float gap_cell = 0;
  bool model_negative_space = true;
};

/// The multi-volume occupancy grid as published (dissertation 2.5): a dense horizontal array of cells, each
/// with two sorted lists of disjoint volumes, positive (hits) and negative (passed), merged when they touch.
/// For comparison; `MultiVolumeGrid` is the map to use.
class MvogMap {
 public:
  explicit MvogMap(const MvogMapParams& params = {});

  [[nodiscard]] const MvogMapParams& params() const { return params_; }
  /// Beam by beam (2.5.2); beams without a return are not used, as published.
  BeamScanStats insert(const BeamScan& scan);

  /// rho+ / (rho+ + rho-) of the volumes that hold the point (2.5.3); nothing: unknown.
  [[nodiscard]] std::optional<double> probability_at(const Eigen::Vector3d& p_world) const;
  [[nodiscard]] Occupancy at(const Eigen::Vector3d& p_world, double threshold = 0.5) const;
  /// The greatest stretches of a column on one side of the threshold, bottom to top.
  [[nodiscard]] std::vector<VerticalVolume> volumes_at(const Eigen::Vector2d& p_world,
                                                       double threshold = 0.5) const;
  /// The highest probability within a band of heights (Fig. 2.19).
  [[nodiscard]] OccupancyGrid2D slice(double bottom_m, double top_m) const;
  /// Known cubes of one cell, each with the highest probability inside it.
  [[nodiscard]] std::vector<OccupancyVoxel> voxels(double threshold = 0.5) const;

  [[nodiscard]] std::span<const MvogVolume> positive(int x, int y) const;
  [[nodiscard]] std::span<const MvogVolume> negative(int x, int y) const;
  /// The cell of a point, of the plane, in cells from the origin of the world.
  [[nodiscard]] Eigen::Vector2i cell_of(const Eigen::Vector2d& p_world) const;

  struct Size {
    std::size_t positive = 0, negative = 0, cells_known = 0, cells = 0;
    std::size_t bytes = 0;            ///< as it lies in memory
    std::size_t bytes_published = 0;  ///< as published: 12 a volume, 20 a known cell (32-bit pointers)
  };
  [[nodiscard]] Size size() const;

 private:
  struct Cell {
    std::vector<MvogVolume> positive, negative;
  };
  /// A stretch of one cell in which both densities are constant; cells.
  struct Stretch {
    double bottom, top, probability;
  };
  [[nodiscard]] const Cell* find(int x, int y) const;
  [[nodiscard]] static std::vector<Stretch> stretches(const Cell& cell);
  bool make_room(const Eigen::Vector2i& a, const Eigen::Vector2i& b);
  Cell& cell(int x, int y);
  void add_beam(const Eigen::Vector3d& from, const Eigen::Vector3d& to);
  void add_free_space(const Eigen::Vector3d& from, const Eigen::Vector3d& to);

  MvogMapParams params_;
  Eigen::Vector2i min_ = Eigen::Vector2i::Zero(), size_ = Eigen::Vector2i::Zero();  ///< cells
  std::vector<Cell> cells_;
};

}  // namespace hm
