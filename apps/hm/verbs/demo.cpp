#include "hm/pipeline/compare/demo.hpp"

#include <memory>

#include "flags/serve_flags.hpp"
#include "hm/core/text/counted.hpp"
#include "program.hpp"

namespace {

std::string closing_words(const hm::DemoSummary& demo, const std::filesystem::path& output) {
  const hm::ReconstructionSummary& result = demo.reconstruction;
  std::string text = fmt::format(
      "\nA simulated walk of {:.0f} m through a house ({}) was reconstructed at {:.0f} frames per second:\n"
      "a coloured mesh of {}, with voxels of {:g} mm, from a map of {:.0f} MB.\n",
      demo.simulation.path_length_m, hm::counted(result.frames_integrated, "depth image"),
      result.frames_per_s, hm::counted(result.triangles, "triangle"),
      result.parameters.tsdf.voxel_size_m * 1e3, static_cast<double>(result.map_bytes) * 1e-6);
  if (result.error)
    text += fmt::format(
        "Compared with the true surface, its mean error is {:.1f} mm (95 % under {:.1f} mm), and it covers\n"
        "{:.1f} % of the surface that the camera could see, within {:g} mm.\n",
        result.error->accuracy.distance_m.mean * 1e3, result.error->accuracy.distance_m.p95 * 1e3,
        result.error->completeness.ratio * 100, result.parameters.mesh_error.threshold_m * 1e3);
  text += fmt::format("\n  mesh  {}\n  map   {}\n\n", (output / "result/mesh.ply").string(),
                      (output / "result/map.hmap").string());
  return text;
}

hm::Result<Outcome> run(const std::string& output, const ServeFlags& serve, Session& session) {
  hm::DemoOptions options;
  options.output = output;
  // The tablet's depth camera at 5 Hz and 3 cm voxels, as the dissertation scanned whole floors (4.6).
  options.parameters.tsdf.voxel_size_m = 0.03;
  hm::ParamList list = hm::list_dense(options.parameters);
  list.add("simulation", options.simulation);
  if (const auto applied = session.apply(list); !applied) return hm::forward_error(applied);
  options.run = session.interruptible_context(
      "an unfinished simulation is removed; a reconstruction writes the results so far");
  auto serving =
      serve.open({.verb = "demo", .name = output, .report_to_come = options.output / "result/report.html"},
                 list, options.run);
  if (!serving) return hm::forward_error(serving);
  const auto demo = hm::run_demo(options);
  serving->finish(demo);
  if (!demo) return hm::forward_error(demo);
  Outcome outcome{closing_words(*demo, output), hm::to_json(demo->reconstruction),
                  demo->reconstruction.warnings, demo->reconstruction.outputs};
  outcome.outputs.insert(outcome.outputs.begin(), demo->simulation.outputs.begin(),
                         demo->simulation.outputs.end());
  return outcome;
}

void add_demo(Program& program) {
  auto output = std::make_shared<std::string>("hm_demo");
  auto serve = std::make_shared<ServeFlags>();
  Command command = program.add(
      {"demo", "Scan a simulated house live and write mesh, map, figures and a report with the accuracy.",
       "  hm demo\n"
       "  hm demo -o demo --set simulation.frame_limit=100",
       [output, serve](Session& session) { return run(*output, *serve, session); }});
  command.add_option("-o,--output", *output, "folder for recording and results (default: hm_demo)");
  serve->add_to(command);
  program.add_parameters([] { return hm::make_parameter_part(hm::list_dense); });
}

const VerbRegistration kDemo(10, add_demo);

}  // namespace
