#include "hm/mapping/observation_log.hpp"

#include <algorithm>
#include <utility>

namespace hm {
namespace {

constexpr std::size_t kGroupFrames = 15;

}  // namespace

void sort_and_unite(std::vector<VolumeKey>& keys) {
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
}

void ObservationLog::note(const Observation& observation, std::span<const ChangedVolume> changed) {
  growing_.observations.push_back(observation);
  for (const ChangedVolume& volume : changed) growing_.volumes.push_back(volume.key);
  if (growing_.observations.size() >= kGroupFrames) close();
}

void ObservationLog::close() {
  if (growing_.observations.empty()) return;
  Group ended = std::exchange(growing_, {});
  sort_and_unite(ended.volumes);
  ended.volumes.shrink_to_fit();
  groups_.push_back(std::make_shared<const Group>(std::move(ended)));
}

void ObservationLog::replace(std::size_t place, Group group) {
  groups_[place] = std::make_shared<const Group>(std::move(group));
}

std::vector<Observation> ObservationLog::observations() const {
  std::vector<Observation> all;
  for (const auto& group : groups_)
    all.insert(all.end(), group->observations.begin(), group->observations.end());
  all.insert(all.end(), growing_.observations.begin(), growing_.observations.end());
  return all;
}

std::size_t ObservationLog::frames_mapped() const {
  const std::vector<Observation> all = observations();
  return static_cast<std::size_t>(
      std::count_if(all.begin(), all.end(), [](const Observation& o) { return o.T_map_camera.has_value(); }));
}

}  // namespace hm
