#include "hm/report/trajectory_plots.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "hm/core/angle.hpp"
#include "hm/geometry/se2.hpp"
#include "hm/report/path_plots.hpp"
#include "hm/report/render/color_map.hpp"
#include "hm/report/render/mesh_renderer.hpp"

namespace hm {
namespace {

constexpr std::size_t kErrorColors = 10;
constexpr std::size_t kMostPoints = 4000;

std::string css_color(const Rgb8& color) {
  return fmt::format("#{:02x}{:02x}{:02x}", color.r, color.g, color.b);
}

/// Green over yellow and orange to red, even in OKLab.
std::string error_color(std::size_t step) {
  const double share = static_cast<double>(step) / (kErrorColors - 1), hue = (150 - 122 * share) * M_PI / 180;
  return css_color(
      to_rgb8(oklab_to_srgb(Vec3(0.72 - 0.14 * share, 0.16 * std::cos(hue), 0.16 * std::sin(hue)))));
}

std::string length_text(double metres) {
  return metres < 0.1 ? fmt::format("{:.3g} mm", 1e3 * metres) : fmt::format("{:.3g} m", metres);
}

std::vector<std::string> row_of(std::string name, const Summary& values, double scale, int digits) {
  std::vector<std::string> row{std::move(name)};
  for (const double value : {values.mean, values.median, values.rmse, values.p95, values.max})
    row.push_back(fmt::format("{:.{}f}", scale * value, digits));
  return row;
}

double unwrapped(double angle, double before) { return before + std::remainder(angle - before, 2 * M_PI); }

/// x, y, z in metres, roll, pitch, yaw in degrees.
std::array<PlotSeries, 6> components_of(const std::string& name, std::span<const PosePair> pairs,
                                        SE3 PosePair::*pose, const Mat3& R_turned = Mat3::Identity()) {
  std::array<PlotSeries, 6> series;
  Vec3 last = Vec3::Zero();
  const std::size_t step = pairs.size() / kMostPoints + 1;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const SE3& T = pairs[i].*pose;
    const Vec3 angles = roll_pitch_yaw(R_turned * T.rotation());
    for (int k = 0; k < 3; ++k) last[k] = i == 0 ? angles[k] : unwrapped(angles[k], last[k]);
    if (i % step != 0) continue;
    for (std::size_t k = 0; k < 6; ++k) {
      const auto axis = static_cast<Eigen::Index>(k % 3);
      series[k].x.push_back((pairs[i].stamp - pairs.front().stamp).seconds());
      series[k].y.push_back(k < 3 ? T.translation()[axis] : last[axis] * kDegreesPerRadian);
    }
  }
  for (PlotSeries& one : series) one.name = name;
  return series;
}

/// The estimate may be whole turns away from the truth.
void join_turns(const PlotSeries& truth, PlotSeries& estimate) {
  if (truth.y.empty() || estimate.y.empty()) return;
  const double turns = 360 * std::round((truth.y.front() - estimate.y.front()) / 360);
  for (double& value : estimate.y) value += turns;
}

double speed_between(const StampedPose& a, const StampedPose& b) {
  return (b.T_world_base.translation() - a.T_world_base.translation()).norm() / (b.stamp - a.stamp).seconds();
}

double turn_rate_between(const StampedPose& a, const StampedPose& b) {
  return (a.T_world_base.inverse() * b.T_world_base).angle() / (b.stamp - a.stamp).seconds();
}

/// The motion between consecutive poses over time; of many, the largest of each few.
PlotSeries motion_of(const NamedTrajectory& path, Time begin,
                     double (*between)(const StampedPose&, const StampedPose&)) {
  PlotSeries series{path.name, {}, {}, SeriesStyle::kLine};
  const Trajectory& poses = *path.trajectory;
  const std::size_t step = poses.size() / kMostPoints + 1;
  for (std::size_t i = 1; i < poses.size(); ++i) {
    const double value = between(poses[i - 1], poses[i]);
    if ((i - 1) % step == 0) {
      series.x.push_back((poses[i].stamp - begin).seconds());
      series.y.push_back(value);
    } else {
      series.y.back() = std::max(series.y.back(), value);
    }
  }
  return series;
}

}  // namespace

void add_error_path(HtmlReport& report, const TrajectoryError& error) {
  const auto& pairs = error.matched;
  if (pairs.size() < 2 || pairs.size() != error.position_errors_m.size()) return;
  const auto [right, upwards] = paper_axes(matched_truth(error));
  const double top_m = std::max(error.position_m.p99, 1e-6);
  std::vector<PlotSeries> series(kErrorColors);
  const std::size_t step = pairs.size() / kMostPoints + 1;
  for (std::size_t i = 0; i + step < pairs.size(); i += step) {
    const double share = std::clamp(error.position_errors_m[i] / top_m, 0.0, 1.0);
    PlotSeries& color = series[std::min(static_cast<std::size_t>(share * kErrorColors), kErrorColors - 1)];
    for (const std::size_t end : {i, i + step}) {
      color.x.push_back(pairs[end].T_world_estimate.translation()[right]);
      color.y.push_back(pairs[end].T_world_estimate.translation()[upwards]);
    }
    color.x.push_back(std::nan("")), color.y.push_back(std::nan(""));
  }
  PlotOptions plot;
  plot.equal_aspect = true, plot.height_px = 360;
  constexpr std::array<char, 3> kNames{'x', 'y', 'z'};
  plot.x.label = fmt::format("{} (m)", kNames[static_cast<std::size_t>(right)]);
  plot.y.label = fmt::format("{} (m)", kNames[static_cast<std::size_t>(upwards)]);
  for (std::size_t i = 0; i < kErrorColors; ++i) {
    series[i].color = error_color(i);
    plot.color_bar.colors.push_back(series[i].color);
  }
  plot.color_bar.low = "0", plot.color_bar.high = length_text(top_m);
  report.add_svg(plot_svg(series, plot), "The path from above, coloured by its position error.");
}

void add_pose_components(HtmlReport& report, const TrajectoryError& error) {
  if (error.matched.size() < 2) return;
  const auto truth = components_of("truth", error.matched, &PosePair::T_world_truth);
  const Mat3 R_own_aligned = error.R_own * error.alignment.rotation.transpose();
  auto estimate = components_of("estimate", error.matched, &PosePair::T_world_estimate,
                                error.rotation_undetermined ? R_own_aligned : Mat3::Identity());
  constexpr std::array<const char*, 6> kLabels{"x (m)",      "y (m)",       "z (m)",
                                               "roll (deg)", "pitch (deg)", "yaw (deg)"};
  for (std::size_t k = 0; k < kLabels.size(); ++k) {
    if (k >= 3) join_turns(truth[k], estimate[k]);
    PlotOptions plot;
    plot.height_px = 220;
    plot.x.label = "time (s)", plot.y.label = kLabels[k];
    const std::array<PlotSeries, 2> both{truth[k], estimate[k]};
    report.add_svg(plot_svg(both, plot), {});
  }
}

std::string undetermined_rotation_note(const TrajectoryError& error) {
  if (!error.rotation_undetermined) return {};
  const std::string by =
      std::isfinite(error.alignment_uncertainty_rad) && error.alignment_uncertainty_rad < M_PI
          ? fmt::format(
                "only to {:.1f} deg, because the path is small or nearly straight "
                "against the position error",
                error.alignment_uncertainty_rad * kDegreesPerRadian)
          : std::string("not at all, because the path is straight or a point");
  return fmt::format(
      "The positions determine the rotation of the alignment {}: the error of the orientation after it is "
      "undetermined. Aligned on their own, the orientations are off by {:.3f} deg (rmse).",
      by, error.rotation_own_rad.rmse * kDegreesPerRadian);
}

void add_error_statistics(HtmlReport& report, const TrajectoryError& error) {
  std::vector<std::vector<std::string>> rows{row_of("position, aligned (m)", error.position_m, 1, 4)};
  const bool moved = !error.alignment.rotation.isIdentity(1e-9) ||
                     error.alignment.translation.norm() > 1e-9 || error.alignment.scale != 1.0;
  if (moved) rows.push_back(row_of("position, as given (m)", error.position_given_m, 1, 4));
  if (!error.rotation_undetermined)
    rows.push_back(row_of("orientation (deg)", error.rotation_rad, kDegreesPerRadian, 3));
  rows.push_back(
      row_of("orientation, aligned on its own (deg)", error.rotation_own_rad, kDegreesPerRadian, 3));
  if (!error.per_second.spans.empty()) {
    rows.push_back(row_of("relative, 1 s (m)", error.per_second.translation_m, 1, 4));
    rows.push_back(row_of("relative, 1 s (deg)", error.per_second.rotation_rad, kDegreesPerRadian, 3));
  }
  report.add_table({"error", "mean", "median", "RMSE", "95 %", "largest"}, rows);
  if (const std::string note = undetermined_rotation_note(error); !note.empty()) report.add_paragraph(note);
}

void add_motion_plots(HtmlReport& report, std::span<const NamedTrajectory> paths) {
  std::vector<PlotSeries> speeds, turns;
  std::optional<Time> begin;
  for (const NamedTrajectory& path : paths) {
    if (path.trajectory->size() < 2) continue;
    if (!begin) begin = path.trajectory->front().stamp;
    speeds.push_back(motion_of(path, *begin, speed_between));
    turns.push_back(motion_of(path, *begin, turn_rate_between));
  }
  if (speeds.empty()) return;
  PlotOptions plot;
  plot.height_px = 220;
  plot.x.label = "time (s)", plot.y.label = "speed (m/s)";
  const std::string too_fast = set_aside_unphysical(speeds, kMaxSpeed_m_s, "m/s");
  report.add_svg(plot_svg(speeds, plot), "Speed from each pose to the next." + too_fast);
  plot.y.label = "turn rate (rad/s)";
  const std::string turns_too_fast = set_aside_unphysical(turns, kMaxTurnRate_rad_s, "rad/s");
  report.add_svg(plot_svg(turns, plot), "Turn rate from each pose to the next." + turns_too_fast);
}

void add_position_histogram(HtmlReport& report, const TrajectoryError& error) {
  std::vector<float> errors_mm;
  for (const double metres : error.position_errors_m) errors_mm.push_back(static_cast<float>(1e3 * metres));
  if (errors_mm.empty()) return;
  PlotOptions plot;
  plot.x.label = "position error (mm)";
  report.add_svg(histogram_svg(errors_mm, 40, plot),
                 fmt::format("Position errors of {} poses.", error.position_errors_m.size()));
}

}  // namespace hm
