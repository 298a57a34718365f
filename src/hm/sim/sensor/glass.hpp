#pragma once
#include <span>

#include "hm/sim/sensor/renderer.hpp"

namespace hm {

/// Shows what real panes do to a camera with active depth: the pixels of clear materials in `view`, which was
/// rendered with these poses (one for every row), get the colour of what stands behind the pane and of what
/// it reflects (Schlick's approximation of Fresnel's law, 8 % at normal incidence), and the depth of what
/// stands behind where the pane is seen within `through_rad` of its normal. A pane with nothing behind it
/// keeps its colour and gives no depth.
void look_through_glass(const World& world, const Renderer& renderer, const PinholeCamera& camera,
                        std::span<const SE3> T_world_camera, double through_rad, RenderedView& view);

}  // namespace hm
