#include "hm/pipeline/calibrate/calibration_noise.hpp"

#include <algorithm>

#include "hm/core/params.hpp"
#include "hm/core/text/counted.hpp"
#include "hm/io/bytes/file_bytes.hpp"
#include "hm/io/image/image_file.hpp"
#include "hm/pipeline/calibrate/depth_pose_set.hpp"
#include "hm/report/plot.hpp"
#include "hm/report/run_report.hpp"

namespace hm {
namespace {

namespace fs = std::filesystem;

/// Gathers deviations of one input.
class Gatherer {
 public:
  Gatherer(const NoiseCalibrationOptions& options, NoiseCalibrationSummary& summary)
      : options_(options), summary_(summary), histogram_(options.fit) {}
  Result<void> from_recording();
  Result<void> from_poses(const std::vector<DepthPoseFolder>& poses);
  [[nodiscard]] std::vector<NoiseSample> samples() const { return histogram_.samples(); }

 private:
  [[nodiscard]] Result<void> step(std::size_t done, std::size_t total) const {
    if (options_.run.progress) options_.run.progress({"reading depth", done, total, {}});
    if (options_.run.stop.stop_requested())
      return fail(ErrorCode::kCancelled, "", "stopped while reading depth");
    return {};
  }
  void unreadable(const Error& error) {
    if (summary_.unreadable++ == 0) summary_.first_unreadable = to_string(error);
  }
  const NoiseCalibrationOptions& options_;
  NoiseCalibrationSummary& summary_;
  NoiseHistogram histogram_;
};

Result<void> Gatherer::from_recording() {
  const auto recording = open_recording(options_.input, options_.recording_options);
  if (!recording) return forward_error(recording);
  const RecordingInfo& info = (*recording)->info();
  const std::size_t count = std::min(info.frame_count, static_cast<std::size_t>(options_.frame_limit));
  DepthAverage average(info.camera.width, info.camera.height);
  FramePrefetcher frames(**recording, 0, count, 1, {.readers = options_.run.threads});
  for (std::size_t done = 0; const auto frame = frames.next(); ++done) {
    if (auto go_on = step(done, count); !go_on) return go_on;
    if (!*frame) {
      unreadable(frame->error());
      continue;
    }
    ++summary_.images;
    if (options_.source == NoiseSource::kPlanes)
      histogram_.add_plane((*frame)->depth);
    else
      average.add((*frame)->depth);
  }
  if (options_.source == NoiseSource::kStatic) histogram_.add_static(average);
  return {};
}

Result<void> Gatherer::from_poses(const std::vector<DepthPoseFolder>& poses) {
  const DepthReading reading{options_.depth_units_per_m, options_.disparity};
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (auto go_on = step(i, poses.size()); !go_on) return go_on;
    if (options_.source == NoiseSource::kStatic) {
      const auto average = average_depth(poses[i], reading);
      if (!average) {
        unreadable(average.error());
        continue;
      }
      summary_.images += poses[i].depth.size();
      histogram_.add_static(*average);
      continue;
    }
    for (const fs::path& path : poses[i].depth) {
      const auto depth = read_depth_of(path, reading);
      if (!depth) {
        unreadable(depth.error());
        continue;
      }
      ++summary_.images;
      histogram_.add_plane(*depth);
    }
  }
  return {};
}

/// The folders of poses in the input, or in train and test within it; empty: it is none of such a set.
std::vector<DepthPoseFolder> poses_in(const fs::path& input) {
  std::vector<DepthPoseFolder> poses;
  std::error_code code;
  for (const fs::path& folder : {input, input / "train", input / "test"}) {
    if (!fs::is_directory(folder, code)) continue;
    if (auto listed = list_depth_poses(folder)) poses.insert(poses.end(), listed->begin(), listed->end());
  }
  return poses;
}

std::string noise_toml(DepthNoise noise) {
  ParamList list;
  list.add("depth_noise", noise);
  return list.to_toml();
}

std::string html_of(const NoiseCalibrationSummary& summary) {
  const DepthNoise& noise = summary.fit.noise;
  HtmlReport report("Axial noise of depth");
  report.set_verdict(
      summary.fit.rms_relative < 0.15 ? HtmlReport::Verdict::kGood : HtmlReport::Verdict::kDoubtful,
      fmt::format("{:.1f} mm at 1 m, {:.1f} mm at 3 m; the curve fits the readings to {:.0f} %.",
                  1e3 * noise.sigma_m(1), 1e3 * noise.sigma_m(3), 100 * summary.fit.rms_relative));
  std::vector<PlotSeries> series(2);
  series[0] = {"readings", {}, {}, SeriesStyle::kScatter};
  series[1].name = "fit";
  for (const NoiseSample& sample : summary.samples) {
    for (PlotSeries& s : series) s.x.push_back(sample.depth_m);
    series[0].y.push_back(1e3 * sample.sigma_m);
    series[1].y.push_back(1e3 * noise.sigma_m(sample.depth_m));
  }
  PlotOptions plot;
  plot.x.label = "depth (m)", plot.y.label = "standard deviation (mm)";
  report.begin_section("Deviation against depth");
  report.add_svg(plot_svg(series, plot), "Each point is a step of depth.");
  if (!summary.warnings.empty()) report.add_list(summary.warnings);
  report.add_collapsible("noise.toml, for --params", noise_toml(noise));
  return report.html();
}

void warn(NoiseCalibrationSummary& summary) {
  if (summary.unreadable > 0)
    summary.warnings.push_back(fmt::format("{} left out ({})",
                                           counted(summary.unreadable, "image or pose", "images or poses"),
                                           summary.first_unreadable));
  const double range = summary.samples.back().depth_m / summary.samples.front().depth_m;
  if (range < 1.5)
    summary.warnings.push_back(
        fmt::format("depths from {:.2f} to {:.2f} m only: beyond, the curve is a guess",
                    summary.samples.front().depth_m, summary.samples.back().depth_m));
  if (summary.fit.rms_relative > 0.15)
    summary.warnings.push_back(
        fmt::format("the curve is off by {:.0f} % on average: did camera or scene move?",
                    100 * summary.fit.rms_relative));
}

}  // namespace

Result<NoiseCalibrationSummary> calibrate_noise(const NoiseCalibrationOptions& options) {
  NoiseCalibrationSummary summary;
  Gatherer gatherer(options, summary);
  const auto poses = poses_in(options.input);
  const auto gathered = poses.empty() ? gatherer.from_recording() : gatherer.from_poses(poses);
  if (!gathered) return forward_error(gathered);
  summary.samples = gatherer.samples();
  auto fit = fit_noise(summary.samples);
  if (!fit) {
    fit.error().where = options.input;
    if (summary.unreadable > 0)
      fit.error().message +=
          fmt::format("; {} left out ({})", counted(summary.unreadable, "image or pose", "images or poses"),
                      summary.first_unreadable);
    const bool single = std::ranges::all_of(poses, [](const auto& pose) { return pose.depth.size() < 2; });
    if (options.source == NoiseSource::kStatic && !poses.empty() && single)
      fit.error().message +=
          "; poses have a single depth image each, which gives no deviation: `--from planes`";
    return forward_error(fit);
  }
  summary.fit = *fit;
  warn(summary);
  const auto written = write_calibration_output({options.output, {}, to_json(summary), html_of(summary)});
  if (!written) return forward_error(written);
  summary.outputs = *written;
  const fs::path toml = options.output / "noise.toml";
  if (auto result = as_run_failure(write_file_text(toml, noise_toml(summary.fit.noise))); !result)
    return forward_error(result);
  summary.outputs.push_back(toml);
  return summary;
}

void visit(const NoiseCalibrationSummary& summary, SummaryTree& v) {
  const DepthNoise& noise = summary.fit.noise;
  v({"images"}, summary.images);
  v({"unreadable"}, summary.unreadable);
  v.object("depth_noise", [&](SummaryTree& model) {
    model({"quadratic_per_m", {}, "{:.6f}"}, noise.quadratic_per_m);
    model({"linear_ratio", {}, "{:.6f}"}, noise.linear_ratio);
    model({"constant_m", {}, "{:.6f}"}, noise.constant_m);
  });
  v({"rms_relative", {}, "{:.1f} %", 100}, summary.fit.rms_relative);
  v.list_of("distances", summary.samples.size(), [&](std::size_t i, SummaryTree& row) {
    const NoiseSample& sample = summary.samples[i];
    row({"depth_m", "depth", "{:.2f} m"}, sample.depth_m);
    row({"sigma_m", "standard deviation", "{:.2f} mm", 1e3}, sample.sigma_m);
    row({"fit_m", "fit", "{:.2f} mm", 1e3}, noise.sigma_m(sample.depth_m));
    row({"readings", "readings"}, sample.weight);
  });
}

std::string to_text(const NoiseCalibrationSummary& summary) {
  return fmt::format("{}; standard deviations at {} from {:.2f} to {:.2f} m\n",
                     counted(summary.images, "depth image"), counted(summary.samples.size(), "depth"),
                     summary.samples.front().depth_m, summary.samples.back().depth_m) +
         describe(summary).lines(
             {"sigma(z) = {depth_noise.quadratic_per_m} z^2 + {depth_noise.linear_ratio} z + "
              "{depth_noise.constant_m} (m), fits to {rms_relative}"}) +
         output_lines(summary.outputs);
}

}  // namespace hm
