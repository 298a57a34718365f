#include "hm/pipeline/calibrate/calibration_extrinsics.hpp"

#include <algorithm>
#include <map>

#include "hm/core/angle.hpp"
#include "hm/core/text/counted.hpp"
#include "hm/io/image/image_file.hpp"
#include "hm/pipeline/calibrate/calibration_figures.hpp"
#include "hm/report/run_report.hpp"

namespace hm {
namespace {

namespace fs = std::filesystem;

/// Images of both folders that have a partner, in the same order.
struct PairedFiles {
  std::vector<fs::path> depth, color;
  std::size_t without_partner = 0;
};

Result<PairedFiles> pair_up(const ExtrinsicsOptions& options) {
  const auto depth = list_images(options.depth_images);
  if (!depth) return forward_error(depth);
  const auto color = list_images(options.color_images);
  if (!color) return forward_error(color);
  std::map<std::string, fs::path> by_stem;
  for (const fs::path& path : *color) by_stem[path.stem().string()] = path;
  PairedFiles pairs;
  for (const fs::path& path : *depth) {
    const auto partner = by_stem.find(path.stem().string());
    if (partner == by_stem.end()) continue;
    pairs.depth.push_back(path);
    pairs.color.push_back(partner->second);
  }
  if (pairs.depth.empty())
    return fail(ErrorCode::kNotFound, options.depth_images, "no image has a partner of the same name in {}",
                options.color_images.string());
  pairs.without_partner = depth->size() + color->size() - 2 * pairs.depth.size();
  return pairs;
}

std::vector<BoardPair> both_seen(ExtrinsicsSummary& summary) {
  std::map<std::string, const BoardView*> in_color;
  const auto stem = [](const std::string& name) { return fs::path(name).stem().string(); };
  for (std::size_t i = 0; i < summary.color_found.names.size(); ++i)
    in_color[stem(summary.color_found.names[i])] = &summary.color_found.views[i];
  std::vector<BoardPair> pairs;
  for (std::size_t i = 0; i < summary.depth_found.names.size(); ++i) {
    const auto partner = in_color.find(stem(summary.depth_found.names[i]));
    if (partner == in_color.end()) continue;
    pairs.push_back({summary.depth_found.views[i], *partner->second});
    summary.names.push_back(partner->first);
  }
  return pairs;
}

void add_errors(HtmlReport& report, const StereoFit& fit) {
  std::vector<CornerResidual> depth, color;
  for (const PairFit& pair : fit.pairs) {
    if (pair.is_outlier) continue;
    depth.insert(depth.end(), pair.depth_corners.begin(), pair.depth_corners.end());
    color.insert(color.end(), pair.color_corners.begin(), pair.color_corners.end());
  }
  report.begin_section("Errors over the images",
                       "What is left between corners found and predicted; it should look random.");
  report.add_figure(encode_png(draw_error_vectors(depth, fit.depth_camera.width, fit.depth_camera.height)),
                    "error vectors in the depth camera", "Depth (infrared) camera.");
  report.add_figure(encode_png(draw_error_vectors(color, fit.color_camera.width, fit.color_camera.height)),
                    "error vectors in the colour camera", "Colour camera.");
}

std::string html_of(const ExtrinsicsSummary& summary) {
  const StereoFit& fit = summary.fit;
  const SummaryTree tree = describe(summary);
  HtmlReport report("Motion between depth and colour camera");
  const bool good = fit.warnings.empty();
  report.set_verdict(good ? HtmlReport::Verdict::kGood : HtmlReport::Verdict::kDoubtful,
                     good ? "A good set of pairs." : fmt::format("A poor set: {}.", fit.warnings.front()));
  add_cards(report, tree,
            {{"distance", "{distance}", "+- {distance_sigma} along each axis at most"},
             {"rotation", "{T_color_depth.angle_rad}", "+- {angle_sigma}"},
             {"reprojection error", "{rms_px}", "both cameras"}});
  if (!summary.warnings.empty()) {
    report.begin_section("What to improve");
    report.add_list(summary.warnings);
  }
  add_errors(report, fit);
  report.begin_section("Pairs");
  add_list_table(report, tree, "pairs");
  return report.html();
}

void add_warnings(ExtrinsicsSummary& summary, std::size_t pairs) {
  auto& warnings = summary.warnings;
  const auto append = [&](const std::vector<std::string>& more) {
    warnings.insert(warnings.end(), more.begin(), more.end());
  };
  append(warnings_of(summary.depth_found));
  append(warnings_of(summary.color_found));
  if (summary.without_partner > 0)
    warnings.push_back(
        fmt::format("{} without a partner of the same name", counted(summary.without_partner, "image")));
  append(summary.fit.warnings);
  for (std::size_t i = 0; i < pairs; ++i)
    if (summary.fit.pairs[i].is_outlier)
      warnings.push_back(
          fmt::format("pair {} left out: its error is far above the others'", summary.names[i]));
}

}  // namespace

Result<ExtrinsicsSummary> calibrate_extrinsics(const ExtrinsicsOptions& options) {
  auto start = read_start(options.start);
  if (!start) return forward_error(start);
  if (!start->depth_camera || !start->color_camera)
    return fail(
        ErrorCode::kUsage, options.start,
        "a calibration with both cameras is needed (--calibration): `hm calibrate intrinsics` for each, with "
        "--camera color and --camera depth");
  const auto files = pair_up(options);
  if (!files) return forward_error(files);
  ExtrinsicsSummary summary;
  summary.without_partner = files->without_partner;
  auto depth_found = find_boards(files->depth, options.board, options.run);
  if (!depth_found) return forward_error(depth_found);
  auto color_found = find_boards(files->color, options.board, options.run);
  if (!color_found) return forward_error(color_found);
  summary.depth_found = std::move(*depth_found), summary.color_found = std::move(*color_found);
  const auto check_size = [&](const FoundBoards& found, const PinholeCamera& camera,
                              const fs::path& folder) -> Result<void> {
    if (found.width == camera.width && found.height == camera.height) return {};
    return fail(ErrorCode::kInvalidValue, folder,
                "the images are {} x {}, the calibration's camera is {} x {}", found.width, found.height,
                camera.width, camera.height);
  };
  if (auto right = check_size(summary.depth_found, *start->depth_camera, options.depth_images); !right)
    return forward_error(right);
  if (auto right = check_size(summary.color_found, *start->color_camera, options.color_images); !right)
    return forward_error(right);
  const auto pairs = both_seen(summary);
  auto fit = fit_stereo(pairs, options.board, *start->depth_camera, *start->color_camera, options.fit);
  if (!fit) {
    fit.error().where = options.depth_images;
    return forward_error(fit);
  }
  summary.fit = std::move(*fit);
  add_warnings(summary, pairs.size());
  CalibrationOutput output{options.output, std::move(*start), to_json(summary), html_of(summary)};
  output.calibration.T_color_depth = summary.fit.T_color_depth;
  output.calibration.depth_camera = summary.fit.depth_camera;
  output.calibration.color_camera = summary.fit.color_camera;
  const auto written = write_calibration_output(output);
  if (!written) return forward_error(written);
  summary.outputs = *written;
  return summary;
}

void visit(const ExtrinsicsSummary& summary, SummaryTree& v) {
  const StereoFit& fit = summary.fit;
  const Vec3& t = fit.T_color_depth.translation();
  const Vec3& s = fit.translation_sigma_m;
  const auto numbers = [](const Vec3& p) { return JsonValue(JsonValue::Array{p.x(), p.y(), p.z()}); };
  const Eigen::Quaterniond q = fit.T_color_depth.quaternion();
  v.group("depth_camera", summary.depth_found);
  v.group("color_camera", summary.color_found);
  v({"without_partner"}, summary.without_partner);
  v.object("T_color_depth", [&](SummaryTree& motion) {
    motion.json("xyz_m", numbers(t));
    motion.json("quaternion_xyzw", JsonValue(JsonValue::Array{q.x(), q.y(), q.z(), q.w()}));
    motion({"angle_rad", {}, "{:.3f} deg", kDegreesPerRadian}, fit.T_color_depth.angle());
  });
  v.shown("xyz", {},
          fmt::format("({:.2f} +- {:.2f}, {:.2f} +- {:.2f}, {:.2f} +- {:.2f}) mm", 1e3 * t.x(), 1e3 * s.x(),
                      1e3 * t.y(), 1e3 * s.y(), 1e3 * t.z(), 1e3 * s.z()));
  v.shown("distance", {}, fmt::format("{:.2f} mm", 1e3 * t.norm()));
  v.shown("distance_sigma", {}, fmt::format("{:.2f} mm", 1e3 * s.maxCoeff()));
  v.object("deviation", [&](SummaryTree& deviation) {
    deviation.json("xyz_m", numbers(s));
    deviation.json("rotation_rad", numbers(fit.rotation_sigma_rad));
  });
  v.shown("angle_sigma", {},
          fmt::format("{:.3f} deg", fit.rotation_sigma_rad.maxCoeff() * kDegreesPerRadian));
  v({"rms_px", {}, "{:.3f} px"}, fit.rms_px);
  v.list_of("pairs", fit.pairs.size(), [&](std::size_t i, SummaryTree& row) {
    const PairFit& pair = fit.pairs[i];
    row({"name", "pair"}, summary.names[i]);
    row({"depth_rms_px", "depth camera", "{:.3f} px"}, pair.depth_rms_px);
    row({"color_rms_px", "colour camera", "{:.3f} px"}, pair.color_rms_px);
    row.shown("distance", "distance", fmt::format("{:.2f} m", pair.T_color_board.translation().norm()));
    row({"left_out", "left out"}, pair.is_outlier);
  });
}

std::string to_text(const ExtrinsicsSummary& summary) {
  const SummaryTree tree = describe(summary);
  return counted(summary.fit.pairs.size(), "pair") + ", reprojection error " +
         tree.lines({"{rms_px}", "T_color_depth: {xyz}, {T_color_depth.angle_rad} +- {angle_sigma}"}) +
         output_lines(summary.outputs);
}

}  // namespace hm
