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

/// Volume of the published grid, in cells; density = mass / height is about the mean number of observations.
struct MvogVolume {
  float bottom = 0, top = 0, mass = 0;
  [[nodiscard]] float density() const { return mass / (top - bottom); }
  bool operator==(const MvogVolume&) const = default;
};
static_assert(sizeof(MvogVolume) == 12);

/// Creates a volume between two heights with density 1; extended on both sides to at least one cell.
MvogVolume make_mvog_volume(float z1, float z2);
/// Inserts a volume into a sorted list of disjoint volumes and merges it with all that touch it or are closer
/// than `gap` cells; the gap's mass is computed with the adjacent densities.
void insert_mvog_volume(std::vector<MvogVolume>& list, MvogVolume volume, float gap = 0);

struct PublishedMvogParams {
  double resolution_m = 0.10;
  double initial_size_m = 10;
  float gap_cell = 0;
  bool model_negative_space = true;
};

/// Multi-volume occupancy grid as published (dissertation 2.5): a dense horizontal array of cells, each with
/// two sorted lists of disjoint volumes, positive (hits) and negative (passed), merged when they touch. For
/// comparison only; use `MultiVolumeGrid`.
class PublishedMvog {
 public:
  explicit PublishedMvog(const PublishedMvogParams& params = {});

  [[nodiscard]] const PublishedMvogParams& params() const { return params_; }
  /// Inserts a scan beam by beam (2.5.2); beams without a return are ignored, as published.
  BeamScanStats insert(const BeamScan& scan);

  /// Probability of being occupied, rho+ / (rho+ + rho-) of the volumes that contain the point (2.5.3);
  /// nothing: unknown.
  [[nodiscard]] std::optional<double> probability_at(const Eigen::Vector3d& p_world) const;
  [[nodiscard]] Occupancy at(const Eigen::Vector3d& p_world, double threshold = 0.5) const;
  /// Maximal intervals of a column on one side of the threshold, bottom to top.
  [[nodiscard]] std::vector<VerticalVolume> volumes_at(const Eigen::Vector2d& p_world,
                                                       double threshold = 0.5) const;
  /// Highest probability within a height interval (Fig. 2.19).
  [[nodiscard]] OccupancyGrid2D slice(double bottom_m, double top_m) const;
  /// Known cubes of one cell, each with its highest probability.
  [[nodiscard]] std::vector<OccupancyVoxel> voxels(double threshold = 0.5) const;

  [[nodiscard]] std::span<const MvogVolume> positive(int x, int y) const;
  [[nodiscard]] std::span<const MvogVolume> negative(int x, int y) const;
  /// Cell of a point of the plane, counted from the world's origin.
  [[nodiscard]] Eigen::Vector2i cell_of(const Eigen::Vector2d& p_world) const;

  struct Size {
    std::size_t positive = 0, negative = 0, cells_known = 0, cells = 0;
    std::size_t bytes = 0;            ///< in memory
    std::size_t bytes_published = 0;  ///< as published: 12 per volume, 20 per known cell (32-bit pointers)
  };
  [[nodiscard]] Size size() const;

 private:
  struct Cell {
    std::vector<MvogVolume> positive, negative;
  };
  /// Interval of one cell with constant densities; in cells.
  struct Stretch {
    double bottom, top, probability;
  };
  [[nodiscard]] const Cell* find(int x, int y) const;
  [[nodiscard]] static std::vector<Stretch> stretches(const Cell& cell);
  bool make_room(const Eigen::Vector2i& a, const Eigen::Vector2i& b);
  Cell& cell(int x, int y);
  void add_beam(const Eigen::Vector3d& from, const Eigen::Vector3d& to);
  void add_free_space(const Eigen::Vector3d& from, const Eigen::Vector3d& to);

  PublishedMvogParams params_;
  Eigen::Vector2i min_ = Eigen::Vector2i::Zero(), size_ = Eigen::Vector2i::Zero();  ///< cells
  std::vector<Cell> cells_;
};

}  // namespace hm
