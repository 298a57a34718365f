#include "hm/mesh/pages/page_changes.hpp"

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
  Pages::value_type* page = nullptr;  // neighbours in `updated` are often of one page
  for (const VolumeKey volume : updated) {
    const VolumeKey key = page_of(volume);
    if (!page || page->first != key) page = &*pages_.try_emplace(key).first;
    State& state = page->second;
    state.places |= place_bit(volume);
    if (state.is_waiting) continue;
    state.is_waiting = true;
    state.since = now;
    waiting_.push_back(page);
  }
}

std::vector<MeshPageCopy> PageChanges::clear(Clock::time_point now) {
  waiting_.clear();
  std::erase_if(pages_, [](const auto& page) { return page.second.version == 0; });
  std::vector<MeshPageCopy> gone;
  for (auto& [key, state] : pages_) {
    const std::uint32_t version = state.version + 1;
    gone.push_back({key, version, 0, {}, now});
    state = {};  // its next copy is due at once
    state.version = version;
  }
  return gone;
}

MeshPageCopy PageChanges::copy(Pages::value_type& page, const IncrementalMesher& mesher,
                               double voxel_size_m) {
  auto& [page_key, state] = page;
  MeshPageCopy result{page_key, ++state.version, voxel_size_m, {}, state.since};
  result.volumes.reserve(static_cast<std::size_t>(std::popcount(state.places)));
  for (std::uint64_t places = state.places; places != 0; places &= places - 1) {
    const VolumeKey key = key_at(page_key, std::countr_zero(places));
    if (const VolumeMesh* volume = mesher.find(key))
      result.volumes.push_back(*volume);
    else
      state.places &= ~place_bit(key);
  }
  state.is_waiting = false;
  return result;
}

std::vector<MeshPageCopy> PageChanges::take_due(const IncrementalMesher& mesher, double voxel_size_m,
                                                Clock::time_point now) {
  std::vector<MeshPageCopy> copies;
  const auto is_due = [&](Pages::value_type* page) {
    State& state = page->second;
    const bool is_early = state.version > 0 && now - state.copied_at < interval_;
    if (is_early || copies.size() >= kMostCopies) return false;
    copies.push_back(copy(*page, mesher, voxel_size_m));
    state.copied_at = now;
    return true;
  };
  std::erase_if(waiting_, is_due);
  return copies;
}

std::vector<MeshPageCopy> PageChanges::take_all(const IncrementalMesher& mesher, double voxel_size_m) {
  std::vector<MeshPageCopy> copies;
  for (Pages::value_type* page : waiting_) copies.push_back(copy(*page, mesher, voxel_size_m));
  waiting_.clear();
  return copies;
}

}  // namespace hm
