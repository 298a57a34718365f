#include "hm/mesh/pages/page_changes.hpp"

#include <algorithm>
#include <bit>

#include "hm/core/parallel.hpp"
#include "hm/mesh/whole_mesh.hpp"
#include "hm/tsdf/grid/page_table.hpp"

namespace hm {

TriangleMesh mesh_of(const MeshPageCopy& page) {
  if (page.volumes.empty()) return {};
  std::vector<const VolumeMesh*> volumes;
  for (const VolumeMesh& volume : page.volumes) volumes.push_back(&volume);
  const ParallelLoop alone(1);
  return weld(volumes, page.voxel_size_m, alone);
}

void PageChanges::note(std::span<const VolumeKey> updated, Clock::time_point now) {
  for (const VolumeKey volume : updated) {
    const VolumeKey page = page_of(volume);
    volumes_.try_emplace(page, ~std::uint64_t{0}).first->second |= place_bit(volume);
    if (waiting_.insert(page).second) order_.push_back({page, now});
  }
}

std::vector<MeshPageCopy> PageChanges::clear(Clock::time_point now) {
  std::vector<MeshPageCopy> gone;
  for (auto& [page, copied] : copied_) {
    gone.push_back({page, ++copied.version, 0, {}, now});
    copied.at = {};  // its next copy is due at once
  }
  volumes_.clear();
  order_.clear();
  waiting_.clear();
  return gone;
}

MeshPageCopy PageChanges::copy(const Waiting& waiting, const IncrementalMesher& mesher, double voxel_size_m) {
  MeshPageCopy page{waiting.page, ++copied_[waiting.page].version, voxel_size_m, {}, waiting.since};
  std::uint64_t& there = volumes_[waiting.page];
  for (std::uint64_t places = there; places != 0; places &= places - 1) {
    const VolumeKey key = key_at(waiting.page, std::countr_zero(places));
    if (const VolumeMesh* volume = mesher.find(key))
      page.volumes.push_back(*volume);
    else
      there &= ~place_bit(key);
  }
  return page;
}

std::vector<MeshPageCopy> PageChanges::take_due(const IncrementalMesher& mesher, double voxel_size_m,
                                                Clock::time_point now) {
  std::vector<MeshPageCopy> pages;
  std::vector<Waiting> early;
  for (const Waiting& waiting : order_) {
    const auto before = copied_.find(waiting.page);
    const bool is_early = before != copied_.end() && now - before->second.at < interval_;
    if (is_early || pages.size() >= kMostCopies) {
      early.push_back(waiting);
      continue;
    }
    pages.push_back(copy(waiting, mesher, voxel_size_m));
    copied_[waiting.page].at = now;
    waiting_.erase(waiting.page);
  }
  order_ = std::move(early);
  return pages;
}

std::vector<MeshPageCopy> PageChanges::take_all(const IncrementalMesher& mesher, double voxel_size_m) {
  std::vector<MeshPageCopy> pages;
  for (const Waiting& waiting : order_) pages.push_back(copy(waiting, mesher, voxel_size_m));
  order_.clear();
  waiting_.clear();
  return pages;
}

}  // namespace hm
