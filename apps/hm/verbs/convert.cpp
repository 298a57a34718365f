#include <memory>

#include "flags/recording_flags.hpp"
#include "hm/io/bytes/file_name.hpp"
#include "hm/pipeline/compare/conversion.hpp"
#include "program.hpp"

namespace {

struct ConvertFlags {
  std::string from, to;
  RecordingFlags of_recording;
};

hm::Result<Outcome> run(const ConvertFlags& flags, Session& session) {
  hm::ConversionOptions options;
  hm::ParamList list;
  list.add("mesh", options.mesh);
  list.add("laser", options.slice);
  // A mesh of another program keeps all its pieces unless told otherwise; that of a map is as reconstruct
  // writes it.
  if (hm::is_mesh_name(flags.from)) options.mesh.min_piece_size_m = 0;
  if (const auto applied = session.apply(list); !applied) return hm::forward_error(applied);
  const auto recording_options = flags.of_recording.options();
  if (!recording_options) return hm::forward_error(recording_options);
  options.from = flags.from;
  options.to = flags.to;
  options.recording_options = *recording_options;
  options.run = session.context();
  const auto summary = hm::convert(options);
  if (!summary) return hm::forward_error(summary);
  Outcome outcome;
  outcome.text = fmt::format("{}: {}\n", flags.to, summary->text);
  outcome.json = hm::JsonValue::object({{"items", summary->items}, {"skipped", summary->skipped}});
  outcome.outputs = summary->outputs;
  if (outcome.outputs.empty()) outcome.outputs.emplace_back(flags.to);
  outcome.warnings = summary->warnings;
  return outcome;
}

void add_convert(Program& program) {
  auto flags = std::make_shared<ConvertFlags>();
  Command command = program.add({"convert", "Convert between file formats, by file extension.",
                                 "  hm convert result/mesh.ply mesh.obj\n"
                                 "  hm convert result/map.hmap small.glb --set mesh.simplify_keep_ratio=0.1\n"
                                 "  hm convert result/trajectory.tum poses.kitti\n"
                                 "  hm convert flown/map.mvog flown.ot\n"
                                 "  hm convert flown/map.mvog floor.pgm --set laser.slice_top_m=1.2\n"
                                 "  hm convert recording as_tum",
                                 [flags](Session& session) { return run(*flags, session); }});
  command
      .add_option("from", flags->from,
                  "mesh (.ply .obj .glb .gltf .stl .off .dae .fbx), map (.hmap), occupancy grid (.mvog), "
                  "trajectory, or recording (folder)")
      .required();
  command
      .add_option(
          "to", flags->to,
          "file or folder to write; letter case of an extension does not matter. Mesh or map: .ply .obj "
          ".glb; occupancy grid: .ot .bt (OctoMap), .ply (points), .yaml, .yml or .pgm (a slice for "
          "map_server: always both files); trajectory: .tum .txt .kitti; recording: a folder")
      .required();
  flags->of_recording.add_to(command);
}

const VerbRegistration kConvert(100, add_convert);

}  // namespace
