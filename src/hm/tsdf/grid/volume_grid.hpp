#pragma once
#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include "hm/geometry/box.hpp"
#include "hm/tsdf/grid/volume.hpp"
#include "hm/tsdf/grid/volume_snapshot.hpp"

namespace hm {

struct Page;

/// Dynamic spatially hashed volume grid (dissertation 4.2.7): volumes by key, in pooled memory.
///
/// A voxel with world index i (per axis) has its centre at (i + 0.5) * voxel_size_m. Volumes are grouped in
/// pages of 4 x 4 x 4, so that a query hashes a page, and iterating over a region costs time proportional to
/// the region. One thread may change the grid; any number may read it while none changes it. Idle volumes may
/// be packed, which affects only map_bytes() and access time.
class VolumeGrid {
 public:
  /// `sdf_unit_m` is the distance of one unit in TsdfVoxel::sdf(); `max_bytes` limits unpacked_bytes() (0: no
  /// limit).
  VolumeGrid(double voxel_size_m, double sdf_unit_m, std::size_t max_bytes = 0);
  ~VolumeGrid();
  VolumeGrid(VolumeGrid&&) noexcept;
  VolumeGrid& operator=(VolumeGrid&&) noexcept;

  [[nodiscard]] double voxel_size_m() const { return voxel_size_m_; }
  [[nodiscard]] double sdf_unit_m() const { return sdf_unit_m_; }
  [[nodiscard]] double volume_size_m() const { return voxel_size_m_ * kVolumeSide; }

  /// Volume with this key, or nullptr; unpacks it if necessary. The pointer is valid until the volume is
  /// released, its voxels until then or the next pack_idle() or pack(), even if the grid grows. Call the
  /// non-const version before changing the volume, for every scan: snapshots depend on it.
  [[nodiscard]] const Volume* find(VolumeKey key) const;
  Volume* find(VolumeKey key);
  [[nodiscard]] bool contains(VolumeKey key) const;
  /// Index entry of a volume, without unpacking it or declaring a change.
  struct Found {
    Page* page = nullptr;  ///< nullptr: no such volume
    VolumeKey key;
    bool may_hold_interior = false;  ///< see below
  };
  [[nodiscard]] Found look_up(VolumeKey key) const;
  /// Volume of a look-up, as from find(); nullptr if there is none. Nothing may have been released since the
  /// look-up.
  Volume* open(const Found& found);
  /// Creates the volume (all unknown) unless it exists; nullptr when the memory limit is reached.
  Volume* allocate(VolumeKey key);
  /// Adds a colour plane (all zero) unless it exists; false when the memory limit is reached.
  bool allocate_colors(Volume& volume);
  /// Releases the volume's memory; `release_unused` if its voxels are unchanged since allocate().
  void release(VolumeKey key);
  void release_unused(VolumeKey key);
  /// Releases the colour plane; `release_unused_colors` if nothing was written to it.
  void release_colors(Volume& volume);
  void release_unused_colors(Volume& volume);

  [[nodiscard]] std::size_t volume_count() const;
  /// All keys, sorted by z, then y, then x.
  [[nodiscard]] std::vector<VolumeKey> sorted_keys() const;
  /// Keys of the volumes that overlap a box in world coordinates, sorted likewise; the cost is proportional
  /// to the box.
  [[nodiscard]] std::vector<VolumeKey> keys_in(const Box3& box) const;
  /// Bounding box of all volumes, metres; empty for an empty grid.
  [[nodiscard]] Box3 bounds() const;

  /// Memory of volumes, colour planes, packed volumes and the index, in bytes.
  [[nodiscard]] std::size_t map_bytes() const;
  /// The same as if no volume were packed. This is compared with the limit, so that it does not depend on
  /// packing.
  [[nodiscard]] std::size_t unpacked_bytes() const;
  [[nodiscard]] std::size_t max_bytes() const;
  /// How often the limit has kept allocate() from creating a volume.
  [[nodiscard]] std::size_t volumes_refused() const;
  /// Changes the limit (0: none). Existing volumes are kept even if they exceed it.
  void set_max_bytes(std::size_t max_bytes);

  /// Key of the volume that contains a world position.
  [[nodiscard]] VolumeKey key_of(const Vec3& p_world) const;
  /// Voxel with this world index; unknown where there is no volume.
  [[nodiscard]] TsdfVoxel voxel(int x, int y, int z) const;
  /// Distance (metres) of the voxel whose cell contains a world position; nothing if unknown.
  [[nodiscard]] std::optional<double> distance_at_voxel(const Vec3& p_world) const;
  /// Trilinear signed distance (metres) and its gradient (metres per metre) at a world position; nothing
  /// when one of the 8 surrounding voxels is unknown.
  struct Sample {
    double distance_m = 0;
    Vec3 gradient = Vec3::Zero();
  };
  [[nodiscard]] std::optional<Sample> sample(const Vec3& p_world) const;
  /// Trilinear interpolation of the distances (metres) of eight neighbouring voxels, x fastest, then y, then
  /// z; `fraction` is the position between them, 0 to 1 on each axis.
  static Sample blend(const std::array<double, 8>& corners_m, const Vec3& fraction, double voxel_size_m);

  // ---- packing ----
  /// Packs pages that were not used during the last `idle_calls` calls, some at a time (about 400 volumes, a
  /// third of a millisecond). Call after every scan.
  void pack_idle(int idle_calls = 32);
  /// Packs a volume now.
  void pack(VolumeKey key);

  // ---- snapshots ----
  /// Starts a snapshot of these volumes (and ends an earlier one): take_snapshot() returns them as they are
  /// now, while the grid may change. A volume is copied before it changes; the others are copied when taken.
  void begin_snapshot(const VolumesByPage& wanted);
  /// Returns the next pages of the snapshot with about `volumes` volumes; empty when it is complete.
  [[nodiscard]] std::vector<PageSnapshot> take_snapshot(std::size_t volumes);
  [[nodiscard]] bool snapshot_under_way() const;
  /// Discards the rest of the snapshot.
  void end_snapshot();

  // ---- marks for space carving, set by integrators ----
  /// Marks whether a volume may hold voxels on or behind a surface (known, distance <= 0).
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
