#include "hm/pipeline/dense/alignment_summary.hpp"
#include "hm/pipeline/common/box_json.hpp"
#include "hm/pipeline/dense/reconstruction.hpp"

namespace hm {
namespace {

JsonValue times_to_json(const Summary& times) {
  return JsonValue::object(
      {{"median", times.median}, {"p99", times.p99}, {"mean", times.mean}, {"max", times.max}});
}

JsonValue skipped_to_json(const std::vector<SkippedFrame>& skipped) {
  auto list = JsonValue::array();
  for (const SkippedFrame& frame : skipped)
    list.push_back(JsonValue::object({{"index", frame.index}, {"reason", frame.reason}}));
  return list;
}

}  // namespace

JsonValue to_json(const ReconstructionSummary& summary) {
  auto json = JsonValue::object();
  json["frames"] = JsonValue::object({{"total", summary.frames_total},
                                      {"read", summary.frames_read},
                                      {"integrated", summary.frames_integrated},
                                      {"skipped", summary.skipped.size()}});
  json["skipped_frames"] = skipped_to_json(summary.skipped);
  json["interrupted"] = summary.interrupted;
  if (summary.resumed) json["resumed_at_frame"] = summary.resumed_at_frame;
  json["threads"] = summary.threads;
  json["run_s"] = summary.run_s;
  json["frames_per_s"] = summary.frames_per_s;
  json["integrate_ms"] = times_to_json(summary.integrate_ms);
  json["mesh_ms"] = times_to_json(summary.mesh_ms);
  json["volumes"] = summary.volumes;
  json["volumes_refused"] = summary.volumes_refused;
  json["map_bytes"] = summary.map_bytes;
  json["map_file_bytes"] = summary.map_file_bytes;
  json["voxel_size_m"] = summary.parameters.tsdf.voxel_size_m;
  json["vertices"] = summary.vertices;
  json["triangles"] = summary.triangles;
  json["bounds_m"] = to_json(summary.bounds_m);
  if (summary.alignment) json["alignment"] = to_json(*summary.alignment);
  json["path_length_m"] = path_length(summary.trajectory);
  if (summary.error) {
    const MeshAccuracy& accuracy = summary.error->accuracy;
    json["surface_error_mm"] = JsonValue::object({{"mean", accuracy.distance_m.mean * 1e3},
                                                  {"median", accuracy.distance_m.median * 1e3},
                                                  {"p95", accuracy.distance_m.p95 * 1e3},
                                                  {"bias", accuracy.bias_m * 1e3}});
    json["completeness_ratio"] = summary.error->completeness.ratio;
  }
  return json;
}

std::string to_text(const ReconstructionSummary& summary) {
  std::string text = fmt::format(
      "{} of {} frames integrated, {} skipped; {:.1f} frames/s\n"
      "integration  median {:.2f} ms, 99 % under {:.2f} ms a frame; meshing median {:.2f} ms\n"
      "map          {} volumes of {:g} mm voxels, {:.1f} MB\n"
      "mesh         {} vertices, {} triangles\n",
      summary.frames_integrated, summary.frames_total, summary.skipped.size(), summary.frames_per_s,
      summary.integrate_ms.median, summary.integrate_ms.p99, summary.mesh_ms.median, summary.volumes,
      summary.parameters.tsdf.voxel_size_m * 1e3, static_cast<double>(summary.map_bytes) * 1e-6,
      summary.vertices, summary.triangles);
  if (summary.alignment) text += to_text(*summary.alignment);
  if (!summary.bounds_m.isEmpty()) {
    const Vec3 size = summary.bounds_m.sizes();
    text += fmt::format("size         {:.2f} x {:.2f} x {:.2f} m\n", size.x(), size.y(), size.z());
  }
  if (summary.error) {
    const MeshAccuracy& accuracy = summary.error->accuracy;
    text += fmt::format(
        "against the truth: mean {:.2f} mm, 95 % under {:.2f} mm, bias {:+.2f} mm; {:.2f} % complete\n",
        accuracy.distance_m.mean * 1e3, accuracy.distance_m.p95 * 1e3, accuracy.bias_m * 1e3,
        summary.error->completeness.ratio * 100);
  }
  for (const auto& path : summary.outputs) text += fmt::format("  {}\n", path.string());
  return text;
}

}  // namespace hm
