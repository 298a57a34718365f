#include "hm/pipeline/live/page_feed.hpp"

#include <algorithm>
#include <utility>

#include "hm/core/parallel.hpp"
#include "hm/core/stopwatch.hpp"
#include "hm/mesh/pages/mesh_page.hpp"
#include "hm/mesh/whole_mesh.hpp"
#include "hm/pipeline/live/page_frame.hpp"
#include "hm/station/live_frames.hpp"
#include "hm/tsdf/grid/page_table.hpp"

namespace hm {
namespace {

/// Levels are left out where they would be nearly the finest one again.
constexpr double kWorthwhileShare = 0.8;

}  // namespace

void PageFeed::give(std::vector<MeshPageCopy> pages, Time stamp) {
  std::vector<std::pair<VolumeKey, std::function<void()>>> jobs;
  jobs.reserve(pages.size());
  for (MeshPageCopy& page : pages) {
    const VolumeKey key = page.key;
    Source source{std::make_shared<const MeshPageCopy>(std::move(page)), nullptr, page.voxel_size_m,
                  page.version, stamp};
    jobs.emplace_back(key, [this, key, source = std::move(source)] { put(key, source); });
  }
  jobs_.give(std::move(jobs));
}

void PageFeed::give(VolumeKey page, TriangleMesh mesh, double voxel_size_m) {
  Source source{nullptr, std::make_shared<const TriangleMesh>(std::move(mesh)), voxel_size_m, 0, Time{}};
  jobs_.give(page, [this, page, source = std::move(source)] { put(page, source); });
}

void PageFeed::put(VolumeKey key, Source source) {
  Source old;  // freed here rather than on the producer's thread
  {
    const std::lock_guard lock(mutex_);
    Source& kept = sources_[key];
    if (source.version == 0) source.version = kept.version + 1;
    old = std::exchange(kept, source);
  }
  const TriangleMesh mesh = source.mesh ? *source.mesh : mesh_of(*source.copy);
  const PageKey page{key.x, key.y, key.z};
  seen_.set_page(key, mesh, source.voxel_size_m);
  if (mesh.triangles.empty()) {
    store_.remove_page(page, source.version, source.stamp);
    count_area(key, 0);
    return;
  }
  auto encoded = encode_page(key, mesh, source.voxel_size_m);
  PageLevels levels;
  const double side_m = kPageSide * kVolumeSide * source.voxel_size_m;
  levels.center_m = (Vec3(key.x, key.y, key.z) + Vec3::Constant(0.5)) * side_m;
  std::size_t before = 0, bytes = 0;
  for (std::size_t level = 0; level < kPageLevels; ++level) {
    EncodedPage& from = encoded[level];
    const std::size_t size = from.vertex_bytes.size() + from.index_bytes.size();
    if (level == 0) bytes = size;
    if (level > 0 && static_cast<double>(size) > kWorthwhileShare * static_cast<double>(before)) continue;
    before = size;
    levels.levels[level] = std::make_shared<const std::vector<std::byte>>(
        to_payload(page_frame(key, source.version, level, std::move(from))));
  }
  store_.put_page(page, source.version, source.stamp, std::move(levels));
  count_area(key, surface_area(mesh));
  const std::lock_guard lock(mutex_);
  work_.cpu_s = thread_cpu_s();
  ++work_.pages;
  work_.triangles += mesh.triangles.size();
  work_.bytes += bytes;
}

TriangleMesh PageFeed::whole_mesh() const {
  std::vector<Source> sources;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [key, source] : sources_) sources.push_back(source);
  }
  std::vector<const VolumeMesh*> volumes;
  TriangleMesh loose;       // of pages that are not made of volumes
  double voxel_size_m = 0;  // pages that are empty by now have none
  for (const Source& source : sources) {
    if (source.copy && !source.copy->volumes.empty()) {
      voxel_size_m = source.voxel_size_m;
      for (const VolumeMesh& volume : source.copy->volumes) volumes.push_back(&volume);
    }
    if (!source.mesh) continue;
    const auto first = static_cast<std::uint32_t>(loose.vertices.size());
    loose.vertices.insert(loose.vertices.end(), source.mesh->vertices.begin(), source.mesh->vertices.end());
    loose.normals.insert(loose.normals.end(), source.mesh->normals.begin(), source.mesh->normals.end());
    loose.colors.insert(loose.colors.end(), source.mesh->colors.begin(), source.mesh->colors.end());
    for (const auto& [a, b, c] : source.mesh->triangles)
      loose.triangles.push_back({a + first, b + first, c + first});
  }
  if (volumes.empty()) return loose;
  std::sort(volumes.begin(), volumes.end(),
            [](const VolumeMesh* a, const VolumeMesh* b) { return ScanOrder()(a->key(), b->key()); });
  return weld(volumes, voxel_size_m, ParallelLoop(1));
}

void PageFeed::count_area(VolumeKey key, double area_m2) {
  double& counted_m2 = areas_m2_[key];
  area_m2_ = std::max(0.0, area_m2_ + area_m2 - counted_m2);
  counted_m2 = area_m2;
}

PageFeed::Work PageFeed::work() const {
  const std::lock_guard lock(mutex_);
  return work_;
}

}  // namespace hm
