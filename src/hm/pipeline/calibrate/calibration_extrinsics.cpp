#include "hm/pipeline/calibrate/calibration_extrinsics.hpp"

#include <algorithm>
#include <map>

#include "hm/core/angle.hpp"
#include "hm/io/image/image_file.hpp"
#include "hm/pipeline/calibrate/calibration_figures.hpp"

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
  const Vec3 t_mm = 1e3 * fit.T_color_depth.translation();
  HtmlReport report("Motion between depth and colour camera");
  const bool good = fit.warnings.empty();
  report.set_verdict(good ? HtmlReport::Verdict::kGood : HtmlReport::Verdict::kDoubtful,
                     good ? "A good set of pairs." : fmt::format("A poor set: {}.", fit.warnings.front()));
  report.add_card(
      {"distance", fmt::format("{:.2f}", t_mm.norm()), "mm",
       fmt::format("+- {:.2f} mm along each axis at most", 1e3 * fit.translation_sigma_m.maxCoeff())});
  report.add_card({"rotation", fmt::format("{:.3f}", fit.T_color_depth.angle() * kDegreesPerRadian), "deg",
                   fmt::format("+- {:.3f} deg", fit.rotation_sigma_rad.maxCoeff() * kDegreesPerRadian)});
  report.add_card({"reprojection error", fmt::format("{:.3f}", fit.rms_px), "px", "both cameras"});
  if (!summary.warnings.empty()) {
    report.begin_section("What to mend");
    report.add_list(summary.warnings);
  }
  add_errors(report, fit);
  report.begin_section("Pairs");
  std::vector<std::vector<std::string>> rows;
  for (std::size_t i = 0; i < fit.pairs.size(); ++i) {
    const PairFit& pair = fit.pairs[i];
    rows.push_back(
        {summary.names[i], fmt::format("{:.3f}", pair.depth_rms_px), fmt::format("{:.3f}", pair.color_rms_px),
         fmt::format("{:.2f}", pair.T_color_board.translation().norm()), pair.is_outlier ? "left out" : ""});
  }
  report.add_table({"pair", "depth camera (px)", "colour camera (px)", "distance (m)", ""}, rows);
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
    warnings.push_back(fmt::format("{} images have no partner of the same name", summary.without_partner));
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

JsonValue to_json(const ExtrinsicsSummary& summary) {
  const StereoFit& fit = summary.fit;
  const auto numbers = [](const Vec3& v) { return JsonValue(JsonValue::Array{v.x(), v.y(), v.z()}); };
  const Eigen::Quaterniond q = fit.T_color_depth.quaternion();
  JsonValue json = JsonValue::object(
      {{"depth_camera", to_json(summary.depth_found)}, {"color_camera", to_json(summary.color_found)}});
  json["without_partner"] = summary.without_partner;
  json["T_color_depth"] =
      JsonValue::object({{"xyz_m", numbers(fit.T_color_depth.translation())},
                         {"quaternion_xyzw", JsonValue(JsonValue::Array{q.x(), q.y(), q.z(), q.w()})},
                         {"angle_rad", fit.T_color_depth.angle()}});
  json["deviation"] = JsonValue::object(
      {{"xyz_m", numbers(fit.translation_sigma_m)}, {"rotation_rad", numbers(fit.rotation_sigma_rad)}});
  json["rms_px"] = fit.rms_px;
  auto pairs = JsonValue::array();
  for (std::size_t i = 0; i < fit.pairs.size(); ++i)
    pairs.push_back(JsonValue::object({{"name", summary.names[i]},
                                       {"depth_rms_px", fit.pairs[i].depth_rms_px},
                                       {"color_rms_px", fit.pairs[i].color_rms_px},
                                       {"left_out", fit.pairs[i].is_outlier}}));
  json["pairs"] = std::move(pairs);
  return json;
}

std::string to_text(const ExtrinsicsSummary& summary) {
  const StereoFit& fit = summary.fit;
  const Vec3 t_mm = 1e3 * fit.T_color_depth.translation(), s_mm = 1e3 * fit.translation_sigma_m;
  std::string text = fmt::format("{} pairs, reprojection error {:.3f} px\n", fit.pairs.size(), fit.rms_px);
  text += fmt::format(
      "T_color_depth: ({:.2f} +- {:.2f}, {:.2f} +- {:.2f}, {:.2f} +- {:.2f}) mm, {:.3f} deg +- {:.3f} deg\n",
      t_mm.x(), s_mm.x(), t_mm.y(), s_mm.y(), t_mm.z(), s_mm.z(),
      fit.T_color_depth.angle() * kDegreesPerRadian, fit.rotation_sigma_rad.maxCoeff() * kDegreesPerRadian);
  for (const auto& path : summary.outputs) text += fmt::format("  {}\n", path.string());
  return text;
}

}  // namespace hm
