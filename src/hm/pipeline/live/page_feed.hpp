#pragma once
#include <atomic>
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

  /// The whole mesh of the pages that are in the store, welded; empty without one. Takes a while: not on the
  /// producer's thread.
  [[nodiscard]] TriangleMesh whole_mesh() const;
  /// Surface of all pages, square metres.
  [[nodiscard]] double area_m2() const { return area_m2_; }
  /// Knows the surface of the pages that are in the store.
  [[nodiscard]] SeenShare& seen() { return seen_; }
  /// Processor time of the encoding thread so far, s, pages that it made, and their bytes (finest level).
  struct Work {
    double cpu_s = 0;
    std::size_t pages = 0, triangles = 0, bytes = 0;
  };
  [[nodiscard]] Work work() const;

 private:
  /// Contents of a page.
  struct Source {
    std::shared_ptr<const MeshPageCopy> copy;  ///< or
    std::shared_ptr<const TriangleMesh> mesh;  ///< of a page that is not made of volumes
    double voxel_size_m = 0;
    std::uint32_t version = 0;  ///< 0: the next one
    Time stamp;
  };
  void put(VolumeKey key, Source source);
  void count_area(VolumeKey key, double area_m2);

  LiveStore& store_;
  mutable std::mutex mutex_;  // guards the next two
  std::map<VolumeKey, Source, PageOrder> sources_;
  Work work_;
  std::map<VolumeKey, double, PageOrder> areas_m2_;  // of the encoding thread
  std::atomic<double> area_m2_ = 0;
  SeenShare seen_;
  NewestJobs<VolumeKey, PageOrder> jobs_;
};

}  // namespace hm
