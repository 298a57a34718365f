#include "fuzz_readers.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "hm/core/check.hpp"
#include "hm/core/hash.hpp"
#include "hm/core/params.hpp"
#include "hm/flight/trace/core_trace.hpp"
#include "hm/io/bytes/json.hpp"
#include "hm/io/camera/calibration_file.hpp"
#include "hm/io/camera/camera_file.hpp"
#include "hm/io/camera/foreign_camera.hpp"
#include "hm/io/image/image_codec.hpp"
#include "hm/io/laser/laser_recording.hpp"
#include "hm/io/laser/laser_rig_file.hpp"
#include "hm/io/lists/pose_list.hpp"
#include "hm/io/lists/stamped_list.hpp"
#include "hm/io/map/map_file.hpp"
#include "hm/io/map/map_record.hpp"
#include "hm/io/map/occupancy_grid_file.hpp"
#include "hm/io/map/octomap_file.hpp"
#include "hm/io/mesh/mesh_file.hpp"
#include "hm/io/pose/g2o_file.hpp"
#include "hm/io/pose/pose_matrix_file.hpp"
#include "hm/io/pose/relations_file.hpp"
#include "hm/io/pose/trajectory_file.hpp"
#include "hm/io/rgbd/carried_imu_file.hpp"
#include "hm/io/rgbd/recording.hpp"
#include "hm/io/testing/temporary_folder_test_support.hpp"
#include "hm/link/codec/mavlink_parser.hpp"
#include "hm/link/codec/serial_frame.hpp"
#include "hm/mvog/multi_volume_grid.hpp"
#include "hm/pipeline/flight/flight_script.hpp"
#include "saved_run_readers.hpp"

namespace hm::fuzz {
namespace {

namespace fs = std::filesystem;
using Bytes = std::span<const std::uint8_t>;

std::string_view text_of(Bytes bytes) { return {reinterpret_cast<const char*>(bytes.data()), bytes.size()}; }

Bytes bytes_of(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

/// A folder for this process; each reader has its own in it.
const fs::path& folder() {
  static const TemporaryFolder temporary;
  return temporary.path();
}

template <class Items, class StampOf>
void check_increasing(const Items& items, const StampOf& stamp_of) {
  for (std::size_t i = 1; i < items.size(); ++i)
    HM_CHECK(stamp_of(items[i - 1]) < stamp_of(items[i]), "stamp {} does not increase", i);
}

void check_sound(const Trajectory& poses) {
  check_increasing(poses, [](const StampedPose& pose) { return pose.stamp; });
  for (const StampedPose& pose : poses) HM_CHECK(is_rigid(pose.T_world_base), "a pose that is not rigid");
}

void check_sound(const TriangleMesh& mesh) {
  HM_CHECK(mesh.normals.empty() || mesh.normals.size() == mesh.vertices.size(), "{} normals",
           mesh.normals.size());
  HM_CHECK(mesh.colors.empty() || mesh.colors.size() == mesh.vertices.size(), "{} colours",
           mesh.colors.size());
  for (const auto& triangle : mesh.triangles)
    for (const auto corner : triangle)
      HM_CHECK(static_cast<std::size_t>(corner) < mesh.vertices.size(), "corner {} of {}", corner,
               mesh.vertices.size());
}

void check_sound(const LaserScan& scan) {
  HM_CHECK(scan.size() > 0 && std::isfinite(scan.angle_min_rad) && std::isfinite(scan.angle_increment_rad) &&
               scan.angle_increment_rad != 0 && std::isfinite(scan.time_increment_s),
           "a scan without geometry");
  for (const float range : scan.ranges_m)
    HM_CHECK(std::isnan(range) || range == LaserScan::kNoReturn ||
                 (range > 0 && static_cast<double>(range) < scan.range_max_m),
             "a range of {} m", range);
}

void check_sound(const LaserRecording& recording) {
  for (const LaserStream& laser : recording.lasers) {
    HM_CHECK(!laser.scans.empty() && is_rigid(laser.T_base_laser), "laser {}", laser.name);
    HM_CHECK(laser.received.empty() || laser.received.size() == laser.scans.size(), "{} times of arrival",
             laser.received.size());
    check_increasing(laser.scans, [](const LaserScan& scan) { return scan.stamp; });
    for (const LaserScan& scan : laser.scans) check_sound(scan);
  }
  check_increasing(recording.imu, [](const ImuSample& sample) { return sample.stamp; });
  check_increasing(recording.range.readings, [](const RangeReading& reading) { return reading.stamp; });
  check_sound(recording.odometry);
  check_sound(recording.truth);
}

template <LaserRecordingKind kKind>
bool read_laser(const char* name, Bytes bytes) {
  LaserRecordingOptions options;
  options.kind = kKind;
  const auto recording = open_laser_recording(as_file(name, bytes), options);
  if (recording) check_sound(*recording);
  return accepted(recording);
}

bool read_mesh_named(const char* name, Bytes bytes) {
  const auto mesh = read_mesh(as_file(name, bytes));
  if (mesh) check_sound(*mesh);
  return accepted(mesh);
}

/// Gives bytes that end in the FNV-1a checksum of what lies before it the right one: a reader that only ever
/// sees wrong checksums is not tested behind them.
void seal(std::span<std::uint8_t> bytes) {
  if (bytes.size() < 8) return;
  const std::uint64_t sum = fnv1a(bytes.first(bytes.size() - 8));
  std::memcpy(bytes.data() + bytes.size() - 8, &sum, 8);
}

bool read_correction(Bytes bytes) {
  std::vector<std::uint8_t> sealed(bytes.begin(), bytes.end());
  seal(sealed);
  return accepted(read_depth_correction(as_file("correction.hmdc", sealed)));
}

/// The header of a multi-volume grid, then its tiles, each with its checksum behind it.
bool read_mvog(Bytes bytes) {
  constexpr std::size_t kHeaderBytes = 184, kTileBytes = 24;
  std::vector<std::uint8_t> sealed(bytes.begin(), bytes.end());
  std::size_t begin = 0, end = kHeaderBytes + 8;
  while (end <= sealed.size()) {
    seal(std::span(sealed).subspan(begin, end - begin));
    begin = end;
    std::uint64_t units = 0;
    if (sealed.size() - begin < kTileBytes) break;
    std::memcpy(&units, sealed.data() + begin + 16, 8);
    if (units > sealed.size()) break;
    end = begin + kTileBytes + 2 * static_cast<std::size_t>(units) + 8;
  }
  const auto grid = MultiVolumeGrid::parse(std::as_bytes(std::span(sealed)));
  if (grid)
    HM_CHECK(MultiVolumeGrid::parse(grid->serialise()).has_value(), "what was read cannot be read again");
  return accepted(grid);
}

bool read_map(Bytes bytes) {
  const fs::path path = as_file("map/map.hmap", bytes);
  bool read_well = false;
  for (const MapOpenMode mode : {MapOpenMode::kRead, MapOpenMode::kReadLenient}) {
    const auto map = MapFile::open(path, mode);
    if (!accepted(map)) continue;
    read_well |= map->for_each_block({}, [](const MapBlockView&) { return true; }).has_value();
  }
  return read_well;
}

bool read_occupancy_yaml(Bytes bytes) {
  as_file("grid/map.pgm", bytes_of("P5 3 2 255\nabcdef"));
  return accepted(read_occupancy_grid(as_file("grid/map.yaml", bytes)));
}

bool read_occupancy_image(Bytes bytes) {
  constexpr std::string_view kYaml =
      "image: map.pgm\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: "
      "0.2\n";
  as_file("grid_image/map.pgm", bytes);
  return accepted(read_occupancy_grid(as_file("grid_image/map.yaml", bytes_of(kYaml))));
}

/// The pose of the one frame of a 7-Scenes recording.
bool read_seven_scenes_pose(Bytes bytes) {
  static const bool made = [] {
    const auto png = encode_png(Image<std::uint16_t>(8, 6));
    as_file("seven_scenes/frame-000000.depth.png", png);
    return true;
  }();
  HM_CHECK(made, "no recording");
  const fs::path pose = as_file("seven_scenes/frame-000000.pose.txt", bytes);
  const auto recording = open_recording(pose.parent_path());
  if (recording) check_sound((*recording)->info().trajectory);
  return accepted(recording);
}

/// A camera in each of the forms in which other programs leave it; one that names its images must be sound.
bool read_foreign_camera(Bytes bytes) {
  constexpr std::array kForms{"open3d/intrinsic.json", "scannet/intrinsics_depth.txt",
                              "bundlefusion/info.txt", "replica/cam_params.json"};
  bool read_well = false;
  for (const fs::path form : kForms) {
    const auto found = find_foreign_camera(as_file(fs::path("foreign") / form, bytes).parent_path());
    if (!accepted(found) || !*found) continue;
    PinholeCamera camera = (*found)->camera;
    if (camera.width == 0) camera.width = 640;
    if (camera.height == 0) camera.height = 480;
    HM_CHECK(check_camera(camera).has_value(), "an unsound camera of {}", form.string());
    read_well = true;
  }
  return read_well;
}

bool read_pose_matrix_file(Bytes bytes) {
  const auto pose = read_pose_matrix(as_file("pose_matrix.txt", bytes));
  if (pose) HM_CHECK(is_rigid(*pose), "a pose that is not rigid");
  return accepted(pose);
}

template <std::size_t kLines>
bool read_carried(const char* name, Bytes bytes,
                  const std::array<std::pair<const char*, const char*>, kLines>& beside) {
  const fs::path path = as_file(name, bytes);
  for (const auto& [other, text] : beside) as_file(path.parent_path().filename() / other, bytes_of(text));
  return accepted(read_carried_imu(path.parent_path()));
}

bool read_trajectory_file(Bytes bytes) {
  const auto poses = read_trajectory(as_file("trajectory.txt", bytes));
  if (poses) check_sound(*poses);
  return accepted(poses);
}

bool read_poses(Bytes bytes) {
  const auto list = detail::read_pose_list(as_file("groundtruth.txt", bytes));
  if (list) check_sound(list->poses);
  return accepted(list);
}

bool read_parameters(Bytes bytes) {
  MvogParams params;
  ParamList list;
  list.add("mvog", params);
  const bool read = accepted(list.read_toml(text_of(bytes), "parameters.toml"));
  if (read) HM_CHECK(list.check().has_value(), "parameters beyond their ranges");
  return read;
}

bool read_json_text(Bytes bytes) {
  const auto value = parse_json(text_of(bytes), "report.json");
  if (value) HM_CHECK(parse_json(to_json_text(*value), "again").has_value(), "written JSON cannot be read");
  return accepted(value);
}

/// What the fast reader of the usual PNG files takes, libpng reads as the same image.
template <class Pixel>
void check_by_libpng(Bytes bytes, const std::optional<Image<Pixel>>& plain,
                     Result<Image<Pixel>> (*libpng)(Bytes bytes, const std::string& where)) {
  if (!plain) return;
  const auto reference = libpng(bytes, "reference.png");
  HM_CHECK(reference && std::ranges::equal(reference->pixels(), plain->pixels()),
           "libpng reads another image");
}

bool read_depth(Bytes bytes) {
  check_by_libpng(bytes, detail::decode_plain_png_gray16(bytes), detail::decode_png_gray16);
  return accepted(read_depth_image(as_file("depth.png", bytes)));
}

bool read_color(Bytes bytes) {
  check_by_libpng(bytes, detail::decode_plain_png_color(bytes), detail::decode_png_color);
  return accepted(decode_color_image(bytes, "color.png"));
}

/// A stream of bytes from a serial line, of either protocol: every accepted frame can be written and is then
/// accepted again.
bool read_link(Bytes bytes) {
  std::size_t accepted_frames = 0;
  MavlinkParser parser;
  const auto use = [&](const MavlinkFrame& frame) {
    ++accepted_frames;
    MavlinkBytes written{};
    const std::size_t count = write_mavlink_frame(frame, written);
    MavlinkParser again;
    std::size_t read_again = 0;
    again.parse(std::span(written).first(count), [&](const MavlinkFrame& other) {
      HM_CHECK(other.payload == frame.payload && other.message == frame.message, "another frame");
      ++read_again;
    });
    HM_CHECK(read_again == 1, "{} frames of one", read_again);
  };
  parser.parse(bytes, use);
  while (const auto frame = parser.next_at_end()) use(*frame);
  HM_CHECK(parser.counts().skipped_bytes <= bytes.size(), "{} bytes skipped", parser.counts().skipped_bytes);
  for (const SerialDirection direction : {SerialDirection::kUp, SerialDirection::kDown}) {
    SerialParser serial(direction);
    serial.parse(bytes, [&](const SerialFrame& frame) {
      ++accepted_frames;
      SerialBytes written{};
      HM_CHECK(write_serial_frame(frame, written) > 0, "type {}", frame.type);
    });
  }
  return accepted_frames > 0;
}

constexpr std::size_t kTraceBytes = CoreTraceRecord::kBytes, kTraceSummed = kTraceBytes - 4;

/// Gives every frame of a stream of core.trace's frames the right checksum.
std::vector<std::uint8_t> with_frame_sums(Bytes bytes) {
  std::vector<std::uint8_t> sealed(bytes.begin(), bytes.end());
  for (std::size_t at = 0; at + CoreTraceFrame::kOverhead <= sealed.size();) {
    const std::size_t length = sealed[at + 1], size = length + CoreTraceFrame::kOverhead;
    if (sealed[at] != 'H' || length > CoreTraceFrame::kMaxLength || at + size > sealed.size()) {
      ++at;
      continue;
    }
    std::array<std::uint8_t, kTraceSummed> whole{'H', 'M', 'T', '1'};
    std::memcpy(whole.data() + 4, sealed.data() + at + 2, length);
    const std::uint32_t sum = crc32(whole);
    std::memcpy(sealed.data() + at + 2 + length, &sum, sizeof(sum));
    at += size;
  }
  return sealed;
}

/// A stream from a board: what is accepted is accepted again when it is written.
std::size_t count_core_frames(Bytes bytes) {
  std::size_t count = 0;
  CoreTraceParser parser;
  for (const std::uint8_t byte : bytes) {
    parser.push(byte);
    while (const auto record = parser.next()) {
      ++count;
      const CoreTraceFrame frame = frame_of(*record);
      CoreTraceParser again;
      std::optional<CoreTraceRecord> read;
      for (const std::uint8_t written : std::span(frame.bytes).first(frame.size)) {
        again.push(written);
        read = again.next();
      }
      HM_CHECK(read && encode(*read) == encode(*record), "another record");
    }
  }
  HM_CHECK(parser.skipped() <= bytes.size(), "{} bytes skipped", parser.skipped());
  return count;
}

/// core.trace as a file, each record with its magic and checksum set right, and as a stream of frames.
bool read_core_trace(Bytes bytes) {
  std::vector<std::uint8_t> sealed(bytes.begin(), bytes.end());
  for (std::size_t at = 0; at + kTraceBytes <= sealed.size(); at += kTraceBytes) {
    std::memcpy(sealed.data() + at, "HMT1", 4);
    const std::uint32_t sum = crc32(std::span(sealed).subspan(at, kTraceSummed));
    std::memcpy(sealed.data() + at + kTraceSummed, &sum, sizeof(sum));
  }
  CoreTraceReader reader(sealed);
  std::size_t records = 0;
  while (const auto record = reader.next()) {
    const auto written = encode(*record);
    HM_CHECK(std::ranges::equal(written, std::span(sealed).subspan(records * kTraceBytes, kTraceBytes)),
             "record {} is written otherwise", records);
    ++records;
  }
  HM_CHECK(reader.bytes_left() == sealed.size() - records * kTraceBytes, "{} bytes left",
           reader.bytes_left());
  return records + count_core_frames(bytes) + count_core_frames(with_frame_sums(bytes)) > 0;
}

void check_sound(const FlightScript& script) {
  HM_CHECK(!script.orders.empty(), "a script without orders");
  for (const FlightOrder& order : script.orders)
    HM_CHECK(std::isfinite(order.height_m) && order.position_m.allFinite() &&
                 order.velocity_m_s.allFinite() && std::isfinite(order.yaw_rate_rad_s) &&
                 std::isfinite(order.yaw_rad.value_or(0)) && order.duration >= Duration{},
             "an order that is no number: {}", order.text);
}

template <class Parse>
bool read_orders(Parse&& parse, Bytes bytes) {
  const auto script = parse(text_of(bytes), "flight.fly");
  if (script) check_sound(*script);
  return accepted(script);
}

constexpr std::array kReaders{
    Reader{"accelerometer", [](Bytes b) { return read_carried<0>("tum_imu/accelerometer.txt", b, {}); }},
    Reader{"associations",
           [](Bytes b) { return accepted(detail::read_associations(as_file("associations.txt", b))); }},
    Reader{"breezy", [](Bytes b) { return read_laser<LaserRecordingKind::kBreezySlam>("breezy/a.dat", b); }},
    Reader{"calibration",
           [](Bytes b) { return accepted(read_calibration(as_file("calibration/calibration.toml", b))); }},
    Reader{"camera", [](Bytes b) { return accepted(read_camera_file(as_file("camera.txt", b))); }},
    Reader{"carmen", [](Bytes b) { return read_laser<LaserRecordingKind::kCarmen>("carmen/a.log", b); }},
    Reader{"color_image", read_color},
    Reader{"core_trace", read_core_trace},
    Reader{"depth_correction", read_correction},
    Reader{"depth_image", read_depth},
    Reader{"euroc_imu",
           [](Bytes b) { return read_laser<LaserRecordingKind::kEurocImu>("euroc/imu0.csv", b); }},
    Reader{"flight_script", [](Bytes b) { return read_orders(parse_flight_script, b); }},
    Reader{"foreign_camera", read_foreign_camera},
    Reader{"g2o_2d", [](Bytes b) { return accepted(read_g2o_2d(as_file("graph2.g2o", b))); }},
    Reader{"g2o_3d", [](Bytes b) { return accepted(read_g2o_3d(as_file("graph3.g2o", b))); }},
    Reader{"imu_csv",
           [](Bytes b) {
             return read_carried<1>("imu/imu.csv", b, {{{"imu.toml", "[imu]\nrpy_deg = [1, 2, 3]\n"}}});
           }},
    Reader{"imu_toml",
           [](Bytes b) {
             return read_carried<1>("imu_frame/imu.toml", b,
                                    {{{"imu.csv", "1000,1,2,3,4,5,6\n2000,1,2,3,4,5,6\n"}}});
           }},
    Reader{"intrinsics",
           [](Bytes b) { return accepted(read_intrinsics_matrix(as_file("intrinsics.txt", b))); }},
    Reader{"json", read_json_text},
    Reader{"laser_graph",
           [](Bytes b) { return read_laser<LaserRecordingKind::kG2oLaser>("laser_graph/a.log", b); }},
    Reader{"link", read_link},
    Reader{"map", read_map},
    Reader{"map_header", [](Bytes b) { return accepted(parse_record(text_of(b), "map.hmap")); }},
    Reader{"mesh_dae", [](Bytes b) { return read_mesh_named("mesh.dae", b); }},
    Reader{"mesh_fbx", [](Bytes b) { return read_mesh_named("mesh.fbx", b); }},
    Reader{"mesh_glb", [](Bytes b) { return read_mesh_named("mesh.glb", b); }},
    Reader{"mesh_gltf", [](Bytes b) { return read_mesh_named("mesh.gltf", b); }},
    Reader{"mesh_obj", [](Bytes b) { return read_mesh_named("mesh.obj", b); }},
    Reader{"mesh_off", [](Bytes b) { return read_mesh_named("mesh.off", b); }},
    Reader{"mesh_ply", [](Bytes b) { return read_mesh_named("mesh.ply", b); }},
    Reader{"mesh_stl", [](Bytes b) { return read_mesh_named("mesh.stl", b); }},
    Reader{"moos", [](Bytes b) { return read_laser<LaserRecordingKind::kMoos>("moos/a.alog", b); }},
    Reader{"mvog", read_mvog},
    Reader{"occupancy_image", read_occupancy_image},
    Reader{"occupancy_yaml", read_occupancy_yaml},
    Reader{"octomap_bt", [](Bytes b) { return accepted(read_octomap(as_file("map.bt", b))); }},
    Reader{"octomap_ot", [](Bytes b) { return accepted(read_octomap(as_file("map.ot", b))); }},
    Reader{"parameters", read_parameters},
    Reader{"picture_list",
           [](Bytes b) { return accepted(detail::read_image_list(as_file("depth.txt", b))); }},
    Reader{"pose_list", read_poses},
    Reader{"pose_matrix", read_pose_matrix_file},
    Reader{"reconstruction_state", read_reconstruction_state},
    Reader{"relations", [](Bytes b) { return accepted(read_relations(as_file("truth.relations", b))); }},
    Reader{"rig", [](Bytes b) { return accepted(read_laser_rig(as_file("rig.toml", b))); }},
    Reader{"rosbag", [](Bytes b) { return read_laser<LaserRecordingKind::kRosBag>("bag/a.bag", b); }},
    Reader{"seven_scenes_pose", read_seven_scenes_pose},
    Reader{"slam_checkpoint", read_checkpoint},
    Reader{"slam_journal", read_journal},
    Reader{"trajectory", read_trajectory_file},
    Reader{"way_points", [](Bytes b) { return read_orders(parse_way_points, b); }},
    Reader{"wean_hall",
           [](Bytes b) { return read_laser<LaserRecordingKind::kWeanHall>("wean_hall/a.log", b); }},
};

}  // namespace

fs::path as_file(const fs::path& name, Bytes bytes) {
  const fs::path path = folder() / name;
  if (name.has_parent_path()) fs::create_directories(path.parent_path());
  std::remove(
      path.c_str());  // some file systems wait for the disk when a file is truncated and written again
  std::FILE* file = std::fopen(path.c_str(), "wb");
  HM_CHECK(file && std::fwrite(bytes.data(), 1, bytes.size(), file) == bytes.size(), "cannot write {}",
           path.string());
  std::fclose(file);
  return path;
}

std::span<const Reader> readers() { return kReaders; }

const Reader* find_reader(std::string_view name) {
  const auto found = std::ranges::find(kReaders, name, &Reader::name);
  return found == kReaders.end() ? nullptr : &*found;
}

}  // namespace hm::fuzz
