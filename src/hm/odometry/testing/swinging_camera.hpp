#pragma once
#include <cmath>
#include <vector>

#include "hm/odometry/testing/textured_room.hpp"
#include "hm/odometry/tracker/row_motion.hpp"
#include "hm/odometry/tracker/tracker.hpp"

namespace hm {

/// Camera before a wall at 3 m that starts to swing, at up to 60 degrees per second, and moves a little.
inline SE3 swing(double t_s) {
  constexpr double kTurn_rad_s = 1.05, kSwing_rad_s = 3.8;
  const double yaw = kTurn_rad_s / kSwing_rad_s * (1 - std::cos(kSwing_rad_s * t_s));
  const double pitch = 0.1 * (1 - std::cos(1.3 * kSwing_rad_s * t_s));
  return {so3_exp(Vec3(pitch, yaw, 0)),
          Vec3(0.06 * (1 - std::cos(1.7 * t_s)), 0.04 * (1 - std::cos(2.3 * t_s)), 0)};
}

/// How the swinging camera takes its images, at 30 Hz.
struct SwingingCamera {
  ColorTimes color;
  double late_stamp_s = 0;  ///< stamps are late by up to this
  double exposure_s = 0;    ///< of a row, by the mean of four moments
  bool noise = false;       ///< of a Kinect's depth and, 2 grey levels, of colour

  static constexpr double kFrame_s = 1.0 / 30;

  /// The middle row of colour is exposed `index` periods after the start, the depth image before.
  [[nodiscard]] RgbdFrame frame(int index, Rng& rng) const {
    constexpr double kGraySigma = 2;
    const PinholeCamera camera = room_camera();
    const double t_s = index * kFrame_s;
    TexturedRoom room;
    room.half_size_m = Vec3(4, 2.5, 3);
    const Time stamp = Time::from_seconds(1 + t_s + rng.uniform(0, late_stamp_s));
    RgbdFrame frame =
        render_room(room, camera, swing(t_s - color.delay_s), stamp, {noise, 0, DepthNoise{}}, &rng);
    frame.index = static_cast<std::size_t>(index);
    for (int y = 0; y < camera.height; ++y) {
      const double row_s = t_s + (static_cast<double>(y) / (camera.height - 1) - 0.5) * color.readout_s;
      std::vector<double> gray = row_at(room, y, row_s);
      for (int x = 0; x < camera.width; ++x) {
        double& value = gray[static_cast<std::size_t>(x)];
        if (noise) value += rng.normal(0, kGraySigma);
        frame.color(x, y) = gray_pixel(value);
      }
    }
    return frame;
  }

 private:
  [[nodiscard]] std::vector<double> row_at(const TexturedRoom& room, int y, double t_s) const {
    constexpr int kMoments = 4;
    const int moments = exposure_s > 0 ? kMoments : 1;
    PinholeCamera row = room_camera();
    row.cy -= y;
    row.height = 1;
    std::vector<double> mean(static_cast<std::size_t>(row.width));
    for (int k = 0; k < moments; ++k) {
      const double moment_s = exposure_s * ((k + 0.5) / moments - 0.5);
      const Image<Rgb8> image = render_room(room, row, swing(t_s + moment_s), {}).color;
      for (int x = 0; x < row.width; ++x)
        mean[static_cast<std::size_t>(x)] += static_cast<double>(image(x, 0).r) / moments;
    }
    return mean;
  }
};

/// Result of tracking the swinging camera for three seconds.
struct SwingRun {
  double rms_m = 0;  ///< error of the position at the time of the middle row, of the frames with a pose
  int lost = 0;
  TrackingNumbers last;
};

inline SwingRun track_swing(const SwingingCamera& camera, std::uint64_t seed,
                            const TrackerParams& tracker = {}) {
  OdometryParams params;
  params.tracker = tracker;
  const auto odometry = make_tracker(params, room_camera(), swing(0));
  SwingRun run;
  Rng rng(seed);
  double sum = 0;
  constexpr int kFrames = 90;
  for (int i = 0; i < kFrames; ++i) {
    const TrackedFrame tracked = odometry->track(camera.frame(i, rng));
    run.last = tracked.numbers;
    if (!tracked.T_odom_camera) {
      ++run.lost;
      continue;
    }
    const Vec3 truth = swing(i * SwingingCamera::kFrame_s).translation();
    sum += (tracked.T_odom_camera->translation() - truth).squaredNorm();
  }
  run.rms_m = std::sqrt(sum / std::max(1, kFrames - run.lost));
  return run;
}

}  // namespace hm
