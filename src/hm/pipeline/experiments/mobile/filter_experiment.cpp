#include "hm/pipeline/experiments/mobile/filter_experiment.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "hm/core/rng.hpp"
#include "hm/report/plot.hpp"
#include "hm/tsdf/tsdf_params.hpp"
#include "hm/tsdf/update/discrete_update_filter.hpp"

namespace hm {
namespace {

/// A rule by which a stored value approaches its samples.
enum class MeanRule { kExact, kTruncated, kRounded, kImplemented };
constexpr std::array kMeanRules{MeanRule::kExact, MeanRule::kTruncated, MeanRule::kRounded,
                                MeanRule::kImplemented};
constexpr const char* kMeanRuleNames[] = {"exact mean", "rounded towards zero", "rounded", "as implemented"};

/// The stored value after a sample: by the rule from the exact mean, or what the program has stored.
double kept_mean(MeanRule rule, double exact, double implemented) {
  switch (rule) {
    case MeanRule::kExact:
      return exact;
    case MeanRule::kTruncated:
      return std::trunc(exact);
    case MeanRule::kRounded:
      return std::nearbyint(exact);
    case MeanRule::kImplemented:
      break;
  }
  return implemented;
}

/// A quantity that is measured again and again.
struct FilterCase {
  std::string name, unit;
  double resolution, start, truth, sigma;  ///< in its unit
  int cap;                                 ///< most observations that count
  int samples;
};

/// Error (stored minus true) after each sample, RMS over runs with different noise. The stored value has its
/// full weight and is wrong, as where a surface has moved.
std::vector<double> errors_of_distance(const FilterCase& one, MeanRule rule, int runs) {
  std::vector<double> squares(static_cast<std::size_t>(one.samples), 0.0);
  for (int run = 0; run < runs; ++run) {
    Rng rng(static_cast<std::uint64_t>(run), 9);
    double mean = std::round(one.start / one.resolution);
    TsdfVoxel voxel =
        TsdfVoxel::make(static_cast<std::int16_t>(mean), static_cast<std::uint16_t>(one.cap * kWeightOne));
    const double gain = 1 / (one.cap + 1.0);
    for (int i = 0; i < one.samples; ++i) {
      const double sample = rng.normal(one.truth, one.sigma) / one.resolution;
      const double exact = mean + (sample - mean) * gain;
      voxel = add_observation(voxel, static_cast<float>(sample), kWeightOne,
                              static_cast<float>(one.cap * kWeightOne));
      mean = kept_mean(rule, exact, voxel.sdf());
      const double error = mean * one.resolution - one.truth;
      squares[static_cast<std::size_t>(i)] += error * error / runs;
    }
  }
  for (double& value : squares) value = std::sqrt(value);
  return squares;
}

/// The same for a level of colour, without noise, as where the light has changed.
std::vector<double> errors_of_color(const FilterCase& one, MeanRule rule) {
  std::vector<double> errors;
  double mean = one.start;
  const auto level = static_cast<std::uint8_t>(one.start);
  ColorVoxel voxel = ColorVoxel::make(level, level, level, static_cast<std::uint8_t>(one.cap));
  const auto sample = static_cast<std::uint32_t>(one.truth);
  for (int i = 0; i < one.samples; ++i) {
    const double exact = mean + (one.truth - mean) / (one.cap + 1);
    voxel = add_color(voxel, sample | sample << 8U | sample << 16U, static_cast<std::uint32_t>(one.cap));
    mean = kept_mean(rule, exact, voxel.g());
    errors.push_back(std::abs(mean - one.truth));
  }
  return errors;
}

std::string filter_plot(const FilterCase& one, const std::array<std::vector<double>, 4>& errors) {
  std::vector<PlotSeries> series;
  for (std::size_t rule = 0; rule < errors.size(); ++rule) {
    series.push_back({kMeanRuleNames[rule], {}, errors[rule]});
    for (std::size_t i = 0; i < errors[rule].size(); ++i)
      series.back().x.push_back(static_cast<double>(i + 1));
  }
  PlotOptions plot;
  plot.title = one.name;
  plot.x = {"observations", AxisScale::kLog, 0, 0};
  plot.y.label = fmt::format("error, RMS ({})", one.unit);
  return plot_svg(series, plot);
}

}  // namespace

Result<ExperimentFindings> run_filter_experiment(const ExperimentOptions& options) {
  constexpr double kMm = 1e3;
  const TsdfParams tsdf;
  const int runs = options.tiny ? 4 : 200, samples = 1500;
  const double noise_mm = 0.3, truth_mm = 20, start_mm = 15;
  const FilterCase cases[] = {
      {"distance in units of 0.1 mm", "mm", 0.1, start_mm, truth_mm, noise_mm, 100, samples},
      {fmt::format("distance in the map's units of {:.4f} mm", kMm * tsdf.sdf_unit_m()), "mm",
       kMm * tsdf.sdf_unit_m(), start_mm, truth_mm, noise_mm, tsdf.weight_cap_observations, samples},
      {"colour, 40 to 200", "levels", 1, 40, 200, 0, tsdf.color_cap_observations, 300}};
  ExperimentFindings findings;
  std::vector<std::string> plots;
  for (const FilterCase& one : cases) {
    std::array<std::vector<double>, 4> errors;
    for (std::size_t rule = 0; rule < errors.size(); ++rule) {
      errors[rule] = one.sigma > 0 ? errors_of_distance(one, kMeanRules[rule], runs)
                                   : errors_of_color(one, kMeanRules[rule]);
      findings.rows.push_back(
          {fmt::format("{}, {}: error after {}", one.name, kMeanRuleNames[rule], one.samples),
           {},
           errors[rule].back(),
           one.unit});
    }
    plots.push_back(filter_plot(one, errors));
  }
  findings.add_figures = [plots](HtmlReport& report) {
    report.begin_section(
        "Convergence",
        "A surface moves by 5 mm, or a colour changes from 40 to 200, after so many observations "
        "that the weight has reached its cap; measured with a noise of 0.3 mm from then on.");
    for (const std::string& plot : plots) report.add_svg(plot, "Observations: logarithmic.");
  };
  return findings;
}

}  // namespace hm
