#include "hm/pipeline/compare/conversion.hpp"

#include "hm/core/parallel.hpp"
#include "hm/core/text/counted.hpp"
#include "hm/io/bytes/file_name.hpp"
#include "hm/io/map/occupancy_grid_file.hpp"
#include "hm/io/map/octomap_file.hpp"
#include "hm/io/mesh/mesh_file.hpp"
#include "hm/io/pose/trajectory_file.hpp"
#include "hm/io/rgbd/carried_imu_file.hpp"
#include "hm/io/rgbd/tum_writer.hpp"
#include "hm/mapping/map_store.hpp"
#include "hm/mesh/simplify.hpp"
#include "hm/mesh/whole_mesh.hpp"
#include "hm/pipeline/common/mvog_file.hpp"
#include "hm/pipeline/common/reading_warnings.hpp"
#include "hm/pipeline/inspect/file_check.hpp"

namespace hm {
namespace {

Result<ConversionSummary> write_cleaned(const ConversionOptions& options, TriangleMesh mesh,
                                        const UpDirection& up) {
  mesh = clean_mesh(std::move(mesh), options.mesh);
  MeshWriteOptions write;
  write.program = "housemartin " + options.run.program_version;
  write.up = up;
  if (const auto written = as_run_failure(write_mesh(options.to, mesh, write)); !written)
    return forward_error(written);
  return ConversionSummary{
      counted(mesh.vertices.size(), "vertex", "vertices") + ", " + counted(mesh.triangles.size(), "triangle"),
      mesh.triangles.size(), 0};
}

Result<ConversionSummary> convert_map(const ConversionOptions& options) {
  const auto map = MapFile::open(options.from, MapOpenMode::kRead);
  if (!map) return forward_error(map);
  const auto grid = load_grid(*map);
  if (!grid) return forward_error(grid);
  const ParallelLoop loop(options.run.threads);
  return write_cleaned(options, extract_mesh(*grid, options.mesh, loop), up_of_map(map->header()));
}

/// The centres of the occupied cells.
TriangleMesh occupied_points(std::span<const OccupancyVoxel> voxels) {
  TriangleMesh points;
  for (const OccupancyVoxel& voxel : voxels)
    if (voxel.state == Occupancy::kOccupied) points.vertices.push_back(voxel.p_world_centre);
  return points;
}

Result<ConversionSummary> write_slice(const ConversionOptions& options, const MultiVolumeGrid& map) {
  const auto slice = plan_of(map, options.slice);
  if (!slice) return forward_error(slice);
  if (slice->cells.empty())
    return fail(
        ErrorCode::kInvalidValue, options.from.string(),
        "nothing of this map lies between {:g} m and {:g} m (laser.slice_bottom_m, laser.slice_top_m)",
        options.slice.slice_bottom_m, options.slice.slice_top_m);
  const auto files = occupancy_grid_files(options.to);
  if (!files) return forward_error(files);
  if (const auto written = as_run_failure(write_occupancy_grid(options.to, *slice)); !written)
    return forward_error(written);
  const auto cells =
      static_cast<std::size_t>(slice->cells.width()) * static_cast<std::size_t>(slice->cells.height());
  ConversionSummary summary{
      fmt::format("slice of {} x {} cells", slice->cells.width(), slice->cells.height()), cells, 0};
  summary.outputs = {files->description, files->image};
  return summary;
}

Result<ConversionSummary> convert_occupancy(const ConversionOptions& options) {
  const auto map = read_mvog(options.from);
  if (!map) return forward_error(map);
  const std::string extension = lower_extension(options.to);
  if (occupancy_grid_files(options.to)) return write_slice(options, *map);
  const auto voxels = map->voxels();
  if (extension != ".ply") {
    const auto written = as_run_failure(write_octomap(options.to, voxels, map->params().resolution_m));
    if (!written) return forward_error(written);
    return ConversionSummary{counted(voxels.size(), "known cell"), voxels.size(), 0};
  }
  const TriangleMesh points = occupied_points(voxels);
  MeshWriteOptions write;
  write.program = "housemartin " + options.run.program_version;
  if (const auto written = as_run_failure(write_mesh(options.to, points, write)); !written)
    return forward_error(written);
  return ConversionSummary{counted(points.vertices.size(), "point"), points.vertices.size(), 0};
}

Result<ConversionSummary> convert_mesh(const ConversionOptions& options) {
  auto mesh = read_mesh(options.from);
  if (!mesh) return forward_error(mesh);
  const auto up = read_mesh_up(options.from);
  return write_cleaned(options, std::move(*mesh), up && *up ? **up : UpDirection());
}

Result<ConversionSummary> convert_trajectory(const ConversionOptions& options) {
  const auto trajectory = read_trajectory(options.from);
  if (!trajectory) return forward_error(trajectory);
  const auto written =
      as_run_failure(lower_extension(options.to) == ".kitti" ? write_kitti_trajectory(options.to, *trajectory)
                                                             : write_tum_trajectory(options.to, *trajectory));
  if (!written) return forward_error(written);
  return ConversionSummary{counted(trajectory->size(), "pose"), trajectory->size(), 0};
}

Result<ConversionSummary> convert_recording(const ConversionOptions& options) {
  const auto recording = open_recording(options.from, options.recording_options);
  if (!recording) return forward_error(recording);
  const RecordingInfo& info = (*recording)->info();
  auto writer = as_run_failure(
      TumWriter::create(options.to, info.camera.without_distortion(), 1.0 / info.depth_unit_m));
  if (!writer) return forward_error(writer);
  ConversionSummary summary;
  FramePrefetcher frames(**recording, 0, info.frame_count, 1, {.readers = options.run.threads});
  for (std::size_t done = 0; const auto frame = frames.next(); ++done) {
    if (!*frame) {
      ++summary.skipped;
    } else {
      if (const auto added = as_run_failure(writer->add(**frame)); !added) return forward_error(added);
      ++summary.items;
    }
    if (options.run.progress) options.run.progress({"converting", done + 1, info.frame_count, {}});
  }
  if (const auto finished = as_run_failure(writer->finish()); !finished) return forward_error(finished);
  if (info.imu)
    if (const auto written = as_run_failure(write_carried_imu(options.to, *info.imu)); !written)
      return forward_error(written);
  summary.warnings = reading_warnings(info);
  if (summary.skipped > 0)
    summary.warnings.push_back(
        fmt::format("{} left out: they could not be read", counted(summary.skipped, "frame")));
  summary.text = fmt::format("{}, {} could not be read", counted(summary.items, "frame"),
                             with_thousands(summary.skipped));
  return summary;
}

/// Refuses a kind of input that cannot become what the output's name asks for.
Result<void> check_target(PathKind kind, const ConversionOptions& options) {
  const std::string extension = lower_extension(options.to);
  const auto refuse = [&](const char* what, const char* into) -> Result<void> {
    return fail(ErrorCode::kUsage, options.to.string(), "{} can become {}", what, into);
  };
  switch (kind) {
    case PathKind::kMap:
      if (!is_written_mesh_name(options.to)) return refuse("a map", "a mesh: .ply .obj .glb");
      break;
    case PathKind::kOccupancy:
      if (extension != ".ot" && extension != ".bt" && extension != ".ply" &&
          !occupancy_grid_files(options.to))
        return refuse("an occupancy grid",
                      "OctoMap (.ot .bt), points (.ply) or a slice (.yaml, .yml or .pgm: both files)");
      break;
    case PathKind::kMesh:
      if (!is_written_mesh_name(options.to)) return refuse("a mesh", "another mesh: .ply .obj .glb");
      break;
    case PathKind::kTrajectory:
      if (extension != ".tum" && extension != ".txt" && extension != ".kitti")
        return refuse("a trajectory", "a trajectory: .tum .txt (TUM), .kitti");
      break;
    case PathKind::kRecording:
      if (!extension.empty()) return refuse("a recording", "a folder (a TUM recording)");
      break;
    case PathKind::kLaserRecording:
      return refuse("a laser recording", "maps and a trajectory, with `hm laser`");
    case PathKind::kResult:
      return fail(ErrorCode::kUsage, options.from.string(),
                  "a folder of results: name the file of it to convert (map.hmap, mesh.ply, trajectory.tum)");
    case PathKind::kPoseGraph:
      return refuse("a pose graph", "nothing else: solvers read .g2o");
  }
  return {};
}

}  // namespace

Result<ConversionSummary> convert(const ConversionOptions& options) {
  const auto kind = kind_of(options.from);
  if (!kind) return forward_error(kind);
  if (const auto possible = check_target(*kind, options); !possible) return forward_error(possible);
  switch (*kind) {
    case PathKind::kMap:
      return convert_map(options);
    case PathKind::kOccupancy:
      return convert_occupancy(options);
    case PathKind::kMesh:
      return convert_mesh(options);
    case PathKind::kTrajectory:
      return convert_trajectory(options);
    case PathKind::kRecording:
      return convert_recording(options);
    case PathKind::kLaserRecording:
    case PathKind::kResult:
    case PathKind::kPoseGraph:
      break;  // refused above
  }
  return fail(ErrorCode::kInternal, options.from.string(), "an unknown kind of input");
}

}  // namespace hm
