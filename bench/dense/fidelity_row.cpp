// Row fidelity: meshes projected back into the depth images that they were made from.
#include <optional>

#include "dense/peer.hpp"
#include "hm/evaluation/depth_agreement.hpp"
#include "hm/mesh/whole_mesh.hpp"
#include "measurement.hpp"

namespace hm::bench {
namespace {

constexpr double kVoxel_m = 0.02, kBand_m = 0.08, kFar_m = 4.0;
constexpr std::size_t kEvery = 15;

struct Judged {
  std::string name;
  DepthCaster caster;
  DepthAgreement agreement{0.1, kFar_m};
};

Result<void> judge(FrameSource& source, std::span<Judged> meshes, const ParallelLoop& loop) {
  const PinholeCamera camera = source.camera();
  while (true) {
    const auto chunk = source.next_chunk();
    if (!chunk) return forward_error(chunk);
    if (chunk->empty()) return {};
    for (const RgbdFrame& frame : *chunk) {
      Image<float> measured_m(camera.width, camera.height);
      for (int y = 0; y < camera.height; ++y)
        for (int x = 0; x < camera.width; ++x)
          measured_m(x, y) = static_cast<float>(frame.depth.depth_m(x, y));
      for (Judged& mesh : meshes)
        mesh.agreement.add(measured_m.pixels(),
                           mesh.caster.render(camera, *frame.T_world_camera, loop).pixels());
    }
  }
}

Result<void> add(std::vector<Judged>& meshes, const std::string& name, const TriangleMesh& mesh) {
  auto caster = DepthCaster::build(mesh);
  if (!caster) return forward_error(caster);
  meshes.push_back({name, std::move(*caster)});
  return {};
}

/// Ours as the product makes it, ours with the peer's fixed band, and the peer's, from one pass over the
/// frames.
Result<std::vector<Judged>> make_meshes(FrameSource& source, int threads) {
  const PinholeCamera camera = source.camera();
  TsdfParams defaults;
  defaults.voxel_size_m = kVoxel_m;
  OurContender us(defaults, camera, threads), us_fixed(common_params(kVoxel_m, kBand_m), camera, threads);
  const auto scalable = make_peer({PeerGrid::kScalable, kVoxel_m, kBand_m, kFar_m, false}, camera);
  const auto blocks = make_peer({PeerGrid::kVoxelBlock, kVoxel_m, kBand_m, kFar_m, false}, camera);
  std::vector<Contender*> contenders{&us, &us_fixed};
  if (has_peer()) contenders.insert(contenders.end(), {scalable.get(), blocks.get()});
  while (true) {
    const auto chunk = source.next_chunk();
    if (!chunk) return forward_error(chunk);
    if (chunk->empty()) break;
    for (Contender* contender : contenders) {
      contender->prepare(*chunk);
      for (std::size_t i = 0; i < chunk->size(); ++i) contender->integrate(i);
    }
  }
  std::vector<Judged> meshes;
  auto added = add(meshes, "ours", extract_mesh(us.grid(), MeshParams{}, us.loop()));
  if (added) added = add(meshes, "ours_fixed", extract_mesh(us_fixed.grid(), MeshParams{}, us.loop()));
  double ms = 0;
  if (added && has_peer()) added = add(meshes, "scalable", scalable->extract(ms));
  if (added && has_peer()) added = add(meshes, "voxelblock", blocks->extract(ms));
  if (!added) return forward_error(added);
  return meshes;
}

}  // namespace

Result<BenchResult> bench_fidelity(const BenchOptions& options) {
  const auto limit = static_cast<std::size_t>(options.frame_limit);
  auto source = open_frames("sevenscenes_a", {limit, 1, 40});
  if (!source) return forward_error(source);
  auto meshes = make_meshes(**source, options.threads);
  if (!meshes) return forward_error(meshes);
  auto again = open_frames("sevenscenes_a", {limit / kEvery, kEvery, 10});
  if (!again) return forward_error(again);
  const ParallelLoop loop(options.threads);
  if (const auto done = judge(**again, *meshes, loop); !done) return forward_error(done);
  BenchResult result;
  for (const Judged& mesh : *meshes) {
    const auto total = mesh.agreement.total();
    result.details[mesh.name] =
        JsonValue::object({{"median_mm", total.median_mm},
                           {"mean_mm", total.mean_mm},
                           {"covered_percent", mesh.agreement.covered_ratio() * 100}});
  }
  const auto row = [&](const std::string& name, const std::function<double(const DepthAgreement&)>& value) {
    Measurement measured{name, value((*meshes)[0].agreement), {}};
    if (has_peer()) measured.peer = value((*meshes)[2].agreement);
    result.rows.push_back(measured);
  };
  row("fidelity", [](const DepthAgreement& a) { return a.total().mean_mm; });
  row("fidelity_median", [](const DepthAgreement& a) { return a.total().median_mm; });
  row("fidelity_covered", [](const DepthAgreement& a) { return a.covered_ratio() * 100; });
  return result;
}

}  // namespace hm::bench
