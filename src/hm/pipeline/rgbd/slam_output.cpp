#include "hm/pipeline/rgbd/slam_output.hpp"

#include <algorithm>
#include <span>

#include "hm/core/text/counted.hpp"
#include "hm/io/bytes/file_bytes.hpp"
#include "hm/io/bytes/json.hpp"
#include "hm/io/map/octomap_file.hpp"
#include "hm/io/mesh/mesh_file.hpp"
#include "hm/io/pose/g2o_file.hpp"
#include "hm/io/pose/trajectory_file.hpp"
#include "hm/mapping/dense_pipeline.hpp"
#include "hm/mapping/keyframes/keyframe_maps.hpp"
#include "hm/mapping/map_copy.hpp"
#include "hm/mapping/map_store.hpp"
#include "hm/pipeline/common/map_export.hpp"
#include "hm/pipeline/common/mesh_evaluation.hpp"
#include "hm/pipeline/common/mesh_output.hpp"
#include "hm/pipeline/dense/dense_parameter_list.hpp"
#include "hm/pipeline/rgbd/slam_report.hpp"
#include "hm/pipeline/rgbd/slam_save.hpp"
#include "hm/report/map_figures.hpp"
#include "hm/slam/place_recognition/place_experiment.hpp"

namespace hm {
namespace {

/// One writing of write_slam_results().
class Output {
 public:
  Output(SlamPipeline& pipeline, const SlamRunOptions& options, SlamSummary& summary)
      : pipeline_(pipeline), options_(options), summary_(summary) {}

  Result<void> write(const OdometryMesh& before);

 private:
  void say(const char* stage) const {
    if (options_.run.progress) options_.run.progress({stage, 0, 0, {}});
  }
  /// Writes a file unless something failed before, and names it.
  template <class Write>
  void file(const char* name, Write&& write) {
    if (!result_) return;
    result_ = write(options_.output / name);
    if (result_) summary_.outputs.push_back(options_.output / name);
  }
  /// Heights are measured along this: z while up is unknown.
  [[nodiscard]] Vec3 height_axis() const {
    return summary_.state.up.known() ? summary_.state.up.up : Vec3::UnitZ();
  }
  void write_trajectories();
  void write_map_file();
  void write_keyframe_maps();
  void write_occupancy(const KeyframeMaps& maps);
  void compare_meshes(const TriangleMesh& before, const TriangleMesh& mesh);
  void draw_matrices();
  void draw_accepted_loops();
  void draw_meshes(const OdometryMesh& before, const TriangleMesh& mesh);
  void write_report();

  SlamPipeline& pipeline_;
  const SlamRunOptions& options_;
  SlamSummary& summary_;
  SlamReportMaterial material_;
  Result<void> result_;
};

void Output::write_trajectories() {
  const SlamPipeline::State& state = summary_.state;
  Trajectory keyframes;
  const std::size_t first = state.continued ? state.continued->earlier_keyframes : 0;
  for (const CorrectedKeyframe& keyframe : std::span(state.keyframes->keyframes()).subspan(first))
    if (keyframe.map == 0) keyframes.push_back({keyframe.stamp, keyframe.T_map_camera});
  file("trajectory.tum", [&](const auto& path) { return write_tum_trajectory(path, state.corrected); });
  file("odometry.tum", [&](const auto& path) { return write_tum_trajectory(path, state.track.trajectory); });
  file("keyframes.tum", [&](const auto& path) { return write_tum_trajectory(path, keyframes); });
  if (!state.graph.T_map_node.empty())
    file("graph.g2o", [&](const auto& path) { return write_g2o_3d(state.graph, path); });
}

void Output::write_map_file() {
  file("map.hmap", [&](const auto& path) -> Result<void> {
    SlamSaveState state =
        initial_save_state(summary_.recording, options_.run.program_version, options_.recording_options);
    state.next_frame = summary_.state.frames_done;
    state.up = summary_.state.up;
    const MapHeader header = slam_map_header(options_.parameters, pipeline_.dense().grid(), state);
    auto map = MapFile::create(path, header);
    if (!map) return forward_error(map);
    MapSaver saver(std::move(*map));
    saver.note(all_volumes(pipeline_.dense().grid()));
    return saver.save(pipeline_.dense().grid(), header);
  });
}

void Output::write_occupancy(const KeyframeMaps& maps) {
  const auto voxels = maps.occupancy->voxels();
  const std::vector<Rgb8> colors = voxel_colors(maps, voxels);
  const double resolution_m = options_.parameters.slam.octomap_resolution_m;
  if (!result_) return;
  const auto path = options_.output / "occupancy.ot";
  const auto written = written_unless_too_large(path, write_color_octomap(path, voxels, colors, resolution_m),
                                                summary_.warnings);
  if (!written) result_ = forward_error(written);
  if (written && *written) summary_.outputs.push_back(path);
  if (auto figure = draw_heights(voxels, resolution_m, height_axis()))
    material_.maps.push_back({"occupancy",
                              "The highest occupied cell of the occupancy map, from above, by height.",
                              std::move(*figure)});
}

void Output::write_keyframe_maps() {
  RunContext finishing = options_.run;  // the maps of a run that was stopped early are whole nevertheless
  finishing.stop = {};
  KeyframeMapParams wanted = keyframe_map_params(options_.parameters);
  wanted.up = height_axis();
  const KeyframeMaps maps =
      make_keyframe_maps(pipeline_.frames(), *summary_.state.keyframes, wanted, finishing);
  if (maps.unreadable > 0)
    summary_.warnings.push_back(
        fmt::format("{} could not be read again for the maps", counted(maps.unreadable, "keyframe")));
  std::size_t refused = 0;
  for (const auto* grid : {maps.occupancy.get(), maps.volumes.get()})
    if (grid != nullptr) refused += grid->columns_refused();
  judge_memory_limit({"mvog.max_map_mb", options_.parameters.mvog.max_map_mb, refused, "column update"},
                     summary_.warnings, summary_.verdict);
  if (maps.keyframes == 0) {
    if (maps.points || maps.occupancy || maps.volumes)
      summary_.warnings.emplace_back("no maps of keyframes: not one keyframe could be read for them");
    return;
  }
  MeshWriteOptions write;
  write.frame = "map", write.program = "housemartin " + options_.run.program_version;
  write.up = summary_.state.up;
  if (maps.points)
    file("points.ply", [&](const auto& path) { return write_mesh(path, maps.points->points(), write); });
  if (maps.occupancy) write_occupancy(maps);
  if (maps.volumes)
    file("volumes.mvog", [&](const auto& path) {
      const auto bytes = maps.volumes->serialise();
      return write_file_bytes(path, {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
    });
}

TriangleMesh moved(TriangleMesh mesh, const SimilarityTransform& move) {
  for (auto& vertex : mesh.vertices) vertex = (move * vertex.cast<double>()).cast<float>();
  for (auto& normal : mesh.normals) normal = (move.rotation * normal.cast<double>()).cast<float>();
  return mesh;
}

/// Each mesh is moved as its trajectory is, so that both are evaluated alike.
void Output::compare_meshes(const TriangleMesh& before, const TriangleMesh& mesh) {
  if (!has_mesh_truth(options_.recording) || mesh.triangles.empty() || !summary_.error) return;
  say("comparing with the truth");
  const auto truth = read_mesh_truth(options_.recording);
  if (!truth) {
    summary_.warnings.push_back("the truth cannot be used: " + to_string(truth.error()));
    return;
  }
  const auto compare = [&](const TriangleMesh& one, const TrajectoryError& path) -> std::optional<MeshError> {
    auto error = evaluate_mesh(moved(one, path.alignment), truth->mesh, options_.parameters.mesh_error,
                               pipeline_.dense().loop(), truth->visible_points);
    if (error) return std::move(*error);
    summary_.warnings.push_back("the mesh cannot be compared with the truth: " + to_string(error.error()));
    return std::nullopt;
  };
  summary_.mesh_error = compare(mesh, *summary_.error);
  if (!before.triangles.empty() && summary_.odometry_error)
    summary_.odometry_mesh_error = compare(before, *summary_.odometry_error);
}

void Output::draw_matrices() {
  const auto& keyframes = summary_.state.track.keyframes;
  constexpr std::size_t kMost = 1500;
  if (!options_.parameters.slam.matrices || !options_.parameters.loops.enabled || keyframes.size() < 2)
    return;
  if (keyframes.size() > kMost) {
    summary_.warnings.push_back(fmt::format("no matrices of place recognition: {} are more than {}",
                                            counted(keyframes.size(), "keyframe"), with_thousands(kMost)));
    return;
  }
  say("drawing matrices");
  const PlaceMatrices matrices =
      heuristic_places(keyframes, options_.parameters.loops.search, options_.parameters.loops.verifier);
  const int pixels = std::clamp(static_cast<int>(800 / keyframes.size()), 1, 8);
  PlacePictures figures = draw_places(matrices, pixels);
  material_.matrices = {
      {"match_matrix", "Votes of each keyframe's features (row) for other keyframes (column).",
       std::move(figures.match), HtmlReport::Place::kHalf},
      {"candidate_matrix", "Pairs that were compared.", std::move(figures.candidate),
       HtmlReport::Place::kHalf},
      {"correspondence_matrix", "Features on which compared pairs agree.", std::move(figures.correspondence),
       HtmlReport::Place::kHalf},
      {"association_matrix", "Pairs that show the same place.", std::move(figures.association),
       HtmlReport::Place::kHalf}};
}

void Output::draw_accepted_loops() {
  if (!options_.parameters.reconstruction.pictures) return;
  say("drawing loops");
  material_.loops = draw_loops(pipeline_.frames(), summary_.state.graph, summary_.state.graph_keyframes,
                               options_.parameters.loops.verifier);
}

void Output::draw_meshes(const OdometryMesh& before, const TriangleMesh& mesh) {
  if (!options_.parameters.reconstruction.pictures) return;
  say("drawing figures");
  const MeshFigureOptions draw =
      figure_options(summary_.recording.camera, summary_.state.corrected, summary_.state.up);
  material_.figures = make_mesh_figures(mesh, draw, pipeline_.dense().loop());
  material_.scene = make_scene_model(mesh, draw, nullptr, pipeline_.dense().loop());
  if (result_) result_ = write_floor_plan(material_.scene, options_.output, summary_.outputs);
  if (before.mesh.triangles.empty()) return;
  MeshFigureOptions draw_before =
      figure_options(summary_.recording.camera, summary_.state.track.trajectory, summary_.state.up);
  draw_before.is_for_comparison = true;
  std::vector<Figure> pairs;  // before and after stand side by side
  for (Figure& figure : make_mesh_figures(before.mesh, draw_before, pipeline_.dense().loop())) {
    const auto after = std::find_if(material_.figures.begin(), material_.figures.end(),
                                    [&](const Figure& other) { return other.name == figure.name; });
    figure.name = "before_" + figure.name;
    figure.caption = fmt::format("Before loops were closed{}: {}",
                                 before.of_keyframes_alone ? ", from keyframes alone" : "", figure.caption);
    figure.place = HtmlReport::Place::kHalf;
    pairs.push_back(std::move(figure));
    if (after == material_.figures.end()) continue;
    after->caption = "After: " + after->caption;
    after->place = HtmlReport::Place::kHalf;
    pairs.push_back(std::move(*after));
    material_.figures.erase(after);
  }
  material_.figures.insert(material_.figures.begin(), std::make_move_iterator(pairs.begin()),
                           std::make_move_iterator(pairs.end()));
}

void Output::write_report() {
  RgbdParameters parameters = options_.parameters;
  material_.program_version = options_.run.program_version;
  material_.parameters_toml = list_slam(parameters).to_toml();
  std::vector<Figure> all = material_.figures;
  all.insert(all.end(), material_.matrices.begin(), material_.matrices.end());
  all.insert(all.end(), material_.maps.begin(), material_.maps.end());
  if (result_) result_ = write_figures(options_.output, all, summary_.outputs, pipeline_.dense().loop());
  file("parameters.toml", [&](const auto& path) { return write_file_text(path, material_.parameters_toml); });
  if (!result_) return;
  for (const char* name : {"report.json", "report.html"}) summary_.outputs.push_back(options_.output / name);
  const std::string json = to_json_text(slam_report_json(summary_, options_.run.program_version));
  result_ = write_file_text(options_.output / "report.json", json + "\n");
  if (result_)
    result_ = write_file_text(options_.output / "report.html", slam_report_html(summary_, material_));
}

Result<void> Output::write(const OdometryMesh& before) {
  write_trajectories();
  say("writing the map");
  summary_.volumes = pipeline_.dense().grid().volume_count();
  summary_.map_bytes = pipeline_.dense().grid().map_bytes();
  write_map_file();
  write_keyframe_maps();
  say("finishing the mesh");
  const TriangleMesh mesh = pipeline_.dense().take_finished_mesh();
  summary_.vertices = mesh.vertices.size();
  summary_.triangles = mesh.triangles.size();
  summary_.bounds_m = bounds(mesh);
  if (mesh.triangles.empty())
    summary_.warnings.emplace_back("the mesh is empty: no surface was seen clearly enough");
  if (result_)
    result_ = write_mesh_files(mesh, {options_.output, options_.run.program_version, summary_.state.up},
                               options_.parameters.reconstruction, summary_.outputs);
  compare_meshes(before.mesh, mesh);
  draw_matrices();
  draw_accepted_loops();
  draw_meshes(before, mesh);
  write_report();
  return result_;
}

}  // namespace

Result<void> write_slam_results(SlamPipeline& pipeline, const OdometryMesh& before,
                                const SlamRunOptions& options, SlamSummary& summary) {
  return Output(pipeline, options, summary).write(before);
}

}  // namespace hm
