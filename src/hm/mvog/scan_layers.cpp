#include "hm/mvog/scan_layers.hpp"

#include <utility>

namespace hm::mvog {

void ScanLayers::begin(int bottom) {
  bottom_ = bottom;
  index_.clear();
  patches_.clear();
  lately_.fill(nullptr);
  layer_count_ = 0;
  word_count_ = 1;
}

std::size_t ScanLayers::bytes() const {
  return index_.bytes() + patches_.capacity() * sizeof(Patch) + layers_.size() * sizeof(ScanLayer) +
         layers_.capacity() * sizeof(void*) +
         (words_.capacity() + taken_.capacity()) * sizeof(ObservationWord);
}

ScanLayer* ScanLayers::find_or_add(TileKey patch, int number) {
  const std::uint32_t found = index_.find_or_add(patch, static_cast<std::uint32_t>(patches_.size()));
  if (found == patches_.size()) patches_.push_back({patch, nullptr});
  ScanLayer** at = &patches_[found].lowest;
  while (*at && (*at)->number < number) at = &(*at)->above;
  if (*at && (*at)->number == number) return *at;
  if (layer_count_ == layers_.size()) {
    layers_.push_back(std::make_unique<ScanLayer>());
    taken_.resize(layers_.size());
  }
  ScanLayer* added = layers_[layer_count_++].get();
  added->patch = patch;
  added->number = number;
  added->above = *at;
  *at = added;
  return added;
}

[[gnu::noinline]] std::uint32_t ScanLayers::add_word(ScanLayer& layer, unsigned place) {
  if (word_count_ == words_.size()) words_.resize(2 * words_.size());
  words_[word_count_] = {bottom_ + layer.number * 64, 0, 0, 0, 0};
  layer.seen[ScanLayer::tile_at(place)] |= std::uint64_t{1} << ScanLayer::place_in_tile(place);
  return layer.word_at[place] = static_cast<std::uint32_t>(word_count_++);
}

std::uint64_t ScanLayers::columns_seen(const Patch& patch, std::size_t tile) {
  std::uint64_t seen = 0;
  for (const ScanLayer* layer = patch.lowest; layer; layer = layer->above) seen |= layer->seen[tile];
  return seen;
}

std::span<const ObservationWord> ScanLayers::take(const Patch& patch, std::size_t tile,
                                                  unsigned place_in_tile) {
  const unsigned place = ScanLayer::place(static_cast<int>((tile & 3u) * 8 + (place_in_tile & 7u)),
                                          static_cast<int>((tile >> 2) * 8 + (place_in_tile >> 3)));
  const ObservationWord* first = nullptr;
  std::size_t count = 0;
  for (ScanLayer* layer = patch.lowest; layer; layer = layer->above) {
    const std::uint32_t at = std::exchange(layer->word_at[place], 0u);
    if (at == 0) continue;
    layer->seen[tile] &= ~(std::uint64_t{1} << place_in_tile);
    if (count == 1) taken_[0] = *first;
    if (count > 0)
      taken_[count] = words_[at];
    else
      first = &words_[at];
    ++count;
  }
  return {count > 1 ? taken_.data() : first, count};
}

}  // namespace hm::mvog
