#include "hm/pipeline/inspect/file_check.hpp"

#include <algorithm>

#include "hm/io/bytes/file_name.hpp"
#include "hm/io/bytes/foreign_format.hpp"
#include "hm/io/bytes/json.hpp"
#include "hm/io/laser/laser_recording.hpp"
#include "hm/io/mesh/mesh_file.hpp"
#include "hm/io/pose/g2o_file.hpp"
#include "hm/pipeline/common/box_json.hpp"
#include "hm/pipeline/dense/reconstruction_state.hpp"
#include "hm/tsdf/grid/volume.hpp"

namespace hm {
namespace {

std::uint64_t file_size_of(const std::filesystem::path& path) {
  std::error_code code;
  const auto size = std::filesystem::file_size(path, code);
  return code ? 0 : size;
}

void count_block(const MapBlockView& block, MapReport& report) {
  ++report.volumes;
  if (!block.colors.empty()) ++report.volumes_with_color;
  for (const std::uint32_t bits : block.voxels) {
    const TsdfVoxel voxel{bits};
    report.voxels_known += voxel.weight() > 0;
    report.voxels_inside += voxel.weight() > 0 && voxel.sdf() <= 0;
  }
  const double size_m = report.header.voxel_size_m * kVolumeSide;
  const Vec3 corner = Vec3(block.key[0], block.key[1], block.key[2]) * size_m;
  report.bounds_m.extend(corner);
  report.bounds_m.extend(corner + Vec3::Constant(size_m));
}

template <class Graph>
PoseGraphReport report_of(const G2oGraph<Graph>& file, int dimensions) {
  PoseGraphReport report;
  const auto& nodes = file.graph.T_map_node;
  report.dimensions = dimensions;
  report.nodes = nodes.size();
  report.other_lines = file.other_lines;
  std::vector<Vec3> positions_m(nodes.size(), Vec3::Zero());
  for (std::size_t i = 0; i < nodes.size(); ++i) positions_m[i].head(dimensions) = nodes[i].translation();
  report.path_length_m = path_length(positions_m);
  for (const auto& edge : file.graph.edges) {
    const bool is_loop = edge.kind == PoseEdgeKind::kLoop;
    ++(is_loop ? report.loop_edges : report.odometry_edges);
    if (is_loop)
      report.largest_loop_chi2 = std::max(report.largest_loop_chi2, pose_edge_chi2(edge, file.graph));
  }
  report.chi2 = pose_graph_chi2(file.graph);
  for (const SkippedLines& skipped : file.skipped) report.problems.push_back(to_string(skipped));
  return report;
}

/// Problems, a line each.
std::string problem_lines(const std::vector<std::string>& problems) {
  std::string text;
  for (const std::string& problem : problems) text += "problem      " + problem + "\n";
  return text;
}

}  // namespace

Result<PathKind> kind_of(const std::filesystem::path& path) {
  std::error_code code;
  if (!std::filesystem::exists(path, code))
    return fail(ErrorCode::kNotFound, path.string(), "there is no such file or folder");
  if (std::filesystem::exists(path / "run.json", code)) return PathKind::kResult;
  if (std::filesystem::is_directory(path, code))
    return is_laser_recording(path) ? PathKind::kLaserRecording : PathKind::kRecording;
  const std::string extension = lower_extension(path);
  if (extension == ".hmap") return PathKind::kMap;
  if (extension == ".mvog") return PathKind::kOccupancy;
  if (extension == ".g2o") return PathKind::kPoseGraph;
  if (is_mesh_name(path)) return PathKind::kMesh;
  if (is_laser_recording(path)) return PathKind::kLaserRecording;
  if (extension == ".tum" || extension == ".txt" || extension == ".kitti" || extension == ".csv")
    return PathKind::kTrajectory;
  if (const auto foreign = describe_foreign_format(path))
    return fail(ErrorCode::kUnsupported, path.string(), "{}", *foreign);
  return fail(
      ErrorCode::kUnsupported, path.string(),
      "not a recording (a folder), a laser recording (.bag .log .alog .dat), a map (.hmap .mvog), a mesh "
      "({}), a trajectory (.tum .txt .csv .kitti) or a pose graph (.g2o)",
      kMeshNames);
}

UpDirection up_of_map(const MapHeader& header) {
  const auto state = parse_json(header.state_json.empty() ? "{}" : header.state_json, "state");
  const auto* text = state ? state->find_as<std::string>("up") : nullptr;
  return text ? parse_up(*text).value_or(UpDirection()) : UpDirection();
}

Result<MapReport> inspect_map(const std::filesystem::path& path) {
  const auto map = MapFile::open(path, MapOpenMode::kReadLenient);
  if (!map) return forward_error(map);
  MapReport report;
  report.header = map->header();
  report.file_bytes = map->file_bytes();
  const auto read = map->for_each_block({}, [&](const MapBlockView& block) {
    count_block(block, report);
    return true;
  });
  if (!read) return forward_error(read);
  report.volumes_damaged = read->blocks_skipped;
  report.up = up_of_map(report.header);
  report.problems = map->problems();
  report.problems.insert(report.problems.end(), read->problems.begin(), read->problems.end());
  if (const auto state = state_from_json(report.header.state_json, path.string())) {
    report.next_frame = state->next_frame;
    report.frames_integrated = state->frames_integrated;
  }
  return report;
}

void visit(const MapReport& report, SummaryTree& v) {
  v({"format_version"}, report.header.format_version);
  v({"program_version"}, report.header.program_version);
  v({"voxel_size_m", {}, "{:g} mm", 1e3}, report.header.voxel_size_m);
  v({"sdf_unit_m", {}, "{:.2g} mm", 1e3}, report.header.sdf_unit_m);
  v({"volumes"}, report.volumes);
  v({"volumes_with_color"}, report.volumes_with_color);
  v({"volumes_damaged"}, report.volumes_damaged);
  v({"voxels_known"}, report.voxels_known);
  v({"voxels_inside"}, report.voxels_inside);
  add_box(v, "bounds_m", report.bounds_m);
  v({"up"}, to_string(report.up));
  v({"file_bytes", {}, "{:.1f} MB", 1e-6}, report.file_bytes);
  v({"frames_integrated"}, report.frames_integrated);
  v({"next_frame", {}, "{:d}"}, report.next_frame);
  v.json("problems", JsonValue::array_of(report.problems));
  v({"parameters_toml"}, report.header.parameters_toml);
}

std::string to_text(const MapReport& report) {
  return describe(report).lines(
             {"map, format {format_version} (saved by housemartin {program_version})",
              "voxels       {voxel_size_m}, in {volumes|block} of 8 x 8 x 8, {volumes_with_color} of them "
              "with colour",
              "precision    distances to the surface are stored in steps of {sdf_unit_m}",
              "known        {voxels_known|voxel}, {voxels_inside} of them on or behind a surface",
              "size         [{bounds_m}, ]{file_bytes} on disk", "up           {up}",
              "made from    {frames_integrated|frame}; --resume would continue at frame {next_frame}"}) +
         problem_lines(report.problems);
}

Result<MeshReport> inspect_mesh(const std::filesystem::path& path) {
  const auto mesh = read_mesh(path);
  if (!mesh) return forward_error(mesh);
  const auto up = read_mesh_up(path);
  return MeshReport{mesh->vertices.size(),  mesh->triangles.size(), open_edges(*mesh).size(),
                    mesh->has_normals(),    mesh->has_colors(),     surface_area(*mesh),
                    enclosed_volume(*mesh), bounds(*mesh),          file_size_of(path),
                    up ? *up : std::nullopt};
}

void visit(const MeshReport& report, SummaryTree& v) {
  v({"vertices"}, report.vertices);
  v({"triangles"}, report.triangles);
  v({"open_edges"}, report.open_edges);
  v({"has_normals"}, report.has_normals);
  v({"has_colors"}, report.has_colors);
  v({"area_m2", {}, "{:.2f} m2"}, report.area_m2);
  v({"enclosed_volume_m3"}, report.enclosed_volume_m3);
  add_box(v, "bounds_m", report.bounds_m);
  v({"file_bytes"}, report.file_bytes);
  v({"up"}, report.up ? to_string(*report.up) : std::string("the file does not say"));
  v.shown("normals", {}, report.has_normals ? "with" : "without");
  v.shown("colors", {}, report.has_colors ? "with" : "without");
}

std::string to_text(const MeshReport& report) {
  return describe(report).lines(
      {"mesh of {vertices|vertex|vertices} and {triangles|triangle}, {normals} normals, {colors} colours",
       "size         [{bounds_m}, ]{area_m2} of surface", "open edges   {open_edges}", "up           {up}"});
}

Result<PoseGraphReport> inspect_pose_graph(const std::filesystem::path& path) {
  const auto in_space = read_g2o_3d(path);
  if (in_space) return report_of(*in_space, 3);
  if (in_space.error().code != ErrorCode::kNotFound) return forward_error(in_space);
  const auto in_plane = read_g2o_2d(path);
  if (in_plane) return report_of(*in_plane, 2);
  if (in_plane.error().code != ErrorCode::kNotFound) return forward_error(in_plane);
  return fail(ErrorCode::kCorrupted, path.string(), "no vertex and no edge of a pose graph in this file");
}

void visit(const PoseGraphReport& report, SummaryTree& v) {
  v({"dimensions"}, report.dimensions);
  v.shown("space", {}, report.dimensions == 2 ? "the plane" : "space");
  v({"nodes"}, report.nodes);
  v({"odometry_edges"}, report.odometry_edges);
  v({"loop_edges"}, report.loop_edges);
  v({"other_lines"}, report.other_lines);
  if (report.other_lines > 0) v.shown("left_out", {}, report.other_lines);
  v({"path_length_m", {}, "{:.2f} m"}, report.path_length_m);
  v({"chi2", {}, "{:.4g}"}, report.chi2);
  v({"largest_loop_chi2", {}, "{:.4g}"}, report.largest_loop_chi2);
  v.json("problems", JsonValue::array_of(report.problems));
}

std::string to_text(const PoseGraphReport& report) {
  return describe(report).lines(
             {"pose graph in {space} of {nodes|node}, {path_length_m} from node to node",
              "edges        {odometry_edges} of odometry, {loop_edges|loop}[; {left_out|line} "
              "of other kinds not read]",
              "chi2         {chi2}; largest of a loop {largest_loop_chi2}"}) +
         problem_lines(report.problems);
}

}  // namespace hm
