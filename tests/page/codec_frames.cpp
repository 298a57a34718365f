// Writes frames of the live view for the page's reader: codec_frames FOLDER makes frames.bin (size, message,
// ...) and vertices.bin (x, y, z as float and red, green, blue, 0 a vertex of the mesh that the pages show).
// web/testing/check_codec.ts knows what has to come out.
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <utility>
#include <vector>

#include "hm/geometry/triangle_mesh.hpp"
#include "hm/mesh/pages/mesh_page.hpp"
#include "hm/pipeline/live/page_frame.hpp"
#include "hm/station/live_frames.hpp"

namespace {

constexpr double kVoxel_m = 0.02;
constexpr std::uint32_t kSide = 48;
constexpr hm::VolumeKey kKey{1, -2, 0};

/// Hills in the page at kKey, each vertex of another colour.
hm::TriangleMesh hills() {
  hm::TriangleMesh mesh;
  for (std::uint32_t y = 0; y < kSide; ++y) {
    for (std::uint32_t x = 0; x < kSide; ++x) {
      const float u = 0.64F + 0.0133F * static_cast<float>(x), v = -1.27F + 0.0129F * static_cast<float>(y);
      mesh.vertices.emplace_back(u, v, 0.3F + 0.1F * std::sin(9 * u) * std::cos(7 * v));
      mesh.colors.push_back({static_cast<std::uint8_t>(5 * x), static_cast<std::uint8_t>(5 * y), 77});
    }
  }
  for (std::uint32_t y = 0; y + 1 < kSide; ++y) {
    for (std::uint32_t x = 0; x + 1 < kSide; ++x) {
      const std::uint32_t a = y * kSide + x;
      mesh.triangles.push_back({a, a + 1, a + kSide + 1});
      mesh.triangles.push_back({a, a + kSide + 1, a + kSide});
    }
  }
  hm::compute_normals(mesh);
  return mesh;
}

class Writer {
 public:
  explicit Writer(const std::filesystem::path& path) : out_(path, std::ios::binary) {}

  void add(hm::LiveKind kind, const hm::LiveFrame& frame) {
    auto message = hm::live_header(kind, ++sequence_, hm::Time::from_seconds(1.5));
    const auto payload = hm::to_payload(frame);
    message.insert(message.end(), payload.begin(), payload.end());
    const auto size = static_cast<std::uint32_t>(message.size());
    out_.write(reinterpret_cast<const char*>(&size), sizeof size);
    out_.write(reinterpret_cast<const char*>(message.data()), static_cast<std::streamsize>(message.size()));
  }
  [[nodiscard]] bool good() const { return out_.good(); }

 private:
  std::ofstream out_;
  std::uint32_t sequence_ = 0;
};

void add_pages(Writer& writer, const hm::TriangleMesh& mesh) {
  auto levels = hm::encode_page(kKey, mesh, kVoxel_m);
  for (std::size_t level = 0; level < levels.size(); ++level) {
    auto frame = hm::page_frame(kKey, 9, level, std::move(levels[level]));
    frame.age_s = 2.5F;
    writer.add(hm::LiveKind::kMeshPage, frame);
  }
}

void add_others(Writer& writer) {
  writer.add(hm::LiveKind::kPageGone, hm::PageGoneFrame{.key = {-1, 2, -3}, .version = 10});
  hm::PoseFrame pose;
  pose.which = hm::PoseFrame::Which::kVehicle;
  pose.state = hm::PoseFrame::State::kLost;
  pose.deviation_m = 0.25F;
  pose.position_m = {1, -2, 3};
  pose.orientation = Eigen::Quaternionf(0.5F, -0.5F, 0.5F, -0.5F);
  pose.half_width_rad = 0.5F;
  pose.half_height_rad = 0.375F;
  writer.add(hm::LiveKind::kPose, pose);
  writer.add(hm::LiveKind::kPath, hm::PathFrame{.which = hm::PathFrame::Which::kWayPoints,
                                                .first = 2,
                                                .total = 5,
                                                .points_m = {{1, 2, 3}, {4, 5, 6}}});
  writer.add(hm::LiveKind::kScan,
             hm::ScanFrame{.which = hm::ScanFrame::Which::kObstacles, .points_m = {{7, 8, 9}}});
  writer.add(
      hm::LiveKind::kPlan,
      hm::PlanFrame{.state = hm::PlanFrame::State::kRefused, .reason = "wall, 2 m", .points_m = {{0, 0, 1}}});
  writer.add(hm::LiveKind::kGridTile, hm::GridTileFrame{.x = -1,
                                                        .y = 4,
                                                        .version = 3,
                                                        .cell_m = 0.5F,
                                                        .height_m = 1.25F,
                                                        .side = 2,
                                                        .cells = {0, 1, 128, 255}});
  writer.add(hm::LiveKind::kPicture, hm::PictureFrame{.which = hm::PictureFrame::Which::kDepth,
                                                      .format = hm::PictureFrame::Format::kPng,
                                                      .width = 320,
                                                      .height = 240,
                                                      .file = hm::text_bytes("file")});
  writer.add(hm::LiveKind::kTelemetry, hm::JsonFrame{R"({"state":"running"})"});
}

bool write_vertices(const std::filesystem::path& path, const hm::TriangleMesh& mesh) {
  std::ofstream out(path, std::ios::binary);
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    out.write(reinterpret_cast<const char*>(mesh.vertices[i].data()), 3 * sizeof(float));
    const auto& color = mesh.colors[i];
    const std::array<std::uint8_t, 4> bytes{color.r, color.g, color.b, 0};
    out.write(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  }
  return out.good();
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: codec_frames FOLDER\n");
    return 2;
  }
  const std::filesystem::path folder = argv[1];
  const auto mesh = hills();
  Writer writer(folder / "frames.bin");
  add_pages(writer, mesh);
  add_others(writer);
  return writer.good() && write_vertices(folder / "vertices.bin", mesh) ? 0 : 1;
}
