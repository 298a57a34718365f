#pragma once
#include <map>
#include <memory>
#include <mutex>
#include <vector>

#include "hm/core/time.hpp"
#include "hm/geometry/triangle_mesh.hpp"
#include "hm/mesh/pages/page_changes.hpp"
#include "hm/pipeline/live/newest_jobs.hpp"
#include "hm/pipeline/live/seen_share.hpp"
#include "hm/station/live_store.hpp"

namespace hm {

/// Encodes pages of a mesh on a thread of its own and puts them into a store. Of a page that changes faster
/// than it can be encoded only the newest copy is.
class PageFeed {
 public:
  explicit PageFeed(LiveStore& store) : store_(store) {}

  /// Returns at once.
  void give(std::vector<MeshPageCopy> pages, Time stamp);
  /// A page of a mesh that is not that of a map.
  void give(VolumeKey page, TriangleMesh mesh, double voxel_size_m);
  /// Until everything that was given is in the store.
  void wait() { jobs_.wait(); }

  /// The whole mesh of the pages that were given so far, welded; empty without one. Takes a while: not on the
  /// producer's thread.
  [[nodiscard]] TriangleMesh whole_mesh() const;
  /// Surface of all pages, square metres.
  [[nodiscard]] double area_m2() const;
  /// Knows the surface of the pages that are in the store.
  [[nodiscard]] SeenShare& seen() { return seen_; }
  /// Processor time of the encoding thread so far, s, pages that it made, and their bytes (finest level).
  struct Work {
    double cpu_s = 0;
    std::size_t pages = 0, triangles = 0, bytes = 0;
  };
  [[nodiscard]] Work work() const;

 private:
  /// What a page is made of.
  struct Source {
    std::shared_ptr<const MeshPageCopy> copy;  ///< or
    std::shared_ptr<const TriangleMesh> mesh;  ///< of a page that is not made of volumes
    double voxel_size_m = 0;
    std::uint32_t version = 0;
    Time stamp;
  };
  void put(VolumeKey key, const Source& source);

  LiveStore& store_;
  mutable std::mutex mutex_;  // guards the next three
  std::map<VolumeKey, Source, PageOrder> sources_;
  std::map<VolumeKey, double, PageOrder> areas_m2_;
  Work work_;
  SeenShare seen_;
  NewestJobs<VolumeKey, PageOrder> jobs_;
};

}  // namespace hm
