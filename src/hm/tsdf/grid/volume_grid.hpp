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

/// The dynamic spatially hashed volume grid (dissertation 4.2.7): volumes by key, in pooled memory.
///
/// A voxel with world index i (per axis) has its centre at (i + 0.5) * voxel_size_m. Volumes are grouped
/// in pages of 4 x 4 x 4, so that a query hashes a page and the cost of walking a region follows the
/// region. One thread may change the grid; any number may read it while none changes it. Volumes that nothing
/// looks at may be packed, which shows nowhere but in map_bytes() and time.
class VolumeGrid {
 public:
  /// `sdf_unit_m` is the distance of one unit in TsdfVoxel::sdf(); `max_bytes` caps unpacked_bytes() (0:
  /// no cap).
  VolumeGrid(double voxel_size_m, double sdf_unit_m, std::size_t max_bytes = 0);
  ~VolumeGrid();
  VolumeGrid(VolumeGrid&&) noexcept;
  VolumeGrid& operator=(VolumeGrid&&) noexcept;

  [[nodiscard]] double voxel_size_m() const { return voxel_size_m_; }
  [[nodiscard]] double sdf_unit_m() const { return sdf_unit_m_; }
  [[nodiscard]] double volume_size_m() const { return voxel_size_m_ * kVolumeSide; }

  /// The volume with this key, or nullptr; unpacks it if need be. The pointer is valid until the volume is
  /// released, its voxels until then or the next pack_idle() or pack(); the grid may grow meanwhile. Who is
  /// going to change the volume asks a grid that is not const, before every scan: snapshots depend on it.
  [[nodiscard]] const Volume* find(VolumeKey key) const;
  Volume* find(VolumeKey key);
  [[nodiscard]] bool contains(VolumeKey key) const;
  /// What the index says of a volume, without unpacking it or promising to change it.
  struct Found {
    Page* page = nullptr;  ///< nullptr: no such volume
    VolumeKey key;
    bool may_hold_interior = false;  ///< see below
  };
  [[nodiscard]] Found look_up(VolumeKey key) const;
  /// The volume of a look-up since which nothing was released, as find() gives it; nullptr if there is none.
  Volume* open(const Found& found);
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

  /// Bytes held for volumes in use, colour planes in use, packed volumes, and the index.
  [[nodiscard]] std::size_t map_bytes() const;
  /// map_bytes() if no volume were packed: what the cap is compared with, so that it acts at the same moment
  /// whatever happens to be packed.
  [[nodiscard]] std::size_t unpacked_bytes() const;
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
  /// Interpolates sample() from the distances (metres) of the eight voxels around a place, x fastest, then y,
  /// then z; `fraction` (0 to 1 on each axis) tells where between them it is.
  static Sample blend(const std::array<double, 8>& corners_m, const Vec3& fraction, double voxel_size_m);

  // ---- packing ----
  /// To be called after every scan: packs pages in which nothing was integrated or unpacked during the last
  /// `idle_calls` calls, some of them at a time (about 400 volumes, a third of a millisecond).
  void pack_idle(int idle_calls = 32);
  /// Packs a volume now.
  void pack(VolumeKey key);

  // ---- snapshots ----
  /// Begins a snapshot of these volumes (an earlier one ends): take_snapshot() gives them as they are now,
  /// while the grid goes on changing. A volume that is about to change is copied before; the others are
  /// copied when they are taken.
  void begin_snapshot(const VolumesByPage& wanted);
  /// The next pages of the snapshot with about as many volumes; nothing when it is complete.
  [[nodiscard]] std::vector<PageSnapshot> take_snapshot(std::size_t volumes);
  [[nodiscard]] bool snapshot_under_way() const;
  /// Forgets the rest of the snapshot.
  void end_snapshot();

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
