// How do I turn one depth image with a pose into a coloured mesh?
#include <cstdio>

#include "hm/io/mesh/mesh_file.hpp"
#include "hm/mesh/whole_mesh.hpp"
#include "hm/tsdf/integration/integrator.hpp"

int main() {
  // A camera 2 m in front of a wall; your frames come from your sensor.
  const hm::PinholeCamera camera{320, 240, 300, 300, 159.5, 119.5, {}};
  hm::RgbdFrame frame;
  frame.depth.unit_m = 0.001;
  frame.depth.units = hm::Image<std::uint16_t>(320, 240, 2000);
  frame.color = hm::Image<hm::Rgb8>(320, 240, hm::Rgb8{200, 80, 40});
  frame.T_world_camera = hm::SE3();  // p_world = T_world_camera * p_camera

  const hm::ParallelLoop loop(hm::available_threads());
  const hm::TsdfParams params;  // 2 cm voxels; see docs/parameters.md
  hm::VolumeGrid grid = hm::Integrator::make_grid(params);
  hm::Integrator integrator(params, hm::DepthNoise(), camera, loop);
  const hm::ScanStats stats = integrator.integrate(grid, frame);
  if (!stats.nothing_integrated_because.empty()) {
    std::printf("nothing integrated: %s\n", stats.nothing_integrated_because.c_str());
    return 1;
  }
  const hm::TriangleMesh mesh = hm::extract_mesh(grid, hm::MeshParams(), loop);
  if (const auto written = hm::write_mesh("wall.ply", mesh); !written) {
    std::printf("%s\n", hm::to_string(written.error()).c_str());
    return 1;
  }
  // The camera sees 2.13 x 1.6 m of the wall.
  std::printf("wall.ply: %zu triangles, %.2f m2\n", mesh.triangles.size(), hm::surface_area(mesh));
  return hm::surface_area(mesh) > 3.0 && hm::surface_area(mesh) < 3.8 ? 0 : 1;
}
