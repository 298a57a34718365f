// What the beams of a scan say together: the second half of BeamRaster.
#include <bit>
#include <utility>

#include "hm/mvog/beam_raster.hpp"

namespace hm::mvog {

std::uint64_t BeamRaster::columns_seen(const ScanTile& tile) const {
  std::uint64_t seen = 0;
  for (std::uint32_t at = tile.lowest; at != kNone; at = layers_[at].above) seen |= layers_[at].seen;
  return seen;
}

void BeamRaster::take_sayings(const ScanTile& tile, std::size_t place, std::vector<SayingStart>& out) {
  out.clear();
  Saying before = Saying::kNothing;
  int base = 0;
  for (std::uint32_t at = tile.lowest; at != kNone; at = layers_[at].above) {
    Layer& layer = layers_[at];
    if ((layer.seen >> place & 1u) == 0) continue;
    layer.seen &= ~(std::uint64_t{1} << place);
    Word w = std::exchange(layer.columns[place], Word{});
    if (before != Saying::kNothing && base + 64 != layer.word * 64) {
      out.push_back({base + 64, Saying::kNothing});
      before = Saying::kNothing;
    }
    base = layer.word * 64;
    w.miss &= ~w.hit;
    w.near_hit &= ~(w.hit | w.miss);
    w.brush &= ~(w.hit | w.miss | w.near_hit);
    const auto edges = [&](std::uint64_t plane, Saying saying) {
      return plane ^ (plane << 1 | (before == saying ? 1u : 0u));
    };
    std::uint64_t starts = edges(w.hit, Saying::kHit) | edges(w.miss, Saying::kMiss) |
                           edges(w.near_hit, Saying::kNearOccupied) | edges(w.brush, Saying::kNearFree);
    for (; starts != 0; starts &= starts - 1) {
      const int bit = std::countr_zero(starts);
      const auto in = [&](std::uint64_t plane) { return static_cast<unsigned>(plane >> bit & 1u); };
      before = static_cast<Saying>(in(w.hit) * 4 + in(w.miss) * 3 + in(w.near_hit) * 2 + in(w.brush));
      out.push_back({base + bit, before});
    }
  }
  if (before != Saying::kNothing) out.push_back({base + 64, Saying::kNothing});
}

}  // namespace hm::mvog
