#include <memory>

#include "hm/core/text/counted.hpp"
#include "hm/io/bytes/file_bytes.hpp"
#include "hm/io/bytes/json.hpp"
#include "hm/io/bytes/output_file.hpp"
#include "hm/pipeline/experiments/common/experiment_findings.hpp"
#include "hm/pipeline/experiments/rgbd/uncertainty_experiment.hpp"
#include "hm/report/mesh_figures.hpp"
#include "hm/report/plot.hpp"
#include "hm/report/render/color_map.hpp"
#include "hm/report/run_report.hpp"

namespace hm {
namespace {

constexpr std::size_t kLeastPixels = 30;  ///< that a step of depth needs to be drawn
constexpr double kBrightest_m = 0.05;     ///< deviation at the light end of the figures' colours

constexpr std::array<const char*, kUncertaintyModelCount> kModelWords{"quadratic", "4/2/1, noise once",
                                                                      "4/2/1", "10/3/1", "4/1/0"};
constexpr std::array<const char*, kPixelSetCount> kSetWords{"all pixels", "features", "depth edges",
                                                            "planes"};

/// Square roots of deviations as colours, so that millimetres and centimetres can both be seen; grey: none.
Image<Rgb8> draw_deviations(const Image<float>& deviation_m) {
  Image<Rgb8> figure(deviation_m.width(), deviation_m.height(), Rgb8{128, 128, 128});
  for (int y = 0; y < figure.height(); ++y)
    for (int x = 0; x < figure.width(); ++x)
      if (std::isfinite(deviation_m(x, y)))
        figure(x, y) =
            to_rgb8(sequential_color(std::sqrt(static_cast<double>(deviation_m(x, y)) / kBrightest_m)));
  return figure;
}

std::vector<Figure> draw_figures(const UncertaintyResult& result) {
  std::vector<Figure> figures;
  const DeviationImages& images = result.images;
  if (!images.color.empty()) figures.push_back({"color", "What the camera sees.", images.color});
  figures.push_back(
      {"actual",
       fmt::format("Actual deviation of each pixel over all frames of the view: dark none, light "
                   "{:.0f} mm and more, grey no reading.",
                   1e3 * kBrightest_m),
       draw_deviations(images.actual_m)});
  for (std::size_t m = 0; m < kUncertaintyModelCount; ++m)
    figures.push_back({kUncertaintyModels[m], fmt::format("Predicted from one frame: {}.", kModelWords[m]),
                       draw_deviations(images.predicted_m[m])});
  return figures;
}

/// Root mean squares over the depths where there are enough of them, millimetres.
PlotSeries over_depth(const char* name, const std::vector<RootMeanSquare>& by_depth) {
  PlotSeries series{name, {}, {}, SeriesStyle::kLine};
  for (std::size_t i = 0; i < by_depth.size(); ++i) {
    if (by_depth[i].count < kLeastPixels) continue;
    series.x.push_back((static_cast<double>(i) + 0.5) * kUncertaintyDepthStep_m);
    series.y.push_back(1e3 * by_depth[i].value());
  }
  return series;
}

void add_plots(HtmlReport& report, const UncertaintyResult& result, PixelSet which) {
  const auto set = static_cast<std::size_t>(which);
  std::vector<PlotSeries> errors, deviations{over_depth("actual", result.actual_by_depth_m[set])};
  for (std::size_t m = 0; m < kUncertaintyModelCount; ++m) {
    errors.push_back(over_depth(kModelWords[m], result.models[m].error_by_depth_m[set]));
    deviations.push_back(over_depth(kModelWords[m], result.models[m].predicted_by_depth_m[set]));
  }
  PlotOptions plot;
  plot.x.label = "depth (m)";
  plot.y.label = "error (mm, RMS)";
  report.add_svg(plot_svg(errors, plot),
                 fmt::format("Error of the predicted deviation against depth: {}.", kSetWords[set]));
  plot.y.label = "deviation (mm, RMS)";
  report.add_svg(plot_svg(deviations, plot),
                 fmt::format("Actual and predicted deviation: {}.", kSetWords[set]));
}

void add_all_figures(HtmlReport& report, const UncertaintyResult& result,
                     const std::vector<Figure>& figures) {
  for (const PixelSet set : {PixelSet::kAll, PixelSet::kFeatures, PixelSet::kEdges})
    if (result.models[0].error_m[static_cast<std::size_t>(set)].count > 0) add_plots(report, result, set);
  report.begin_section("One of the views");
  for (const Figure& figure : figures) add_figure(report, figure);
}

std::string to_html(const UncertaintyResult& result, const std::vector<Figure>& figures,
                    const std::string& program_version) {
  const double quadratic = result.error_m(0, PixelSet::kEdges), ours = result.error_m(1, PixelSet::kEdges),
               published = result.error_m(2, PixelSet::kEdges);
  HtmlReport report("Depth uncertainty: " + result.scene);
  report.set_verdict(
      HtmlReport::Verdict::kNone,
      fmt::format(
          "At depth edges the quadratic model is off by {:.1f} mm, the published mixture by {:.1f} mm, "
          "with noise counted once by {:.1f} mm.",
          1e3 * quadratic, 1e3 * published, 1e3 * ours));
  add_warnings_section(report, result.warnings);
  report.begin_section(
      "Predicted against actual deviation",
      fmt::format(
          "The deviation of each pixel over {} frames of {} view{} in which nothing moves is the truth. "
          "Each model predicts it from a single frame: the quadratic one from the pixel's depth, mixtures "
          "from its 3x3 pixels with the weights named (centre/edge/corner; noise once: "
          "as odometry uses it). RMS of the difference in millimetres, number of pixels in brackets:",
          result.frames, result.views, result.views == 1 ? "" : "s"));
  std::vector<std::string> header{"model"};
  std::vector<std::vector<std::string>> rows(kUncertaintyModelCount);
  for (std::size_t m = 0; m < rows.size(); ++m) rows[m].emplace_back(kModelWords[m]);
  for (std::size_t set = 0; set < kPixelSetCount; ++set) {
    const std::size_t count = result.models[0].error_m[set].count;
    if (count == 0) continue;
    header.push_back(fmt::format("{} ({})", kSetWords[set], count));
    for (std::size_t m = 0; m < rows.size(); ++m)
      rows[m].push_back(fmt::format("{:.2f}", 1e3 * result.models[m].error_m[set].value()));
  }
  report.add_table(header, rows);
  add_all_figures(report, result, figures);
  if (!program_version.empty()) report.set_footer("housemartin " + program_version);
  return report.html();
}

/// Rows of the experiment's page: errors at all pixels and at depth edges.
std::vector<ExperimentRow> rows_of(const UncertaintyResult& result) {
  std::vector<ExperimentRow> rows;
  for (const PixelSet set : {PixelSet::kAll, PixelSet::kEdges})
    for (std::size_t m = 0; m < kUncertaintyModelCount; ++m)
      rows.push_back({fmt::format("{}: error of the predicted deviation, {}", kModelWords[m],
                                  kSetWords[static_cast<std::size_t>(set)]),
                      {},
                      1e3 * result.error_m(m, set),
                      "mm"});
  return rows;
}

}  // namespace

void add_uncertainty_figures(HtmlReport& report, const UncertaintyResult& result) {
  report.begin_section("Deviation over depth");
  add_all_figures(report, result, draw_figures(result));
}

Result<ExperimentFindings> run_uncertainty_experiment(const ExperimentOptions& options) {
  SimulationParams simulation = options.parameters.simulation;
  simulation.sensor = SensorPreset::kKinect;
  UncertaintyExperimentParams params;
  if (options.tiny) params.views = 1, params.frames = 20;
  auto simulated = simulate_uncertainty(simulation, options.parameters.features, params, options.run);
  if (!simulated) return forward_error(simulated);
  const auto result = std::make_shared<const UncertaintyResult>(std::move(*simulated));
  ExperimentFindings findings;
  findings.rows = rows_of(*result);
  findings.warnings = result->warnings;
  findings.add_figures = [result](HtmlReport& report) { add_uncertainty_figures(report, *result); };
  return findings;
}

Result<std::vector<std::filesystem::path>> write_uncertainty(const UncertaintyResult& result,
                                                             const std::filesystem::path& output,
                                                             const RunContext& run) {
  std::vector<std::filesystem::path> outputs;
  if (auto made = make_folder(output); !made) return forward_error(made);
  const std::vector<Figure> figures = draw_figures(result);
  if (auto drawn = as_run_failure(write_figures(output, figures, outputs, ParallelLoop(run.threads))); !drawn)
    return forward_error(drawn);
  for (const auto& [name, text] : {std::pair{"report.json", to_json_text(to_json(result)) + "\n"},
                                   std::pair{"report.html", to_html(result, figures, run.program_version)}}) {
    if (auto written = as_run_failure(write_file_text(output / name, text)); !written)
      return forward_error(written);
    outputs.push_back(output / name);
  }
  return outputs;
}

JsonValue to_json(const UncertaintyResult& result) {
  JsonValue json =
      JsonValue::object({{"scene", result.scene}, {"views", result.views}, {"frames", result.frames}});
  JsonValue pixels = JsonValue::object({}), models = JsonValue::object({});
  for (std::size_t set = 0; set < kPixelSetCount; ++set)
    pixels[kPixelSetNames[set]] = result.models[0].error_m[set].count;
  for (std::size_t m = 0; m < kUncertaintyModelCount; ++m) {
    JsonValue errors = JsonValue::object({});
    for (std::size_t set = 0; set < kPixelSetCount; ++set) {
      if (result.models[m].error_m[set].count == 0) continue;
      errors[kPixelSetNames[set]] = 1e3 * result.models[m].error_m[set].value();
    }
    models[kUncertaintyModels[m]] = std::move(errors);
  }
  json["pixels"] = std::move(pixels);
  json["rms_error_mm"] = std::move(models);
  JsonValue by_depth = JsonValue::array();
  const auto all = static_cast<std::size_t>(PixelSet::kAll);
  for (std::size_t i = 0; i < result.actual_by_depth_m[all].size(); ++i) {
    if (result.actual_by_depth_m[all][i].count < kLeastPixels) continue;
    JsonValue entry =
        JsonValue::object({{"depth_m", (static_cast<double>(i) + 0.5) * kUncertaintyDepthStep_m},
                           {"actual_mm", 1e3 * result.actual_by_depth_m[all][i].value()}});
    for (std::size_t m = 0; m < kUncertaintyModelCount; ++m)
      entry[std::string(kUncertaintyModels[m]) + "_error_mm"] =
          1e3 * result.models[m].error_by_depth_m[all][i].value();
    by_depth.push_back(std::move(entry));
  }
  json["by_depth"] = std::move(by_depth);
  if (result.normalised_reading.count > 0) {
    json["plane_features"] = result.normalised_reading.count;
    json["normalised_error_of_reading"] = result.normalised_reading.value();
    json["normalised_error_of_mixture_mean"] = result.normalised_mean.value();
  }
  return json;
}

std::string to_text(const UncertaintyResult& result) {
  std::string text =
      fmt::format("{}: {} of {}; predicted minus actual standard deviation, RMS in mm\n{:<20}", result.scene,
                  counted(result.frames, "frame"), counted(result.views, "view"), "");
  for (std::size_t set = 0; set < kPixelSetCount; ++set)
    if (result.models[0].error_m[set].count > 0) text += fmt::format("{:>13}", kSetWords[set]);
  text += '\n';
  for (std::size_t m = 0; m < kUncertaintyModelCount; ++m) {
    text += fmt::format("{:<20}", kModelWords[m]);
    for (std::size_t set = 0; set < kPixelSetCount; ++set)
      if (result.models[m].error_m[set].count > 0)
        text += fmt::format("{:>13.2f}", 1e3 * result.models[m].error_m[set].value());
    text += '\n';
  }
  return text;
}

}  // namespace hm
