#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "hm/core/parallel.hpp"
#include "hm/tsdf/grid/volume_grid.hpp"

namespace hm {

/// Observation as a ray: unit direction from the scan's origin, distance of the endpoint, truncation there,
/// weight in 1/kWeightOne. Metres.
struct ObservedRay {
  Vec3 direction = Vec3::UnitZ();
  double length_m = 0;
  float tau_m = 0;
  float weight = 0;
};

/// Bipartite graph of volumes and observations (dissertation 4.3.3, Fig. 4.13), with an edge where a ray's
/// band crosses a volume, or where a carving ray crosses one that may hold something to carve. Each volume's
/// observations are in order, so that any one thread can process it without a lock and with bit-identical
/// results.
class ObservationGraph {
 public:
  struct Span {
    Vec3 p_world_origin = Vec3::Zero();
    bool carving = false;
  };
  void build(const VolumeGrid& grid, std::span<const ObservedRay> rays, const Span& span,
             const ParallelLoop& loop);

  /// Volumes, sorted by z, y, x.
  [[nodiscard]] const std::vector<VolumeKey>& volumes() const { return volumes_; }
  /// True when a ray's band, not only a carving ray, crosses the volume.
  [[nodiscard]] bool is_hit(std::size_t volume) const { return hit_[volume] != 0; }
  [[nodiscard]] std::span<const std::uint32_t> observations(std::size_t volume) const {
    return std::span(observations_).subspan(begin_[volume], begin_[volume + 1] - begin_[volume]);
  }

 private:
  struct Part;  ///< the edges of a range of rays
  void merge(std::vector<Part>& parts);

  std::vector<VolumeKey> volumes_;
  std::vector<std::uint8_t> hit_;
  std::vector<std::uint32_t> begin_;
  std::vector<std::uint32_t> observations_;
};

}  // namespace hm
