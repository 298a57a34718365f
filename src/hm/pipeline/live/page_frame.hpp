#pragma once
#include <cstddef>
#include <cstdint>
#include <utility>

#include "hm/mesh/pages/mesh_page.hpp"
#include "hm/station/live_frames.hpp"

namespace hm {

/// The frame that shows a level of an encoded page.
inline MeshPageFrame page_frame(VolumeKey key, std::uint32_t version, std::size_t level, EncodedPage page) {
  MeshPageFrame frame;
  frame.key = {key.x, key.y, key.z};
  frame.version = version;
  frame.level = static_cast<std::uint8_t>(level);
  frame.has_colors = page.has_colors;
  frame.vertices = page.vertices;
  frame.indices = page.indices;
  frame.origin_m = page.origin_m;
  frame.quantum_m = page.quantum_m;
  frame.vertex_bytes = std::move(page.vertex_bytes);
  frame.index_bytes = std::move(page.index_bytes);
  return frame;
}

}  // namespace hm
