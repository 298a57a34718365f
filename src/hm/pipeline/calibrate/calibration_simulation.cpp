#include "hm/pipeline/calibrate/calibration_simulation.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "hm/core/angle.hpp"
#include "hm/io/bytes/file_bytes.hpp"
#include "hm/io/bytes/output_file.hpp"
#include "hm/io/camera/calibration_file.hpp"
#include "hm/io/image/image_file.hpp"

namespace hm {
namespace {

namespace fs = std::filesystem;

constexpr int kSquare_px = 40;

/// One run of simulate_calibration().
class BoardSimulation {
 public:
  explicit BoardSimulation(const CalibrationSimulationOptions& options)
      : options_(options),
        rig_(rig_of(options.params)),
        color_(rig_.color_camera),
        ir_(rig_.depth_camera),
        rng_(static_cast<std::uint64_t>(options.params.seed)) {
    small_ = options.board;
    small_.corners_x = options.params.kSmallCornersX, small_.corners_y = options.params.kSmallCornersY;
    small_.square_m = options.params.kSmallSquare_m;
    small_gray_ = draw_board(small_, kSquare_px);
    large_gray_ = draw_board(options.board, kSquare_px);
  }
  Result<CalibrationSimulationSummary> run();

 private:
  struct Place {
    double distance_m = 1;
    Vec2 share = Vec2(0.5, 0.5);  ///< of the image's width and height
    double most_tilt_rad = 0.7;
  };
  Result<void> write_intrinsics(const char* folder, const FlatRenderer& renderer, std::size_t& count);
  Result<void> write_pairs();
  Result<void> write_depth(const char* folder, const std::vector<Place>& places, std::size_t& count);
  Result<void> write_pose(const fs::path& folder, const SE3& T_color_picture);
  Result<void> write_truth();
  [[nodiscard]] std::vector<Place> training_places() const;
  [[nodiscard]] std::vector<Place> test_places();
  SE3 place(const FlatRenderer& renderer, const FlatPicture& target, const Place& where);
  [[nodiscard]] FlatPicture small() const { return {small_gray_, small_.square_m / kSquare_px}; }
  [[nodiscard]] FlatPicture large() const { return {large_gray_, options_.board.square_m / kSquare_px}; }
  Result<void> write_board(const fs::path& folder, BoardParams board);
  Result<void> write_image(const fs::path& path, const FlatRenderer& renderer, const FlatPicture& flat,
                           const SE3& T);
  Result<void> step(const char* stage, std::size_t done, std::size_t total);

  const CalibrationSimulationOptions& options_;
  CalibrationRig rig_;
  FlatRenderer color_, ir_;
  Rng rng_;
  BoardParams small_;
  Image<std::uint8_t> small_gray_, large_gray_;
  std::string boards_csv_ = "# set,number,mean_depth_m,qx,qy,qz,qw,x_m,y_m,z_m (T_depth_picture)\n";
  CalibrationSimulationSummary summary_;
};

Result<void> BoardSimulation::step(const char* stage, std::size_t done, std::size_t total) {
  if (options_.run.progress) options_.run.progress({stage, done, total, {}});
  if (options_.run.stop.stop_requested()) return fail(ErrorCode::kCancelled, "", "stopped while simulating");
  return {};
}

Result<void> BoardSimulation::write_board(const fs::path& folder, BoardParams board) {
  ParamList list;
  list.add("board", board);
  return write_file_text(folder / "board.toml", list.to_toml());
}

Result<void> BoardSimulation::write_image(const fs::path& path, const FlatRenderer& renderer,
                                          const FlatPicture& flat, const SE3& T) {
  return write_png(path, renderer.render(flat, T, rig_.gray_sigma, rng_), PngEffort::kFast);
}

/// The white margin of a board, half a square wide, need not be seen.
double margin_px(const FlatPicture& target, const PinholeCamera& camera, double distance_m) {
  constexpr double kKept_px = 4;
  return kKept_px - 0.4 * kSquare_px * target.pixel_m * camera.fx / distance_m;
}

/// A random pose near a place at which the whole board is seen; less and less tilted, farther from the
/// border and farther away until it is.
SE3 BoardSimulation::place(const FlatRenderer& renderer, const FlatPicture& target, const Place& where) {
  const PinholeCamera& camera = renderer.camera();
  SE3 T;
  for (int attempt = 0; attempt < 200; ++attempt) {
    const double towards_middle = attempt / 100.0;
    FlatView view;
    const Vec2 share = where.share + std::min(1.0, towards_middle) * (Vec2(0.5, 0.5) - where.share);
    view.pixel = Vec2(share.x() * camera.width, share.y() * camera.height);
    view.distance_m =
        where.distance_m * (1 + std::max(0.0, towards_middle - 1) * 0.3) * rng_.uniform(0.98, 1.02);
    view.tilt_rad = where.most_tilt_rad * rng_.uniform(0.3, 1);
    view.tilt_axis_rad = rng_.uniform(0, 2 * std::numbers::pi);
    view.roll_rad = rng_.uniform(-12, 12) * kRadiansPerDegree;
    T = place_picture(camera, target, view);
    if (sees_whole(camera, target, T, margin_px(target, camera, view.distance_m))) break;
  }
  return T;
}

Result<void> BoardSimulation::write_intrinsics(const char* folder, const FlatRenderer& renderer,
                                               std::size_t& count) {
  const fs::path path = options_.output / folder;
  if (auto made = make_folder(path); !made) return made;
  if (auto written = write_board(path, small_); !written) return written;
  const int views = options_.params.camera_views;
  for (int i = 0; i < views; ++i) {
    if (auto go_on = step("simulating images", static_cast<std::size_t>(i), static_cast<std::size_t>(views));
        !go_on)
      return go_on;
    // The board's middle goes over a grid of 4 x 3 places; it fills half of the image's width or less.
    const double fill = i % 2 == 0 ? 0.5 : 0.35;
    Place where;
    where.distance_m = small().width_m() * renderer.camera().fx / (fill * renderer.camera().width);
    where.share = Vec2(((i % 4) + 0.5) / 4, ((i / 4 % 3) + 0.5) / 3);
    where.most_tilt_rad = 0.75;
    const SE3 T = place(renderer, small(), where);
    if (auto written = write_image(path / fmt::format("{:02}.png", i), renderer, small(), T); !written)
      return written;
    ++count;
  }
  summary_.outputs.push_back(path);
  return {};
}

Result<void> BoardSimulation::write_pairs() {
  const fs::path path = options_.output / "stereo";
  for (const char* name : {"color", "ir"})
    if (auto made = make_folder(path / name); !made) return made;
  if (auto written = write_board(path, small_); !written) return written;
  const int views = options_.params.stereo_views;
  for (int i = 0; i < views; ++i) {
    if (auto go_on = step("simulating pairs", static_cast<std::size_t>(i), static_cast<std::size_t>(views));
        !go_on)
      return go_on;
    SE3 T;
    for (int attempt = 0; attempt < 20; ++attempt) {
      Place where;
      where.distance_m =
          small().width_m() * color_.camera().fx / ((i % 2 == 0 ? 0.5 : 0.35) * color_.camera().width);
      where.share = Vec2(((i % 4) + 0.5) / 4, ((i / 4 % 3) + 0.5) / 3);
      T = place(color_, small(), where);
      const SE3 T_ir = rig_.T_color_depth.inverse() * T;
      if (sees_whole(ir_.camera(), small(), T_ir, margin_px(small(), ir_.camera(), where.distance_m))) break;
    }
    const std::string name = fmt::format("{:02}.png", i);
    if (auto written = write_image(path / "color" / name, color_, small(), T); !written) return written;
    if (auto written = write_image(path / "ir" / name, ir_, small(), rig_.T_color_depth.inverse() * T);
        !written)
      return written;
    ++summary_.pairs;
  }
  summary_.outputs.push_back(path);
  return {};
}

/// At every distance as many places as fill the image.
std::vector<BoardSimulation::Place> BoardSimulation::training_places() const {
  const CalibrationSimulationParams& params = options_.params;
  std::vector<Place> places;
  for (int i = 0; i < params.depth_steps; ++i) {
    const double z = params.min_distance_m + (params.max_distance_m - params.min_distance_m) * i /
                                                 std::max(1, params.depth_steps - 1);
    const double seen_px = large().width_m() * rig_.color_camera.fx / z,
                 high_px = large().height_m() * rig_.color_camera.fx / z;
    const int columns =
        std::clamp(static_cast<int>(std::ceil(0.75 * rig_.color_camera.width / seen_px)), 2, 4);
    const int rows = std::clamp(static_cast<int>(std::ceil(0.75 * rig_.color_camera.height / high_px)), 2, 4);
    const double margin = options_.board.square_m * rig_.color_camera.fx / z;
    const Vec2 half(0.5 * (seen_px - margin) / rig_.color_camera.width,
                    0.5 * (high_px - margin) / rig_.color_camera.height);
    for (int y = 0; y < rows; ++y)
      for (int x = 0; x < columns; ++x) {
        // The outer places touch the border of the image.
        const auto along = [](int k, int n, double edge) {
          return edge + (1 - 2 * edge) * k / std::max(1, n - 1);
        };
        places.push_back(
            {z, Vec2(along(x, columns, std::min(0.5, half.x())), along(y, rows, std::min(0.5, half.y()))),
             0.35});
      }
  }
  return places;
}

std::vector<BoardSimulation::Place> BoardSimulation::test_places() {
  const CalibrationSimulationParams& params = options_.params;
  std::vector<Place> places;
  for (int i = 0; i < params.test_steps; ++i)
    for (int k = 0; k < 3; ++k) {
      const double z = params.min_distance_m +
                       (params.max_distance_m - params.min_distance_m) * (i + 0.5) / params.test_steps;
      places.push_back({z, Vec2(rng_.uniform(0.15, 0.85), rng_.uniform(0.15, 0.85)), 0.35});
    }
  return places;
}

Result<void> BoardSimulation::write_pose(const fs::path& folder, const SE3& T_color_picture) {
  if (auto made = make_folder(folder); !made) return made;
  if (auto written = write_image(folder / "color.png", color_, large(), T_color_picture); !written)
    return written;
  const Image<float> truth = ir_.depth_m(large(), rig_.T_color_depth.inverse() * T_color_picture);
  for (int i = 0; i < options_.params.depth_images; ++i) {
    const DepthImage depth = sense_flat(rig_, truth, rng_);
    if (auto written = write_png(folder / fmt::format("depth_{:03}.png", i), depth.units, PngEffort::kFast);
        !written)
      return written;
    ++summary_.depth_images;
  }
  return {};
}

Result<void> BoardSimulation::write_depth(const char* folder, const std::vector<Place>& places,
                                          std::size_t& count) {
  const fs::path path = options_.output / "depth";
  if (auto made = make_folder(path); !made) return made;
  if (auto written = write_board(path, options_.board); !written) return written;
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (auto go_on = step("simulating depth", i, places.size()); !go_on) return go_on;
    const SE3 T = place(color_, large(), places[i]);
    if (auto written = write_pose(path / folder / fmt::format("{:03}", i), T); !written) return written;
    const SE3 T_depth_picture = rig_.T_color_depth.inverse() * T;
    const Eigen::Quaterniond q = T_depth_picture.quaternion();
    const Vec3& t = T_depth_picture.translation();
    boards_csv_ += fmt::format("{},{:03},{:.4f},{:.9f},{:.9f},{:.9f},{:.9f},{:.9f},{:.9f},{:.9f}\n", folder,
                               i, places[i].distance_m, q.x(), q.y(), q.z(), q.w(), t.x(), t.y(), t.z());
    ++count;
  }
  return {};
}

Result<void> BoardSimulation::write_truth() {
  const fs::path path = options_.output / "truth";
  if (auto made = make_folder(path); !made) return made;
  RgbdCalibration truth;
  truth.depth_camera = rig_.depth_camera;
  truth.color_camera = rig_.color_camera;
  truth.T_color_depth = rig_.T_color_depth;
  if (auto written = write_calibration(path / kCalibrationFileName, truth); !written) return written;
  if (auto written = write_file_text(path / "boards.csv", boards_csv_); !written) return written;
  summary_.outputs.push_back(options_.output / "depth");
  summary_.outputs.push_back(path);
  return {};
}

Result<CalibrationSimulationSummary> BoardSimulation::run() {
  if (auto written = write_intrinsics("color", color_, summary_.color_images); !written)
    return forward_error(written);
  if (auto written = write_intrinsics("ir", ir_, summary_.ir_images); !written) return forward_error(written);
  if (auto written = write_pairs(); !written) return forward_error(written);
  if (auto written = write_depth("train", training_places(), summary_.train_poses); !written)
    return forward_error(written);
  if (auto written = write_depth("test", test_places(), summary_.test_poses); !written)
    return forward_error(written);
  if (auto written = write_truth(); !written) return forward_error(written);
  return summary_;
}

}  // namespace

CalibrationRig rig_of(const CalibrationSimulationParams& params) {
  const bool is_xtion = params.sensor == CalibrationSensor::kXtion;
  CalibrationRig rig = is_xtion ? xtion_rig() : device_rig(SensorPreset(static_cast<int>(params.sensor) - 1));
  if (is_xtion) rig.warp_at_4m_m = params.warp_at_4m_m, rig.noise = {params.noise_quadratic_per_m, 0, 0};
  rig.gray_sigma = params.gray_sigma;
  return rig;
}

Result<CalibrationSimulationSummary> simulate_calibration(const CalibrationSimulationOptions& options) {
  if (auto checked = check_params(options.board); !checked) return forward_error(checked);
  if (options.params.max_distance_m <= options.params.min_distance_m)
    return fail(ErrorCode::kUsage, "calibration_simulation", "max_distance_m is not above min_distance_m");
  std::error_code code;
  if (fs::exists(options.output, code) && !fs::is_empty(options.output, code))
    return fail(ErrorCode::kUsage, options.output, "is there already, and not empty");
  const bool is_new = !fs::exists(options.output, code);
  if (const auto made = make_folder(options.output); !made) return forward_error(made);
  auto summary = as_run_failure(BoardSimulation(options).run());
  if (summary) return summary;
  if (is_new) {
    fs::remove_all(options.output, code);
  } else {
    for (const char* name : {"color", "ir", "stereo", "depth", "truth"})
      fs::remove_all(options.output / name, code);
  }
  return summary;
}

}  // namespace hm
