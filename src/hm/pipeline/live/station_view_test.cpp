#include "hm/pipeline/live/station_view.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <variant>

#include "hm/core/process_memory.hpp"
#include "hm/core/testing/sanitized.hpp"
#include "hm/io/bytes/json.hpp"
#include "hm/io/image/image_file.hpp"
#include "hm/io/testing/temporary_folder_test_support.hpp"
#include "hm/mapping/dense_pipeline.hpp"
#include "hm/mesh/pages/mesh_page.hpp"
#include "hm/pipeline/live/live_station.hpp"
#include "hm/pipeline/verdict/run_verdict.hpp"
#include "hm/station/live_frames.hpp"

namespace hm {
namespace {

const PinholeCamera kCamera{96, 72, 80, 80, 47.5, 35.5, {}};

/// View of a wall 2 m in front of a camera that has moved aside by `aside_m`.
RgbdFrame view_of_wall(double aside_m, double stamp_s, std::uint8_t brightness = 200) {
  RgbdFrame frame;
  frame.stamp = Time::from_seconds(stamp_s);
  frame.depth = {Image<std::uint16_t>(kCamera.width, kCamera.height, 2000), 1e-3};
  frame.color = Image<Rgb8>(kCamera.width, kCamera.height, {brightness, brightness, brightness});
  frame.T_world_camera = SE3(Mat3::Identity(), Vec3(aside_m, 0, 0));
  return frame;
}

LiveCamera seen(const RgbdFrame& frame) {
  LiveCamera camera;
  camera.stamp = frame.stamp;
  camera.frame = &frame;
  camera.camera = kCamera;
  camera.T_map_camera = frame.T_world_camera;
  return camera;
}

ScanMoment moment_of(const RgbdFrame& frame) {
  return {frame.stamp, frame.T_world_camera, "", true, look_at(frame.depth, frame.color)};
}

DenseParams coarse() {
  DenseParams params;
  params.tsdf.voxel_size_m = 0.05;
  return params;
}

/// What a viewer who comes now sees.
struct Seen {
  std::map<PageKey, TriangleMesh> pages;
  std::map<LiveKind, std::vector<LiveFrame>> frames;

  explicit Seen(const LiveStore& store) {
    std::vector<LiveChange> changes;
    store.changes_after(0, changes);
    for (const LiveChange& change : changes) {
      const auto item = store.read(change.slot);
      if (!item || item->gone) continue;
      const auto decode = [&](const Payload& payload) {
        return decode_live_payload(change.slot.kind, *payload).value();
      };
      if (change.slot.kind != LiveKind::kMeshPage) {
        frames[change.slot.kind].push_back(decode(item->payload));
        continue;
      }
      const auto page = std::get<MeshPageFrame>(decode(item->page.levels[0]));
      pages[change.slot.page] = decode_page({page.vertices, page.indices, page.has_colors, page.origin_m,
                                             page.quantum_m, page.vertex_bytes, page.index_bytes})
                                    .value();
    }
  }
  [[nodiscard]] std::size_t triangles() const {
    std::size_t count = 0;
    for (const auto& [key, mesh] : pages) count += mesh.triangles.size();
    return count;
  }
  [[nodiscard]] JsonValue json(LiveKind kind) const {
    return parse_json(std::get<JsonFrame>(frames.at(kind).front()).text, "frame").value();
  }
};

TEST(StationView, ShowsTheWholeMeshInTheEnd) {
  LiveStore store;
  StationView view(store);
  DensePipeline pipeline(coarse(), kCamera, 1);
  pipeline.observe_mesh(&view);
  for (int i = 0; i < 8; ++i) {
    const RgbdFrame frame = view_of_wall(0.1 * i, 1 + 0.1 * i);
    ASSERT_TRUE(pipeline.process(frame).integrated);
    view.on_camera(seen(frame));
  }
  const TriangleMesh mesh = pipeline.finished_mesh();
  view.flush();
  const Seen now(store);
  EXPECT_GT(now.pages.size(), 1u);
  EXPECT_EQ(now.triangles(), pipeline.mesher().triangle_count());
  EXPECT_EQ(view.pages().whole_mesh().triangles.size(), pipeline.mesher().triangle_count());
  EXPECT_NEAR(view.pages().area_m2(), surface_area(pipeline.mesher().whole_mesh()), 1e-3);
  // A camera before a wall 1.6 m away sees a part of what is around it.
  const double share = now.json(LiveKind::kTelemetry).find("coverage")->number_at("share", -1);
  EXPECT_GT(share, 0.02);
  EXPECT_LT(share, 0.3);
  const auto path = std::get<PathFrame>(now.frames.at(LiveKind::kPath).front());
  EXPECT_EQ(path.points_m.size(), 8u);
  EXPECT_EQ(path.total, 8u);
  EXPECT_NEAR(std::get<PoseFrame>(now.frames.at(LiveKind::kPose).front()).half_width_rad, 0.54, 0.01);
}

TEST(StationView, ForgetsEverythingWhenARunBeginsAnew) {
  LiveStore store;
  StationView view(store);
  {
    DensePipeline pipeline(coarse(), kCamera, 1);
    pipeline.observe_mesh(&view);
    for (int i = 0; i < 4; ++i) {
      const RgbdFrame frame = view_of_wall(3.0 * i, 1 + 0.1 * i);
      pipeline.process(frame);
      view.on_camera(seen(frame));
    }
    pipeline.finished_mesh();
  }
  view.flush();
  const std::size_t before = Seen(store).pages.size();
  view.on_restart();
  DensePipeline again(coarse(), kCamera, 1);
  again.observe_mesh(&view);
  const RgbdFrame frame = view_of_wall(9, 5);  // the first pages of before are empty
  again.process(frame);
  view.on_camera(seen(frame));
  again.finished_mesh();
  view.flush();
  const Seen now(store);
  EXPECT_LT(now.pages.size(), before);
  EXPECT_EQ(now.triangles(), again.mesher().triangle_count());
  EXPECT_EQ(std::get<PathFrame>(now.frames.at(LiveKind::kPath).front()).total, 1u);
  const TriangleMesh offered = view.pages().whole_mesh(), there = again.mesher().whole_mesh();
  EXPECT_EQ(offered.triangles.size(), there.triangles.size());
  EXPECT_EQ(offered.vertices.size(), there.vertices.size());  // welded by the size of its voxels
}

TEST(StationView, LosesNothingOfFramesThatComeFasterThanTheyAreLookedAt) {
  LiveStore store;
  StationView view(store);
  constexpr int kFrames = 3000;
  RgbdFrame frame = view_of_wall(0, 1);
  for (int i = 0; i < kFrames; ++i) {
    frame.stamp = Time::from_seconds(1 + 0.001 * i);
    frame.T_world_camera = SE3(Mat3::Identity(), Vec3(0.03 * i, 0, 0));
    view.on_camera(seen(frame));
    view.on_numbers({"testing", static_cast<std::size_t>(i + 1), kFrames, {{"stage", 2.5}}, {}, {}});
  }
  view.flush();
  const Seen now(store);
  EXPECT_EQ(std::get<PathFrame>(now.frames.at(LiveKind::kPath).front()).total,
            static_cast<std::uint32_t>(kFrames));
  EXPECT_EQ(now.json(LiveKind::kTelemetry).find("progress")->number_at("done", 0), kFrames);
  EXPECT_EQ(now.json(LiveKind::kStatistics).find("stages")->number_at("stage", 0), 2.5);
}

TEST(StationView, KeepsNoMemoryOfManyVolumesThatCameAtOnce) {
  if (test::kSanitized || heap_bytes() == 0)
    GTEST_SKIP() << "another allocator, or a C library that does not tell";
  LiveStore store;
  StationView view(store);
  DensePipeline pipeline(coarse(), kCamera, 1);
  pipeline.process(view_of_wall(0, 1));
  const std::vector<VolumeKey> keys(20'000, pipeline.mesher().volumes().front()->key());
  view.on_mesh(pipeline.mesher(), std::span(keys).first(100));
  view.flush();
  const std::size_t before = heap_bytes();
  for (int time = 0; time < 4; ++time) {  // through both buffers
    view.on_mesh(pipeline.mesher(), keys);
    view.flush();
  }
  EXPECT_LT(heap_bytes(), before + 300'000);
}

TEST(StationView, ACorrectedPathReplacesALongerOne) {
  LiveStore store;
  StationView view(store);
  view.on_path(LivePath::kTrajectory, std::vector<Vec3>(1300, Vec3(1, 2, 3)));
  EXPECT_EQ(Seen(store).frames.at(LiveKind::kPath).size(), 3u);
  view.on_path(LivePath::kTrajectory, std::vector<Vec3>(20, Vec3(4, 5, 6)));
  const Seen now(store);
  ASSERT_EQ(now.frames.at(LiveKind::kPath).size(), 1u);
  const auto path = std::get<PathFrame>(now.frames.at(LiveKind::kPath).front());
  EXPECT_EQ(path.total, 20u);
  EXPECT_EQ(path.points_m.back(), Eigen::Vector3f(4, 5, 6));
}

TEST(StationView, TellsStateVerdictAndWhenTrackingIsLost) {
  LiveStore store;
  StationView view(store);
  const RgbdFrame frame = view_of_wall(0, 1);
  LiveCamera camera = seen(frame);
  view.on_camera(camera);
  camera.T_map_camera.reset();
  camera.trouble = "9 inliers, 20 are needed";
  view.on_camera(camera);
  RunVerdict verdict;
  verdict.add(MapVerdict::kDoubtful, "2 of 3 frames have no pose");
  view.on_end(verdict);
  view.set_state("finished");
  const Seen now(store);
  const JsonValue told = now.json(LiveKind::kTelemetry);
  EXPECT_EQ(*told.find("state")->as_string(), "finished");
  EXPECT_EQ(*told.find("verdict")->find("verdict")->as_string(), "doubtful");
  std::string events;
  for (const LiveFrame& event : now.frames.at(LiveKind::kEvent)) events += std::get<JsonFrame>(event).text;
  EXPECT_THAT(events, testing::HasSubstr("lost: 9 inliers, 20 are needed"));
}

TEST(StationView, TellsWhyARunFailed) {
  LiveStore store;
  StationView view(store);
  view.set_state("failed", "the camera was unplugged after 4.0 s");
  const Seen now(store);
  EXPECT_EQ(*now.json(LiveKind::kTelemetry).find("state")->as_string(), "failed");
  EXPECT_EQ(now.json(LiveKind::kTelemetry).text_at("reason"), "the camera was unplugged after 4.0 s");
  const JsonValue event = now.json(LiveKind::kEvent);
  EXPECT_EQ(event.text_at("level"), "error");
  EXPECT_EQ(event.text_at("text"), "failed: the camera was unplugged after 4.0 s");
}

TEST(StationView, SendsTheParametersOnceBesideTheNumbers) {
  LiveStore store;
  StationView view(store);
  view.on_parameters("[tsdf]\nvoxel_size_m = 0.02\n");
  view.on_numbers({"testing", 3, 3, {{"stage", 2.5}}, {}, {}});
  view.flush();
  const auto parts = store.items(LiveKind::kStatistics);
  ASSERT_EQ(parts.size(), 2u);
  EXPECT_THAT(std::string(bytes_text(*parts[0].payload)), testing::Not(testing::HasSubstr("parameters")));
  EXPECT_EQ(bytes_text(*parts[1].payload), R"({"parameters":"[tsdf]\nvoxel_size_m = 0.02\n"})");
}

TEST(ScanAdviser, SaysWhatIsWrongWithTheNumber) {
  ScanAdviser adviser;
  EXPECT_TRUE(adviser.advise(moment_of(view_of_wall(0, 1))).empty());
  RgbdFrame frame = view_of_wall(0.3, 1.1);
  std::vector<ScanAdvice> advice;
  for (int i = 2; i < 6; ++i) advice = adviser.advise(moment_of(view_of_wall(0.3 * i, 1 + 0.1 * i)));
  ASSERT_EQ(advice.size(), 1u);
  EXPECT_EQ(advice[0].text, "moving too fast");
  EXPECT_THAT(advice[0].number, testing::StartsWith("2.")) << "it moves at 3 m/s";
  frame = view_of_wall(0, 9, 10);
  frame.depth.units = Image<std::uint16_t>(kCamera.width, kCamera.height, 0);
  ScanMoment lost = moment_of(frame);
  lost.T_map_camera.reset();
  lost.trouble = "why";
  advice = adviser.advise(lost);
  ASSERT_EQ(advice.size(), 3u);
  EXPECT_EQ(advice[0].level, AdviceLevel::kBad);
  EXPECT_EQ(advice[1].text, "little depth");
  EXPECT_EQ(advice[2].text, "too dark");
  for (std::uint16_t& units : frame.depth.units.pixels()) units = 400;
  frame.color = {};
  advice = ScanAdviser().advise(moment_of(frame));
  ASSERT_EQ(advice.size(), 1u);
  EXPECT_THAT(advice[0].number, testing::StartsWith("0.40 m"));
}

TEST(PictureFeed, ShowsSmallPicturesOfColorAndDepth) {
  LiveStore store;
  PictureFeed feed(store);
  RgbdFrame frame = view_of_wall(0, 1);
  frame.color = Image<Rgb8>(640, 480, {250, 10, 10});
  frame.depth.units = Image<std::uint16_t>(640, 480, 0);
  for (int y = 0; y < 480; ++y)
    for (int x = 0; x < 320; ++x) frame.depth.units(x, y) = static_cast<std::uint16_t>(1000 + x);
  feed.give(feed.copy(frame));
  feed.wait();
  const Seen now(store);
  ASSERT_EQ(now.frames.at(LiveKind::kPicture).size(), 2u);
  const auto picture = std::get<PictureFrame>(now.frames.at(LiveKind::kPicture)[0]);
  std::vector<std::uint8_t> file(picture.file.size());
  std::memcpy(file.data(), picture.file.data(), file.size());
  const auto color = decode_color_image(file, "picture");
  ASSERT_TRUE(color);
  EXPECT_EQ(color->width(), 320);
  EXPECT_NEAR((*color)(160, 120).r, 250, 6);
  const Image<Rgb8> depth = false_colors(frame.depth.units);
  EXPECT_EQ(depth(600, 100), (Rgb8{0, 0, 0}));
  EXPECT_GT(depth(10, 100).g, depth(300, 100).g) << "near is light";
}

/// State of the grid as the tiles show it at a point of `map`.
std::uint8_t tile_cell(const Seen& now, const Vec2& p_map) {
  for (const LiveFrame& frame : now.frames.at(LiveKind::kGridTile)) {
    const auto& tile = std::get<GridTileFrame>(frame);
    const auto cell_m = static_cast<double>(tile.cell_m);
    const Vec2 in_tile = p_map / cell_m - Vec2(tile.x, tile.y) * tile.side;
    if (in_tile.minCoeff() < 0 || in_tile.maxCoeff() >= tile.side) continue;
    return tile
        .cells[static_cast<std::size_t>(in_tile.y()) * tile.side + static_cast<std::size_t>(in_tile.x())];
  }
  return 0;
}

TEST(GridFeed, ShowsTheSliceAndFollowsACorrection) {
  LiveStore store;
  GridFeed feed(store);
  MultiVolumeGrid grid;
  for (int i = 0; i < 3; ++i)
    grid.insert(std::vector{Eigen::Vector3f(3, 0.02F, 1)}, Eigen::Vector3d(0, 0.02 + 0.001 * i, 1));
  const auto show = [&](const SE2& T_map_grid) {
    feed.give(grid, T_map_grid, {0.5, 1.5}, Time{});
    feed.wait();
    return Seen(store);
  };
  const Seen first = show({});
  EXPECT_GT(tile_cell(first, {3, 0.02}), 128);
  EXPECT_EQ(tile_cell(first, {1.5, 0.02}), 1);
  EXPECT_EQ(tile_cell(first, {1.5, 1}), 0);
  const SE2 turned(Vec2(0.5, -7), 0.5 * 3.14159265358979);
  const Seen second = show(turned);
  EXPECT_GT(tile_cell(second, turned * Vec2(3.02, 0.02)), 128);
  EXPECT_EQ(tile_cell(second, turned * Vec2(1.52, 0.02)), 1);
  EXPECT_EQ(tile_cell(second, {1.5, 0.02}), 0) << "it is not where it was";
  // Nothing new: no new version.
  std::vector<LiveChange> changes;
  const std::uint64_t before = store.changes_after(0, changes);
  feed.give(grid, turned, {0.5, 1.5}, Time{});
  feed.wait();
  changes.clear();
  EXPECT_EQ(store.changes_after(before, changes), before);
}

TEST(LiveStation, UnderstandsAddressesAndRefusesOthers) {
  const auto open = [](const std::string& listen) {
    return LiveStation::open({.verb = "test", .name = "test", .listen = listen});
  };
  for (const char* wrong : {"localhost:http", ":80", "1.2.3.4:99999", "70000", "127.0.0.1:"}) {
    const auto refused = open(wrong);
    ASSERT_FALSE(refused) << wrong;
    EXPECT_EQ(refused.error().code, ErrorCode::kUsage);
  }
  const auto station = open("127.0.0.1");
  ASSERT_TRUE(station);
  EXPECT_THAT((*station)->announcement(), testing::HasSubstr("live view: http://127.0.0.1:"));
  const auto open_to_all = open("0.0.0.0");
  ASSERT_TRUE(open_to_all);
  EXPECT_THAT((*open_to_all)->announcement(),
              testing::AllOf(testing::HasSubstr("\u2588\u2588"), testing::HasSubstr("?token=")));
}

TEST(LiveStation, SaysWhenThePageWasNotBuilt) {
  EXPECT_EQ(live_announcement("http://127.0.0.1:1/", false, true), "live view: http://127.0.0.1:1/");
  const std::string without = live_announcement("http://127.0.0.1:1/", false, false);
  EXPECT_THAT(without, testing::StartsWith("the page was not built: install nodejs and npm"));
  EXPECT_THAT(without, testing::EndsWith("live view: http://127.0.0.1:1/"));
}

TEST(LiveStation, OffersTheReportOfARunWhenItIsWritten) {
  const TemporaryFolder folder;
  const auto report = folder.path() / "report.html";
  std::ofstream(report) << "of an earlier run";
  std::filesystem::last_write_time(report,
                                   std::filesystem::file_time_type::clock::now() - std::chrono::hours(1));
  const auto live =
      LiveStation::open({.verb = "test", .name = "test", .listen = "0", .report_to_come = report});
  ASSERT_TRUE(live);
  ASSERT_FALSE((*live)->report_of_run());
  EXPECT_EQ((*live)->report_of_run().error().code, ErrorCode::kNotFound);
  EXPECT_EQ((*live)->report_of_run().error().message, "the run has written no report yet");
  (*live)->offer_report();
  EXPECT_FALSE((*live)->report_of_run()) << "that of an earlier run";
  std::ofstream(report) << "<html>of this run";
  EXPECT_FALSE((*live)->report_of_run());
  (*live)->offer_report();
  ASSERT_TRUE((*live)->report_of_run());
  EXPECT_EQ(bytes_text(*(*live)->report_of_run()), "<html>of this run");
}

}  // namespace
}  // namespace hm
