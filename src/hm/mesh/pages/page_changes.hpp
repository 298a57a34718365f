#pragma once
#include <chrono>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "hm/mesh/incremental_mesher.hpp"
#include "hm/tsdf/grid/volume_snapshot.hpp"

namespace hm {

/// A page of a growing mesh as it was at a moment: immutable, for other threads.
struct MeshPageCopy {
  VolumeKey key;
  std::uint32_t version = 0;  ///< of this page, from 1
  double voxel_size_m = 0;
  std::vector<VolumeMesh> volumes;  ///< with triangles, in ScanOrder; empty: nothing is there any more
  std::chrono::steady_clock::time_point changed_at;  ///< the oldest change that earlier copies do not have
};

/// The mesh of a page, welded.
TriangleMesh mesh_of(const MeshPageCopy& page);

/// A volume of a growing mesh at a moment; without triangles: nothing is there any more.
struct MeshedVolume {
  VolumeKey key;
  VolumeMesh mesh;
};

/// Appends the meshes of these volumes as they are now.
void append_updates(const IncrementalMesher& mesher, std::span<const VolumeKey> keys,
                    std::vector<MeshedVolume>& updates);

/// Follows an IncrementalMesher by what it says has changed, on whatever thread: which pages have changed,
/// and copies of them, no more often than every `interval` each.
class PageChanges {
 public:
  using Clock = std::chrono::steady_clock;

  explicit PageChanges(Clock::duration interval = std::chrono::milliseconds(500)) : interval_(interval) {}

  /// These volumes have changed (MeshUpdateStats::updated): each call after the mesher's next update, all of
  /// them.
  void note(std::span<const MeshedVolume> updated, Clock::time_point now);
  /// Another mesh takes the place of this one: empty copies of all pages that were copied.
  std::vector<MeshPageCopy> clear(Clock::time_point now);
  /// Copies of the changed pages whose last copy is old enough, longest waiting first.
  std::vector<MeshPageCopy> take_due(double voxel_size_m, Clock::time_point now);
  /// Copies of all changed pages.
  std::vector<MeshPageCopy> take_all(double voxel_size_m);
  [[nodiscard]] std::size_t waiting() const { return waiting_.size(); }

 private:
  struct State {
    std::vector<VolumeMesh> volumes;  ///< with triangles, in ScanOrder
    std::uint64_t places = 0;         ///< theirs in the page
    std::uint32_t version = 0;        ///< of the last copy; 0: none yet
    Clock::time_point copied_at;
    bool is_waiting = false;
    Clock::time_point since;  ///< the oldest change that no copy has

    void set(const MeshedVolume& volume);
  };
  using Pages = std::map<VolumeKey, State, PageOrder>;
  static MeshPageCopy copy(Pages::value_type& page, double voxel_size_m);

  Clock::duration interval_;
  Pages pages_;
  std::vector<Pages::value_type*> waiting_;  // longest waiting first
};

}  // namespace hm
