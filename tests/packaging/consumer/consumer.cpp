#include <cstdio>

#include "hm/report/plot.hpp"
#include "hm/io/bytes/json.hpp"
#include "hm/io/laser/laser_recording.hpp"
#include "hm/mapping/dense_pipeline.hpp"
#include "hm/pipeline/simulate/simulation_recording.hpp"

// One simulated frame through the whole library: sim, tsdf, mesh, io, evaluation, pipeline.
int main() {
  hm::SimulationParams room;
  room.world = hm::WorldKind::kRoom;
  const hm::Simulation simulation(room);
  hm::DensePipeline pipeline(hm::DenseParams(), simulation.camera(), 1);
  const auto outcome = pipeline.process(simulation.frame(0));
  const auto mesh = pipeline.finished_mesh();
  std::printf("%zu triangles\n", mesh.triangles.size());
  const bool has_svg = hm::histogram_svg({}, 10, {}).find("<svg") != std::string::npos;
  const bool has_json = hm::parse_json("{\"a\": 1}", "text").has_value();
  const bool has_bags = !hm::open_laser_recording("nothing.bag").has_value();
  return outcome.integrated && !mesh.triangles.empty() && has_svg && has_json && has_bags ? 0 : 1;
}
