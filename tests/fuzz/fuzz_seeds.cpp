#include "fuzz_seeds.hpp"

#include <fmt/format.h>

#include <string>

#include "hm/core/rng.hpp"
#include "hm/flight/trace/core_trace.hpp"
#include "hm/io/bytes/file_bytes.hpp"
#include "hm/io/camera/calibration_file.hpp"
#include "hm/io/image/image_file.hpp"
#include "hm/io/laser/laser_rig_file.hpp"
#include "hm/io/map/map_record.hpp"
#include "hm/io/map/map_test_support.hpp"
#include "hm/io/map/occupancy_grid_file.hpp"
#include "hm/io/map/octomap_file.hpp"
#include "hm/io/mesh/mesh_file.hpp"
#include "hm/io/mesh/scene_test_support.hpp"
#include "hm/io/testing/io_test_support.hpp"
#include "hm/io/testing/testing_bags.hpp"
#include "hm/link/codec/mavlink_frame.hpp"
#include "hm/link/codec/serial_frame.hpp"
#include "hm/mvog/multi_volume_grid.hpp"
#include "hm/pipeline/dense/reconstruction_state.hpp"
#include "hm/pipeline/rgbd/resume/slam_checkpoint.hpp"
#include "hm/pipeline/rgbd/resume/slam_journal.hpp"

namespace hm::fuzz {
namespace {

/// Collects seeds; what a writer writes goes through a folder.
class Collection {
 public:
  void add(std::string_view reader, std::vector<std::uint8_t> bytes) {
    all.push_back({reader, std::move(bytes)});
  }
  void text(std::string_view reader, std::string_view text) { add(reader, {text.begin(), text.end()}); }
  void file(std::string_view reader, const std::string& name) {
    const auto bytes = read_file_bytes(folder / name);
    HM_CHECK(bytes.has_value(), "{} was not written", name);
    add(reader, *bytes);
  }

  TemporaryFolder folder;
  std::vector<Seed> all;
};

void must(const Result<void>& written) { HM_CHECK(written.has_value(), "{}", to_string(written.error())); }

std::string numbers(int count) {
  std::string text;
  for (int i = 0; i < count; ++i) text += fmt::format("{} ", 1.5 + 0.01 * i);
  return text;
}

void add_images(Collection& seeds) {
  Image<Rgb8> color(9, 7, Rgb8{200, 30, 40});
  color(2, 3) = {1, 2, 3};
  Image<std::uint16_t> depth(9, 7, 1000);
  depth(4, 4) = 65535;
  seeds.add("color_image", encode_png(color));
  seeds.add("color_image", encode_png(color, PngEffort::kFast));
  seeds.add("color_image", encode_jpeg(color));
  seeds.add("depth_image", encode_png(depth));
  seeds.add("depth_image", encode_png(depth, PngEffort::kFast));
  seeds.text("depth_image", "P5\n# raw\n3 2 65535\nabcdefghijkl");
}

void add_meshes(Collection& seeds) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  mesh.normals.assign(4, Eigen::Vector3f::UnitZ());
  mesh.colors = {{255, 0, 0}, {0, 255, 0}, {0, 0, 255}, {9, 9, 9}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  for (const auto& [reader, name] :
       {std::pair{"mesh_ply", "m.ply"}, {"mesh_obj", "m.obj"}, {"mesh_glb", "m.glb"}}) {
    must(write_mesh(seeds.folder / name, mesh));
    seeds.file(reader, name);
  }
  seeds.text(
      "mesh_ply",
      "ply\nformat ascii 1.0\ncomment x\nelement vertex 3\nproperty double x\nproperty float y\nproperty "
      "float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nelement face 1\nproperty list "
      "uchar int vertex_indices\nend_header\n0 0 0 1 2 3\n1 0 0 1 2 3\n0 1 0 1 2 3\n3 0 1 2\n");
  seeds.text("mesh_obj",
             "# o\nv 0 0 0\nv 1 0 0 0.5 0.5 1\nv 0 1 0\nvn 0 0 1\nvt 0 0\nf 1//1 2/1/1 -1\nf 1 2 3\n");
  for (const test::SceneFile& scene : test::scene_files()) {
    const std::string extension = scene.name.substr(scene.name.rfind('.') + 1);
    for (const std::string_view reader :
         {"mesh_dae", "mesh_fbx", "mesh_glb", "mesh_gltf", "mesh_off", "mesh_stl"})
      if (reader == "mesh_" + extension) seeds.text(reader, scene.bytes);
  }
}

void add_maps(Collection& seeds) {
  const auto blocks = test::make_blocks(3, 2, 5);
  {
    auto map = MapFile::create(seeds.folder / "m.hmap", test::example_header());
    HM_CHECK(map.has_value(), "no map");
    must(map->put_blocks(test::views_of(blocks)));
    must(map->commit(R"({"next_frame": 3})"));
  }
  seeds.file("map", "m.hmap");
  seeds.text("map_header", to_text({test::example_header(), {2, 3, 0x1234, 5}}));
  std::vector<OccupancyVoxel> voxels;
  for (int i = 0; i < 9; ++i) {
    voxels.push_back({{0.1F * static_cast<float>(i % 3), 0.1F * static_cast<float>(i / 3), 0.05F},
                      0.1F,
                      i % 2 == 0 ? 0.9F : 0.2F,
                      i % 2 == 0 ? Occupancy::kOccupied : Occupancy::kFree});
  }
  must(write_octomap(seeds.folder / "m.bt", voxels, 0.1));
  must(write_octomap(seeds.folder / "m.ot", voxels, 0.1));
  seeds.file("octomap_bt", "m.bt");
  seeds.file("octomap_ot", "m.ot");
  seeds.text(
      "occupancy_yaml",
      "image: map.pgm\nresolution: 0.050000\norigin: [-1.0, -2.5, 0.0]\nnegate: 0\noccupied_thresh: 0.65\n"
      "free_thresh: 0.196\nmode: trinary\n");
  seeds.text("occupancy_yaml",
             "image: map.pgm # a comment\nresolution: 5e-2\norigin:\n- 1\n- 2\n- 0\nnegate: 1\nmode: scale\n"
             "occupied_thresh: 0.65\nfree_thresh: 0.196\n");
  seeds.text("occupancy_image", "P5\n# by hand\n3 2\n255\nabcdef");
  seeds.text("occupancy_image", "P2\n3 2\n255\n0 254 205 0 1 2\n");
}

void add_link(Collection& seeds) {
  std::vector<std::uint8_t> stream;
  MavlinkMessages::for_each([&]<class Message>() {
    MavlinkBytes bytes{};
    MavlinkFrame frame = make_mavlink_frame(Message{}, {1, 1}, 3);
    frame.payload[0] = 7;
    const std::size_t count = write_mavlink_frame(frame, bytes);
    stream.insert(stream.end(), bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(count));
  });
  seeds.add("link", stream);
  SerialBytes bytes{};
  std::size_t count = write_serial_frame(make_serial_frame(SerialHeight{1, 2}, SerialDirection::kUp), bytes);
  seeds.add("link", {bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(count)});
  count = write_serial_frame(make_serial_frame(SerialImu{}, SerialDirection::kDown), bytes);
  seeds.add("link", {bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(count)});
}

void add_flight(Collection& seeds) {
  std::vector<std::uint8_t> file, stream;
  for (std::size_t kind = 0; kind < CoreTraceRecord::kKinds; ++kind) {
    CoreTraceRecord record;
    record.kind = static_cast<CoreTraceRecord::Kind>(kind);
    record.sequence = static_cast<std::uint32_t>(kind);
    record.stamp = Time{1'000'000'000};
    record.input[3] = 9.81F;
    if (kind == 0) record.estimate.fill(0.5F);
    const auto bytes = encode(record);
    file.insert(file.end(), bytes.begin(), bytes.end());
    const CoreTraceFrame frame = frame_of(record);
    stream.push_back('H');  // noise that looks like a beginning
    stream.insert(stream.end(), frame.bytes.begin(),
                  frame.bytes.begin() + static_cast<std::ptrdiff_t>(frame.size));
  }
  seeds.add("core_trace", file);
  seeds.add("core_trace", stream);
  seeds.text("flight_script",
             "# a tour\ntakeoff 1.3\ngoto 1 -2.5 1.2 90\nfault laser_off at 12 for 2e0 # seconds\nwait 0.5\n"
             "velocity 0.5 0 -0.1 -20 for 1.5\nhold\nland\n");
  seeds.text("flight_script", "takeoff\r\n\r\ngoto 1e-3 +2 .5\r\nestop");
  seeds.text("way_points", "# x y z yaw\n1 0 1.2\n-1 0.3 1.2 -90.5\n");
}

void add_mvog(Collection& seeds) {
  MultiVolumeGrid grid;
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < 40; ++i)
    points.emplace_back(2 * std::cos(0.15F * static_cast<float>(i)),
                        2 * std::sin(0.15F * static_cast<float>(i)), 0.02F * static_cast<float>(i));
  grid.insert(points, Eigen::Vector3d(0, 0, 0.5));
  const auto bytes = grid.serialise();
  std::vector<std::uint8_t> plain(bytes.size());
  std::transform(bytes.begin(), bytes.end(), plain.begin(),
                 [](std::byte b) { return static_cast<std::uint8_t>(b); });
  seeds.add("mvog", std::move(plain));
}

void add_cameras(Collection& seeds) {
  RgbdCalibration calibration;
  calibration.depth_camera =
      PinholeCamera{24, 16, 20.1, 19.9, 11.7, 8.1, {-0.025, 0.0002, -0.0009, 0.0002, 0.003}};
  calibration.color_camera = PinholeCamera{24, 16, 18.1, 18.3, 12.2, 7.9, {0.04, -0.11, 0.002, 0.0007, 0}};
  calibration.T_color_depth = SE3(so3_exp(Vec3(0.01, -0.02, 0.005)), Vec3(-0.026, -0.00005, 0.0006));
  calibration.disparity = DisparityModel{3.1, -0.0029};
  must(write_calibration(seeds.folder / "c.toml", calibration));
  seeds.file("calibration", "c.toml");
  for (const DepthFitMode mode : {DepthFitMode::kSpline, DepthFitMode::kLinear}) {
    const bool spline = mode == DepthFitMode::kSpline;
    DepthCorrectionModel model;
    model.mode = mode;
    model.width = 8, model.height = 6;
    model.columns = spline ? 5 : 8, model.rows = spline ? 4 : 6, model.terms = 2;
    model.min_depth_m = 0.7, model.max_depth_m = 3.3;
    const auto plane = static_cast<std::size_t>(model.columns) * static_cast<std::size_t>(model.rows);
    model.coefficients.assign(2 * plane, 0.01F);
    if (!spline) model.lowest_s.assign(plane, -0.5F), model.highest_s.assign(plane, 0.75F);
    must(write_depth_correction(seeds.folder / "c.hmdc", model));
    seeds.file("depth_correction", "c.hmdc");
  }
  seeds.text(
      "camera",
      "# pinhole\nwidth 640\nheight 480\nfx = 525.0\nfy: 525\ncx 319.5 # middle\ncy 239.5\nk1 0.1\np2 -1e-3\n"
      "depth_scale 5000\nrate_hz 30\nlens wide\n");
  seeds.text("intrinsics", "5.85e+02 0 3.2e+02\n0 5.84e+02 2.4e+02 \n 0 0 1\n");
}

void add_poses(Collection& seeds) {
  seeds.text("picture_list",
             "# depth\n1305031102.160407 depth/1305031102.160407.png\n1305031102.19 depth/b.png\n");
  seeds.text("associations", "1.1 rgb/1.1.png 1.2 depth/1.2.png\n1.3 rgb/1.3.png 1.4 depth/1.4.png\n");
  seeds.text("associations", "1 depth/1.png 1 rgb/1.png\n2 depth/2.png 2 rgb/2.png\n");
  const std::string_view tum = "# t x y z qx qy qz qw\n1.5 1 2 3 0 0 0 1\n1.6 1 2 3 0.6 0 0.8 0\n";
  seeds.text("pose_list", tum);
  seeds.text("pose_list", "1.5 1 2 3 0 0 0 1\n1.6 nan nan nan 0 0 0 0\n1.7 1 2 3 0 0 0 1");
  seeds.text("trajectory", tum);
  seeds.text("trajectory", "1 0 0 0 0 1 0 0 0 0 1 0\n0 -1 0 5 1 0 0 6 0 0 1 7\n");
  seeds.text("trajectory",
             "#timestamp,x,y,z,w,x,y,z\n1403715523912140000,1,2,3,1,0,0,0,9\n1403715523912150000,1,2,3,0.6,0."
             "8,0,0,9\n");
  seeds.text("seven_scenes_pose", "1 0 0 0.5\n0 1 0 -1e-1\n0 0 1 2\n0 0 0 1\n");
  seeds.text("g2o_2d",
             "VERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 1 0 0.1\nFIX 0\nEDGE_SE2 0 1 1 0 0.1 500 0 0 500 0 5000\n"
             "EDGE_SE2 1 2 1 0 0.1 500 0 0 500 0 5000\n");
  seeds.text(
      "g2o_3d",
      "VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\nVERTEX_SE3:QUAT 1 1 0 0 0 0 0 1\nEDGE_SE3:QUAT 0 1 1 0 0 0 0 0 1 "
      "1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 1 0 0 1 0 1\n");
  seeds.text("relations", "# t1 t2 x y z roll pitch yaw\n1.5 2.5 1 2 0 0 0 0.1\n2.5 3.5 1 2 0 0 0 -3.1");
  seeds.text("accelerometer", "# t ax ay az\n1.5 0.1 -9.8 0.2\n1.6 0.1 -9.8 0.2\n1.7 0.2 -9.7 0.2\n");
  seeds.text("imu_csv",
             "#timestamp [ns],w,a\n1403715523912140000,1,2,3,4,5,6\n1403715523912150000,1,2,3,4,5,6.5\n");
  seeds.text("imu_toml", "# how the device is turned\n[imu]\nrpy_deg = [180.0, 0, 1e1]\n");
}

void add_texts(Collection& seeds) {
  seeds.text(
      "json",
      R"({"a": [1, -2.5e3, true, null, "x\u00e4\n"], "b": {"c": {}, "d": []}, "a": 18446744073709551616})");
  MvogParams params;
  ParamList list;
  list.add("mvog", params);
  seeds.text("parameters", list.to_toml());
  LaserRig rig;
  rig.T_base_laser = SE3(so3_exp(Vec3(0, 0, 0.3)), Vec3(0.1, 0, 0.2));
  rig.horizontal = BeamRange{20, 100};
  rig.down = LaserRig::Mirror{{0, 20}, SE3(so3_exp(Vec3(0, 1.5, 0)), Vec3(0.1, 0, 0))};
  must(write_laser_rig(seeds.folder / "rig.toml", rig));
  seeds.file("rig", "rig.toml");
}

void add_lasers(Collection& seeds) {
  std::string carmen = "# CARMEN Logfile\nPARAM front_laser_max 50 1 h 2\n", graph, wean,
              moos = "%% LOG FILE: x\n";
  std::string breezy, euroc = "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1]\n";
  for (int i = 0; i < 3; ++i) {
    const auto robot =
        fmt::format("ROBOTLASER1 0 -1.5 3 0.5 25 0.01 0 6 {0}0 {1} 0 0 {1} 0 0 0 0 0 0 0 {1}.25 h 1\n",
                    numbers(6), i + 100);
    carmen += fmt::format(
        "FLASER 6 {0}{1} 0 0 {1} 0 0 {1}.800980 h 1\nODOM {1} 0 0 0 0 0 {1}.5 h 1\nRAWLASER2 0 -1.5 3 0.5 25 "
        "0.01 0 6 "
        "{0}0 {1}.25 h 1\nTRUEPOS 1 2 3 1 2 3 {1}.5 h 1\n",
        numbers(6), i + 100);
    carmen += robot;
    graph += fmt::format("VERTEX2 {} 1 2 3\n{}EDGE2 0 1 1 2 3 4 5 6 7 8 9\n", i + 100, robot);
    wean += fmt::format("L 1 2 3 2 2 3 {}{}.5\nO 4 5 6 {}.75\n", numbers(5), i, i);
    moos += fmt::format(
        "1.5 LMS_LASER_2D_LEFT LMS1 "
        "ID=1,time={0}.5,angRes=0.50,minAngle=45.0,Range=[4]{{1,2,-1,3}},R=[1]{{2}}\n"
        "1.5 ODOMETRY_POSE p Pose=[3x1]{{1,2,3}},time={0}.75,Pitch=0.1,Roll=0.2\n",
        i);
    breezy += fmt::format("{} 0 {} {}", 100000 * (i + 1), 30 * i, 29 * i);
    for (int k = 0; k < 21 + 682; ++k) breezy += fmt::format(" {}", k);
    breezy += "\n";
    euroc += fmt::format("140371552391214{}000,1,2,3,4,5,{}.5\n", i, i);
  }
  for (const auto& [reader, text] : {std::pair<std::string_view, std::string_view>{"carmen", carmen},
                                     {"laser_graph", graph},
                                     {"wean_hall", wean},
                                     {"moos", moos},
                                     {"breezy", breezy},
                                     {"euroc_imu", euroc}})
    seeds.text(reader, text);
  testing_bags::write_small_bag(seeds.folder / "a.bag", 2);
  // A bag's header record is filled up with blanks to 4 kB, which are of no use here.
  std::string bag = test::read_bytes(seeds.folder / "a.bag");
  const std::string blanks =
      bag.substr(bag.find("    "), bag.find_first_not_of(' ', bag.find("    ")) - bag.find("    "));
  const std::size_t at = bag.find(blanks);
  bag.replace(at - 4, 4 + blanks.size(), std::string(4, '\0'));
  seeds.text("rosbag", testing_bags::with_index_position(bag));
  testing_bags::write_bag_with_transforms(seeds.folder / "tf.bag", 2);
  seeds.text("rosbag", test::read_bytes(seeds.folder / "tf.bag"));
  for (const std::string how : {"bz2", "lz4"}) seeds.text("rosbag", testing_bags::with_compression(bag, how));
}

void add_foreign_cameras(Collection& seeds) {
  seeds.text("foreign_camera",
             R"({"width": 640, "height": 480, "intrinsic_matrix": [525, 0, 0, 0, 525, 0, 319.5, 239.5, 1],)"
             R"( "depth_scale": 1000})");
  seeds.text(
      "foreign_camera",
      R"({"camera": {"w": 1200, "h": 680, "fx": 600, "fy": 600, "cx": 599.5, "cy": 339.5, "scale": 6553.5}})");
  seeds.text("foreign_camera",
             "m_depthWidth = 640\nm_depthHeight = 480\nm_depthShift = 1000\n"
             "m_calibrationDepthIntrinsic = 582.9 0 320 0 0 583.7 240 0 0 0 1 0 0 0 0 1\n");
  seeds.text("foreign_camera", "571.6 0 319.5 0\n0 571.6 239.5 0\n0 0 1 0\n0 0 0 1\n");
  seeds.text("pose_matrix", "1 0 0 0.5\n0 0 -1 2.5e-1\n0 1 0 -3\n0 0 0 1\n");
}

void add_journal(Collection& seeds) {
  auto journal = SlamJournal::create(seeds.folder / "slam_journal.bin").value();
  for (std::size_t i = 0; i < 3; ++i) {
    TrackedRecord record;
    record.index = i;
    record.was_read = i != 1;
    record.stamp = Time::from_seconds(1 + 0.1 * static_cast<double>(i));
    record.status = i == 1 ? TrackingStatus::kSkipped : TrackingStatus::kTracked;
    if (i == 1) record.reason = "why";
    if (record.was_read) record.T_odom_camera = SE3(so3_exp(Vec3(0, 0.1, 0)), Vec3(1, 2, 3));
    if (i == 2) {
      auto keyframe = std::make_shared<Keyframe>();
      keyframe->frame_index = i;
      keyframe->stamp = record.stamp;
      keyframe->features = {Feature{}, Feature{}};
      keyframe->observations = {{7, {1, 2}, Eigen::Matrix2d::Identity(), 1.25, 1e-4}};
      keyframe->before = RefinedObservations{0, keyframe->observations};
      record.keyframe = keyframe;
    }
    journal.add(record);
  }
  must(journal.flush());
  seeds.file("slam_journal", "slam_journal.bin");
}

void add_saved_runs(Collection& seeds) {
  ReconstructionState state;
  state.recording = "room";
  state.next_frame = 3;
  state.skipped = {{1, "no pose"}};
  state.trajectory = {{Time::from_seconds(1), SE3(so3_exp(Vec3(0, 0.1, 0)), Vec3(1, 2, 3))}};
  state.interior_marks = {{1, -2, 3}};
  seeds.text("reconstruction_state", state_to_json(state));
  SlamCheckpoint checkpoint;
  checkpoint.program_version = "1.2";
  checkpoint.camera = {320, 240, 262.5, 262.25, 159.5, 119.5, {}};
  checkpoint.parameters_toml = "[slam]\n";
  checkpoint.places = {{0, 0, SE3()}, {8, 1, SE3(so3_exp(Vec3(0, 0, 1)), Vec3(1, 2, 3))}};
  checkpoint.odometry = {1, 2, 3};
  checkpoint.sessions = {MapSession::of("/room", {}, 20)};
  seeds.add("slam_checkpoint", to_file_bytes(checkpoint));
  add_journal(seeds);
}

}  // namespace

std::vector<Seed> seeds() {
  Collection collection;
  add_images(collection);
  add_meshes(collection);
  add_maps(collection);
  add_link(collection);
  add_flight(collection);
  add_mvog(collection);
  add_cameras(collection);
  add_poses(collection);
  add_texts(collection);
  add_lasers(collection);
  add_foreign_cameras(collection);
  add_saved_runs(collection);
  return std::move(collection.all);
}

}  // namespace hm::fuzz
