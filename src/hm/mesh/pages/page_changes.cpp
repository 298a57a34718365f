#include "hm/mesh/pages/page_changes.hpp"

#include <bit>

#include "hm/core/parallel.hpp"
#include "hm/mesh/whole_mesh.hpp"

namespace hm {

TriangleMesh mesh_of(const MeshPageCopy& page) {
  if (page.volumes.empty()) return {};
  std::vector<const VolumeMesh*> volumes;
  for (const VolumeMesh& volume : page.volumes) volumes.push_back(&volume);
  const ParallelLoop alone(1);
  return weld(volumes, page.voxel_size_m, alone);
}

void append_updates(const IncrementalMesher& mesher, std::span<const VolumeKey> keys,
                    std::vector<MeshedVolume>& updates) {
  for (const VolumeKey key : keys) {
    const VolumeMesh* mesh = mesher.find(key);
    updates.push_back({key, mesh ? *mesh : VolumeMesh()});
  }
}

void PageChanges::State::set(const MeshedVolume& volume) {
  const std::uint64_t bit = place_bit(volume.key);
  const auto at = volumes.begin() + std::popcount(places & (bit - 1));
  const bool was_there = (places & bit) != 0;
  if (volume.mesh.empty()) {
    if (was_there) volumes.erase(at);
    places &= ~bit;
  } else if (was_there) {
    *at = volume.mesh;
  } else {
    volumes.insert(at, volume.mesh);
    places |= bit;
  }
}

void PageChanges::note(std::span<const MeshedVolume> updated, Clock::time_point now) {
  Pages::value_type* page = nullptr;  // neighbours in `updated` are often of one page
  for (const MeshedVolume& volume : updated) {
    const VolumeKey key = page_of(volume.key);
    if (!page || page->first != key) page = &*pages_.try_emplace(key).first;
    State& state = page->second;
    state.set(volume);
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

MeshPageCopy PageChanges::copy(Pages::value_type& page, double voxel_size_m) {
  auto& [key, state] = page;
  state.is_waiting = false;
  return {key, ++state.version, voxel_size_m, state.volumes, state.since};
}

std::vector<MeshPageCopy> PageChanges::take_due(double voxel_size_m, Clock::time_point now) {
  std::vector<MeshPageCopy> copies;
  const auto is_due = [&](Pages::value_type* page) {
    State& state = page->second;
    if (state.version > 0 && now - state.copied_at < interval_) return false;
    copies.push_back(copy(*page, voxel_size_m));
    state.copied_at = now;
    return true;
  };
  std::erase_if(waiting_, is_due);
  return copies;
}

std::vector<MeshPageCopy> PageChanges::take_all(double voxel_size_m) {
  std::vector<MeshPageCopy> copies;
  for (Pages::value_type* page : waiting_) copies.push_back(copy(*page, voxel_size_m));
  waiting_.clear();
  return copies;
}

}  // namespace hm
