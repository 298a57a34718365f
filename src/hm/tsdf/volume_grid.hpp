#pragma once
#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include "hm/geometry/box.hpp"
#include "hm/tsdf/volume.hpp"

namespace hm {

/// The dynamic spatially hashed volume grid (dissertation 4.2.7): volumes by key, in pooled memory.
///
/// A voxel with world index i (per axis) has its centre at (i + 0.5) * voxel_size_m. Volumes are grouped
/// in pages of 4 x 4 x 4, so that a query hashes a page and the cost of walking a region follows the
/// region. One thread may change the grid; any number may read it while none changes it.
class VolumeGrid {
 public:
  /// `sdf_unit_m` is the distance of one unit in TsdfVoxel::sdf(); `max_bytes` caps map_bytes() (0: no cap).
  VolumeGrid(double voxel_size_m, double sdf_unit_m, std::size_t max_bytes = 0);
  ~VolumeGrid();
  VolumeGrid(VolumeGrid&&) noexcept;
  VolumeGrid& operator=(VolumeGrid&&) noexcept;

  [[nodiscard]] double voxel_size_m() const { return voxel_size_m_; }
  [[nodiscard]] double sdf_unit_m() const { return sdf_unit_m_; }
  [[nodiscard]] double volume_size_m() const { return voxel_size_m_ * kVolumeSide; }

  /// The volume with this key, or nullptr. The pointer is valid until the volume is released; the grid
  /// may grow meanwhile.
  [[nodiscard]] const Volume* find(VolumeKey key) const;
  Volume* find(VolumeKey key);
  /// The volume and its interior mark (see below) with one look at the index.
  struct Found {
    Volume* volume = nullptr;
    bool may_hold_interior = false;
  };
  Found find_marked(VolumeKey key);
  /// Makes the volume (all unknown) unless it is there; nullptr when the memory cap forbids it.
  Volume* allocate(VolumeKey key);
  /// Gives the volume a colour plane (all zero) unless it has one; false when the memory cap forbids it.
  bool allocate_colors(Volume& volume);
  /// Gives the volume's memory back; `release_unused` when its voxels are as allocate() made them.
  void release(VolumeKey key);
  void release_unused(VolumeKey key);
  /// Gives the colour plane back; `release_unused_colors` when nothing was written to it.
  void release_colors(Volume& volume);
  void release_unused_colors(Volume& volume);

  [[nodiscard]] std::size_t volume_count() const;
  /// All keys, sorted by z, then y, then x.
  [[nodiscard]] std::vector<VolumeKey> sorted_keys() const;
  /// Keys of the volumes that overlap a box in world coordinates, sorted likewise; cost follows the box.
  [[nodiscard]] std::vector<VolumeKey> keys_in(const Box3& box) const;
  /// The box around all volumes, metres; empty for an empty grid.
  [[nodiscard]] Box3 bounds() const;

  /// Bytes held for volumes in use, colour planes in use, and the index.
  [[nodiscard]] std::size_t map_bytes() const;
  [[nodiscard]] std::size_t max_bytes() const;
  /// Changes the cap (0: none). What is there stays, even when it is more.
  void set_max_bytes(std::size_t max_bytes);

  /// The volume that holds a world position, and the voxel nearest to it.
  [[nodiscard]] VolumeKey key_of(const Vec3& p_world) const;
  /// The voxel with this world index; unknown where there is no volume.
  [[nodiscard]] TsdfVoxel voxel(int x, int y, int z) const;
  /// The voxel whose cell holds a world position; nothing where it is unknown.
  [[nodiscard]] std::optional<double> distance_at_voxel(const Vec3& p_world) const;
  /// Trilinear signed distance (metres) and its gradient (metres per metre) at a world position; nothing
  /// when one of the 8 surrounding voxels is unknown.
  struct Sample {
    double distance_m = 0;
    Vec3 gradient = Vec3::Zero();
  };
  [[nodiscard]] std::optional<Sample> sample(const Vec3& p_world) const;

  // ---- what integrators note for space carving ----
  /// Notes whether a volume may hold voxels on or behind a surface (known, distance <= 0).
  void set_may_hold_interior(VolumeKey key, bool may_hold);
  [[nodiscard]] bool may_hold_interior(VolumeKey key) const;
  /// Appends the volumes that may hold such voxels from all pages that overlap a box, unsorted.
  void find_interior(const Box3& box, std::vector<VolumeKey>& unsorted_keys) const;

 private:
  void release(VolumeKey key, bool dirty);
  template <class Visitor>
  void visit_pages(const Box3& box, Visitor&& visit) const;
  struct Impl;
  double voxel_size_m_ = 0.02;
  double sdf_unit_m_ = 1e-5;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hm
