#pragma once
#include "hm/tsdf/integration/integrator.hpp"
#include "hm/tsdf/testing/analytic_scene.hpp"

namespace hm {

inline const PinholeCamera kCamera{320, 240, 262.5, 262.5, 159.5, 119.5, {}};

/// Fixture for tests of one integrator.
struct IntegrationBench {
  explicit IntegrationBench(const TsdfParams& p, int threads = 1)
      : params(p), loop(threads), grid(Integrator::make_grid(p)), integrator(p, {}, kCamera, loop) {}
  ScanStats add(const AnalyticScene& scene, const SE3& pose) {
    return integrator.integrate(grid, scene.render(kCamera, pose));
  }
  TsdfParams params;
  ParallelLoop loop;
  VolumeGrid grid;
  Integrator integrator;
};

inline const AnalyticScene kWall{{{Vec3(-1, 0, 0), -2.0}}, {}};
inline const AnalyticScene kWallAndBox{{{Vec3(-1, 0, 0), -2.0}}, {{Vec3(1.2, 0, 0), 0.25}}};

}  // namespace hm
