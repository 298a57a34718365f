#include "hm/pipeline/common/box_json.hpp"
#include "hm/pipeline/common/mesh_evaluation.hpp"
#include "hm/pipeline/common/scene_level.hpp"
#include "hm/pipeline/dense/alignment_summary.hpp"
#include "hm/pipeline/dense/reconstruction.hpp"
#include "hm/report/run_report.hpp"

namespace hm {

void visit(const SkippedFrame& frame, SummaryTree& v) {
  v({"index", "frame", "{:d}"}, frame.index);
  v({"reason", "reason"}, frame.reason);
}

void visit(const ReconstructionSummary& summary, SummaryTree& v) {
  v.group("verdict", summary.verdict);
  v.object("frames", [&](SummaryTree& frames) {
    frames({"total"}, summary.frames_total);
    frames({"read"}, summary.frames_read);
    frames({"integrated"}, summary.frames_integrated);
    frames({"skipped"}, summary.skipped.size());
  });
  v.list("skipped_frames", summary.skipped);
  v({"interrupted"}, summary.interrupted);
  if (summary.resumed) v({"resumed_at_frame", {}, "{:d}"}, summary.resumed_at_frame);
  v({"threads"}, summary.threads);
  v({"run_s", "time", "{:.1f} s"}, summary.run_s);
  v({"frames_per_s", "rate", "{:.1f} frames per second"}, summary.frames_per_s);
  v.spread({"integrate_ms", "integration", "{:.2f} ms"}, summary.integrate_ms);
  v.spread({"mesh_ms", "meshing", "{:.2f} ms"}, summary.mesh_ms);
  v({"volumes", "blocks"}, summary.volumes);
  v({"volumes_refused"}, summary.volumes_refused);
  v({"map_bytes", "map", "{:.1f} MB", 1e-6}, summary.map_bytes);
  v({"map_file_bytes", "map on disk", "{:.1f} MB", 1e-6}, summary.map_file_bytes);
  v({"voxel_size_m", "voxels", "{:g} mm", 1e3}, summary.parameters.tsdf.voxel_size_m);
  v({"vertices", "vertices"}, summary.vertices);
  v({"triangles", "triangles"}, summary.triangles);
  if (const double size_m = summary.parameters.mesh.min_piece_size_m; size_m > 0)
    v({"min_piece_size_m", "smaller pieces are left out", "{:g} cm", 1e2}, size_m);
  add_box(v, "bounds_m", summary.bounds_m);
  v.object("up", [&](SummaryTree& up) {
    visit(summary.up, up);
    up({"levelled"}, summary.levelled);
    up.shown("text", {}, to_string(summary.up));
  });
  v.group("alignment", summary.alignment);
  v({"path_length_m", "path", "{:.2f} m"}, path_length(summary.trajectory));
  if (!summary.error) return;
  add_surface_error(v, "surface_error_mm", summary.error->accuracy, {"mean", "median", "p95"});
  v({"completeness_ratio", "surface that is there", "{:.2f} %", 100}, summary.error->completeness.ratio);
}

std::string to_text(const ReconstructionSummary& summary) {
  const SummaryTree tree = describe(summary);
  std::string text;
  if (summary.frames_this_run > 0)
    text += tree.lines(
        {"{frames.integrated} of {frames.total|frame} integrated, {frames.skipped} skipped; {frames_per_s}",
         "integration  median {integrate_ms.median}, 99 % under {integrate_ms.p99} a frame; meshing median "
         "{mesh_ms.median}"});
  else  // resumed when all frames were in the map
    text +=
        tree.lines({"{frames.integrated} of {frames.total|frame} integrated by earlier runs, "
                    "{frames.skipped} skipped"});
  return text +
         tree.lines(
             {"verdict      {verdict.text}",
              "map          {volumes|block} of 8 x 8 x 8 voxels of {voxel_size_m}, {map_bytes}",
              "mesh         {vertices|vertex|vertices}, {triangles|triangle}; pieces under "
              "{min_piece_size_m} are left "
              "out",
              "alignment    {alignment.accepted|frame} aligned, {alignment.not_accepted} not; median "
              "{alignment.align_ms.median}, 99 % under {alignment.align_ms.p99}",
              "             trajectory error {alignment.ate_given_m} as given, {alignment.ate_aligned_m} "
              "aligned",
              "size         {bounds_m}; up: {up.text}",
              "against the truth: mean {surface_error_mm.mean}, 95 % under {surface_error_mm.p95}, bias "
              "{surface_error_mm.bias}; {completeness_ratio} complete"}) +
         output_lines(summary.outputs);
}

}  // namespace hm
