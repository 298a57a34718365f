#pragma once
#include <memory>
#include <optional>

#include "dense/contender.hpp"
#include "hm/geometry/triangle_mesh.hpp"

namespace hm::bench {

enum class PeerGrid {
  kScalable,    ///< ScalableTSDFVolume
  kVoxelBlock,  ///< VoxelBlockGrid, blocks of 8, float distances and 16-bit weights and colours
};

struct PeerOptions {
  PeerGrid grid = PeerGrid::kScalable;
  double voxel_size_m = 0.02;
  double band_m = 0.08;
  double far_m = 4.0;
  bool color = true;
};

/// Open3D, integrating the same frames. Its images and tensors are made in prepare(), which is not timed.
class Peer : public Contender {
 public:
  /// Bytes of the voxels that it holds (in use, not reserved), index not counted.
  [[nodiscard]] virtual std::size_t map_bytes() const = 0;
  [[nodiscard]] virtual std::size_t block_count() const = 0;
  /// The whole mesh by its own extraction; `milliseconds` of the extraction alone.
  virtual TriangleMesh extract(double& milliseconds) = 0;
};

/// nullptr when Open3D was not there when the benchmarks were built.
std::unique_ptr<Peer> make_peer(const PeerOptions& options, const PinholeCamera& camera);
bool has_peer();
/// From here on the peer computes on this many threads (with OMP_NUM_THREADS set likewise).
void limit_peer_threads(int threads);

}  // namespace hm::bench
