#include "hm/pipeline/calibrate/calibration_depth.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "hm/calibration/camera_fit.hpp"
#include "hm/core/parallel.hpp"
#include "hm/core/text/counted.hpp"
#include "hm/io/image/image_file.hpp"
#include "hm/pipeline/calibrate/depth_pose_set.hpp"

namespace hm {
namespace {

namespace fs = std::filesystem;

/// One pose after all of its images were read: samples, or why there are none.
struct Compared {
  std::optional<DepthViewResult> result;
  std::string left_out;
  BoardView view;
  SE3 T_color_board;
};

/// One run of calibrate_depth().
class Run {
 public:
  Run(const DepthCalibrationOptions& options, RgbdCalibration start)
      : options_(options), start_(std::move(start)) {
    if (options.images == DepthImages::kRawDisparity) {
      is_nominal_ = !start_.registers_depth();
      if (is_nominal_) start_.depth_camera = nominal_kinect().camera;
      if (is_nominal_) start_.T_color_depth = nominal_kinect().T_color_depth;
      if (!start_.disparity) start_.disparity = nominal_kinect().disparity;
    }
    rectified_ = start_.depth_camera->without_distortion();
  }
  Result<DepthCalibrationSummary> run();

 private:
  Result<void> list();
  [[nodiscard]] Compared compare(const DepthPoseFolder& pose) const;
  Result<void> compare_all();
  Result<DepthFit> fit() const;
  Result<void> fit_disparity();
  Result<void> refine();
  void warn();

  const DepthCalibrationOptions& options_;
  RgbdCalibration start_;
  PinholeCamera rectified_;
  std::vector<DepthPoseFolder> folders_;
  std::vector<bool> is_test_;
  std::vector<DepthView> train_, test_;
  std::vector<BoardView> corners_;  ///< of train_
  std::vector<SE3> T_color_board_;  ///< of train_
  bool is_nominal_ = false;         ///< the depth camera is a Kinect's by design
  DepthCalibrationSummary summary_;
};

Result<void> Run::list() {
  std::error_code code;
  summary_.has_test_folder = fs::is_directory(options_.set / "train", code);
  if (!summary_.has_test_folder) {
    auto poses = list_depth_poses(options_.set);
    if (!poses) return forward_error(poses);
    folders_ = std::move(*poses);
    for (std::size_t i = 0; i < folders_.size(); ++i)
      is_test_.push_back(i % static_cast<std::size_t>(options_.fit.kHoldOutEvery) ==
                         static_cast<std::size_t>(options_.fit.kHoldOutEvery) / 2);
    return {};
  }
  auto train = list_depth_poses(options_.set / "train", "train/");
  if (!train) return forward_error(train);
  auto test = list_depth_poses(options_.set / "test", "test/");
  if (!test) return forward_error(test);
  folders_ = std::move(*train);
  is_test_.assign(folders_.size(), false);
  is_test_.resize(folders_.size() + test->size(), true);
  folders_.insert(folders_.end(), test->begin(), test->end());
  return {};
}

/// The board's pose comes from the colour image alone; depth only from the depth images.
Compared Run::compare(const DepthPoseFolder& pose) const {
  const auto out = [&](const std::string& why) {
    return Compared{std::nullopt, pose.name + ": " + why, {}, {}};
  };
  if (pose.color.empty()) return out("no colour image");
  const auto image = read_color_image(pose.color);
  if (!image) return out(to_string(image.error()));
  if (image->width() != start_.color_camera->width || image->height() != start_.color_camera->height)
    return out(fmt::format("the colour image is {} x {}, the calibration's camera {} x {}", image->width(),
                           image->height(), start_.color_camera->width, start_.color_camera->height));
  const BoardDetection detection = find_board(*image, options_.board);
  if (detection.search != BoardSearch::kFound) return out("no board in " + pose.color.filename().string());
  const auto T_color_board = board_pose(detection.view, options_.board, *start_.color_camera);
  if (!T_color_board) return out("the corners give no pose");
  const auto average =
      average_depth(pose, {options_.depth_units_per_m, start_.disparity, &*start_.depth_camera});
  if (!average) return out(to_string(average.error()));
  const SE3 T_depth_board = start_.T_color_depth->inverse() * *T_color_board;
  auto result =
      compare_with_board({*average, rectified_, T_depth_board, options_.board}, options_.fit.gate_m);
  if (result.view.samples.empty()) return out("no depth reading on the board");
  result.view.name = pose.name;
  return {std::move(result), {}, detection.view, *T_color_board};
}

Result<void> Run::compare_all() {
  summary_.left_out.clear();
  summary_.no_reading = summary_.off_plane = 0;
  train_.clear(), test_.clear(), corners_.clear(), T_color_board_.clear();
  const ParallelLoop loop(options_.run.threads);
  const auto chunk = static_cast<std::size_t>(options_.run.threads);
  for (std::size_t begin = 0; begin < folders_.size(); begin += chunk) {
    if (options_.run.stop.stop_requested())
      return fail(ErrorCode::kCancelled, "", "stopped while reading poses");
    std::vector<Compared> compared(std::min(chunk, folders_.size() - begin));
    loop.for_ranges(compared.size(), 1, [&](std::size_t from, std::size_t to) {
      for (std::size_t i = from; i < to; ++i) compared[i] = compare(folders_[begin + i]);
    });
    for (std::size_t i = 0; i < compared.size(); ++i) {
      if (!compared[i].result) {
        summary_.left_out.push_back(compared[i].left_out);
        continue;
      }
      summary_.no_reading += compared[i].result->no_reading;
      summary_.off_plane += compared[i].result->off_plane;
      (is_test_[begin + i] ? test_ : train_).push_back(std::move(compared[i].result->view));
      if (is_test_[begin + i]) continue;
      corners_.push_back(std::move(compared[i].view));
      T_color_board_.push_back(compared[i].T_color_board);
    }
    if (options_.run.progress)
      options_.run.progress({"reading poses", begin + compared.size(), folders_.size(), {}});
  }
  summary_.poses = folders_.size();
  if (!train_.empty() && !test_.empty()) return {};
  return fail(ErrorCode::kInvalidValue, options_.set, "of {} poses {} can be trained on and {} tested{}",
              folders_.size(), train_.size(), test_.size(),
              summary_.left_out.empty() ? "" : " (" + summary_.left_out.front() + " ...)");
}

Result<DepthFit> Run::fit() const {
  if (options_.run.progress) options_.run.progress({"fitting", 0, 0, {}});
  auto fit = fit_depth_correction(train_, rectified_.width, rectified_.height, options_.fit);
  if (!fit) fit.error().where = options_.set;
  return fit;
}

/// Finds what raw disparity means, then compares all poses anew: what a board covers depends on it.
Result<void> Run::fit_disparity() {
  constexpr int kRounds = 2;
  const DepthFitParams& params = options_.fit;
  DisparityPrior prior;
  if (!is_nominal_)
    prior = {params.prior_intrinsics_px, params.prior_intrinsics_px, params.prior_translation_m,
             params.prior_rotation_rad};
  RawDepthSummary raw;
  raw.is_nominal_start = is_nominal_;
  DisparityCamera camera{rectified_, *start_.T_color_depth, {}};
  for (int round = 0; round < kRounds; ++round) {
    camera.disparity = *start_.disparity;
    std::vector<DepthPose> poses;
    for (std::size_t i = 0; i < train_.size(); ++i)
      poses.push_back({corners_[i], T_color_board_[i], train_[i]});
    auto fit = fit_disparity_camera(poses, camera, prior);
    if (!fit) {
      fit.error().where = options_.set;
      return forward_error(fit);
    }
    if (round > 0) fit->before_rms = raw.fit.before_rms;
    raw.fit = std::move(*fit);
    const LensDistortion distortion = start_.depth_camera->distortion;
    start_.depth_camera = raw.fit.found.camera;
    start_.depth_camera->distortion = distortion;
    start_.T_color_depth = raw.fit.found.T_color_depth;
    start_.disparity = raw.fit.found.disparity;
    rectified_ = raw.fit.found.camera;
    if (auto compared = compare_all(); !compared) return compared;
  }
  double depth = 0;
  for (const DepthView& view : train_) depth += view.distance_m / static_cast<double>(train_.size());
  raw.published_ratio = depth / DisparityModel().depth_m(start_.disparity->disparity(depth));
  summary_.raw = std::move(raw);
  return {};
}

/// Adjusts the cameras together with boards and correction, and compares all poses anew.
Result<void> Run::refine() {
  const auto first = fit();
  if (!first) return forward_error(first);
  std::vector<DepthPose> poses;
  for (std::size_t i = 0; i < train_.size(); ++i)
    poses.push_back({std::move(corners_[i]), T_color_board_[i], std::move(train_[i])});
  auto refined = refine_geometry(poses, options_.board,
                                 {*start_.depth_camera, *start_.color_camera, *start_.T_color_depth},
                                 first->model, options_.fit);
  if (!refined) {
    if (refined.error().where.empty()) refined.error().where = options_.set;
    return forward_error(refined);
  }
  start_.depth_camera = refined->geometry.depth_camera;
  start_.color_camera = refined->geometry.color_camera;
  start_.T_color_depth = refined->geometry.T_color_depth;
  rectified_ = start_.depth_camera->without_distortion();
  summary_.refinement = std::move(*refined);
  return compare_all();
}

void Run::warn() {
  auto& warnings = summary_.warnings;
  if (!summary_.left_out.empty())
    warnings.push_back(fmt::format("{} of {} left out: {}", summary_.left_out.size(),
                                   counted(summary_.poses, "pose"), fmt::join(summary_.left_out, "; ")));
  if (train_.size() < 15)
    warnings.push_back(fmt::format("only {} to train on: take 40, at all distances, all over the image",
                                   counted(train_.size(), "pose")));
  if (summary_.fit.fitted_pixel_ratio < 0.9)
    warnings.push_back(
        fmt::format("the boards covered {:.0f} % of the depth image: elsewhere the correction is a guess "
                    "from its neighbours",
                    100 * summary_.fit.fitted_pixel_ratio));
  if (summary_.off_plane > 0)
    warnings.push_back(fmt::format("{} farther than {} m from the plane of the board, not used",
                                   counted(summary_.off_plane, "reading"), options_.fit.gate_m));
  if (summary_.raw && std::abs(summary_.raw->published_ratio - 1) > 0.05)
    warnings.push_back(fmt::format(
        "depth is {:.2f} times that of the published constants: is a square of the board "
        "{:.1f} mm, not {:.1f} mm?",
        summary_.raw->published_ratio, 1e3 * options_.board.square_m / summary_.raw->published_ratio,
        1e3 * options_.board.square_m));
  for (const DistanceError& error : summary_.by_distance)
    if (error.after_rms_m > error.before_rms_m)
      warnings.push_back(
          fmt::format("at {:.2f} m the test poses are worse with the correction than without: take more "
                      "poses, or a stiffer model (depth_fit.degree=1, depth_fit.smoothness_m=0.0005)",
                      error.distance_m));
}

Result<DepthCalibrationSummary> Run::run() {
  if (auto listed = list(); !listed) return forward_error(listed);
  if (auto compared = compare_all(); !compared) return forward_error(compared);
  if (options_.images == DepthImages::kRawDisparity)
    if (auto fitted = fit_disparity(); !fitted) return forward_error(fitted);
  if (options_.fit.refine != DepthRefine::kNone)
    if (auto refined = refine(); !refined) return forward_error(refined);
  auto fitted = fit();
  if (!fitted) return forward_error(fitted);
  summary_.fit = std::move(*fitted);
  const auto judge = [&](const std::vector<DepthView>& views, std::vector<DepthViewError>& errors) {
    for (const DepthView& view : views) errors.push_back(evaluate_correction(view, summary_.fit.model));
    std::ranges::sort(errors, {}, &DepthViewError::distance_m);
  };
  judge(train_, summary_.train);
  judge(test_, summary_.test);
  summary_.by_distance = errors_by_distance(summary_.test);
  warn();
  summary_.calibration = std::move(start_);
  summary_.calibration.depth_correction = summary_.fit.model;
  const auto written =
      write_calibration_output({options_.output, summary_.calibration, to_json(summary_), to_html(summary_)});
  if (!written) return forward_error(written);
  summary_.outputs = *written;
  return std::move(summary_);
}

}  // namespace

Result<DepthCalibrationSummary> calibrate_depth(const DepthCalibrationOptions& options) {
  auto start = read_start(options.start);
  if (!start) return forward_error(start);
  if (options.images == DepthImages::kRawDisparity && !start->color_camera)
    return fail(ErrorCode::kUsage, options.start,
                "a calibration with the colour camera is needed (--calibration): `hm calibrate intrinsics`");
  if (options.images == DepthImages::kDepth && !start->registers_depth())
    return fail(ErrorCode::kUsage, options.start,
                "a calibration with both cameras and the motion between them is needed (--calibration): `hm "
                "calibrate "
                "intrinsics` and `hm calibrate extrinsics`");
  if (auto checked = check_params(options.board); !checked) return forward_error(checked);
  return Run(options, std::move(*start)).run();
}

std::vector<DistanceError> errors_by_distance(std::span<const DepthViewError> errors) {
  constexpr double kStep_m = 0.25;
  struct Sum {
    double z = 0, before = 0, after = 0, noise = 0;
    std::size_t samples = 0;
  };
  std::map<int, Sum> sums;
  for (const DepthViewError& error : errors) {
    Sum& sum = sums[static_cast<int>(std::lround(error.distance_m / kStep_m))];
    const auto n = static_cast<double>(error.samples);
    sum.z += n * error.distance_m;
    sum.before += n * error.before_rms_m * error.before_rms_m;
    sum.after += n * error.after_rms_m * error.after_rms_m;
    sum.noise += n * error.noise_m * error.noise_m;
    sum.samples += error.samples;
  }
  std::vector<DistanceError> gathered;
  for (const auto& [bin, sum] : sums) {
    const auto n = static_cast<double>(sum.samples);
    gathered.push_back({sum.z / n, sum.samples, std::sqrt(sum.before / n), std::sqrt(sum.after / n),
                        std::sqrt(sum.noise / n)});
  }
  return gathered;
}

}  // namespace hm
