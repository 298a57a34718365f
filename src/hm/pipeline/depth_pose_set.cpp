#include "hm/pipeline/depth_pose_set.hpp"

#include <algorithm>

#include "hm/io/file_name.hpp"
#include "hm/io/image_file.hpp"
#include "hm/io/lens_map.hpp"

namespace hm {
namespace {

namespace fs = std::filesystem;

DepthPoseFolder look_into(const fs::path& folder, std::string name) {
  DepthPoseFolder pose;
  pose.name = std::move(name);
  std::error_code code;
  for (const auto& entry : fs::directory_iterator(folder, code)) {
    const std::string file = entry.path().filename().string(), extension = lower_extension(entry.path());
    if (file.starts_with("depth") && extension == ".png") pose.depth.push_back(entry.path());
    if (file.starts_with("color") && (extension == ".png" || extension == ".jpg" || extension == ".jpeg"))
      pose.color = entry.path();
  }
  std::ranges::sort(pose.depth);
  return pose;
}

}  // namespace

Result<std::vector<DepthPoseFolder>> list_depth_poses(const fs::path& folder, const std::string& prefix) {
  std::error_code code;
  if (!fs::is_directory(folder, code)) return fail(ErrorCode::kNotFound, folder, "there is no such folder");
  std::vector<DepthPoseFolder> poses;
  for (const auto& entry : fs::directory_iterator(folder, code)) {
    if (!entry.is_directory(code)) continue;
    DepthPoseFolder pose = look_into(entry.path(), prefix + entry.path().filename().string());
    if (!pose.depth.empty()) poses.push_back(std::move(pose));
  }
  if (poses.empty())
    return fail(ErrorCode::kNotFound, folder,
                "no folder of a pose in it (each with color.png and depth*.png of the board, held still)");
  std::ranges::sort(poses, {}, &DepthPoseFolder::name);
  return poses;
}

Result<DepthAverage> average_depth(const DepthPoseFolder& pose, double units_per_m,
                                   const PinholeCamera* camera) {
  DepthAverage average;
  std::optional<LensMap> lens;
  for (const fs::path& path : pose.depth) {
    auto units = read_depth_picture(path);
    if (!units) return forward_error(units);
    if (camera != nullptr && (units->width() != camera->width || units->height() != camera->height))
      return fail(ErrorCode::kInvalidValue, path, "is {} x {}, the calibration's depth camera {} x {}",
                  units->width(), units->height(), camera->width, camera->height);
    if (average.images() == 0) {
      average = DepthAverage(units->width(), units->height());
      if (camera != nullptr && !camera->distortion.is_zero()) lens.emplace(*camera);
    }
    if (units->width() != average.width() || units->height() != average.height())
      return fail(ErrorCode::kInvalidValue, path, "is {} x {}, the first is {} x {}", units->width(),
                  units->height(), average.width(), average.height());
    average.add({lens ? lens->undistort(*units) : std::move(*units), 1 / units_per_m});
  }
  return average;
}

}  // namespace hm
