#include "hm/pipeline/calibrate/depth_pose_set.hpp"

#include <algorithm>

#include "hm/depth_camera/lens_map.hpp"
#include "hm/io/bytes/file_name.hpp"
#include "hm/io/image/image_file.hpp"

namespace hm {
namespace {

namespace fs = std::filesystem;

constexpr double kDisparityUnit_m = 0.00025;  // depth from disparity is kept finer than in millimetres

bool is_color(const std::string& extension) {
  return extension == ".png" || extension == ".jpg" || extension == ".jpeg";
}
bool is_depth(const std::string& extension) { return extension == ".png" || extension == ".pgm"; }

DepthPoseFolder look_into(const fs::path& folder, std::string name) {
  DepthPoseFolder pose;
  pose.name = std::move(name);
  std::error_code code;
  for (const auto& entry : fs::directory_iterator(folder, code)) {
    const std::string file = entry.path().filename().string(), extension = lower_extension(entry.path());
    if (file.starts_with("depth") && is_depth(extension)) pose.depth.push_back(entry.path());
    if (file.starts_with("color") && is_color(extension)) pose.color = entry.path();
  }
  std::ranges::sort(pose.depth);
  return pose;
}

/// Poses of one image each, side by side: NAME-d.pgm with NAME-c1.jpg.
std::vector<DepthPoseFolder> side_by_side(const fs::path& folder, const std::string& prefix) {
  std::vector<DepthPoseFolder> poses;
  std::error_code code;
  for (const auto& entry : fs::directory_iterator(folder, code)) {
    const std::string stem = entry.path().stem().string();
    if (!stem.ends_with("-d") || !is_depth(lower_extension(entry.path()))) continue;
    const std::string name = stem.substr(0, stem.size() - 2);
    DepthPoseFolder pose{prefix + name, {}, {entry.path()}};
    for (const char* extension : {".jpg", ".jpeg", ".png"})
      if (const fs::path color = folder / (name + "-c1" + extension); fs::exists(color, code))
        pose.color = color;
    poses.push_back(std::move(pose));
  }
  return poses;
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
  if (poses.empty()) poses = side_by_side(folder, prefix);
  if (poses.empty())
    return fail(
        ErrorCode::kNotFound, folder,
        "no pose of a board in it: neither folders, each with color.png and depth*.png of the board held "
        "still, nor files NAME-c1.jpg and NAME-d.pgm");
  std::ranges::sort(poses, {}, &DepthPoseFolder::name);
  return poses;
}

Result<DepthImage> read_depth_of(const fs::path& path, const DepthReading& reading) {
  auto units = read_depth_image(path);
  if (!units) return forward_error(units);
  const auto largest = *std::ranges::max_element(units->pixels());
  if (!reading.disparity && largest == DisparityTable::kNone && lower_extension(path) == ".pgm")
    return fail(ErrorCode::kInvalidValue, path,
                "the largest value is {}, a Kinect's mark of no reading: this is raw disparity, not depth "
                "(--raw-disparity)",
                largest);
  if (!reading.disparity) return DepthImage{std::move(*units), 1 / reading.units_per_m};
  if (largest > DisparityTable::kNone)
    return fail(ErrorCode::kInvalidValue, path, "raw disparity has 11 bits, up to {}; this has {}",
                DisparityTable::kNone, largest);
  DisparityTable(*reading.disparity, kDisparityUnit_m).apply(*units);
  return DepthImage{std::move(*units), kDisparityUnit_m};
}

Result<DepthAverage> average_depth(const DepthPoseFolder& pose, const DepthReading& reading) {
  DepthAverage average;
  std::optional<LensMap> lens;
  const PinholeCamera* camera = reading.camera;
  for (const fs::path& path : pose.depth) {
    auto depth = read_depth_of(path, reading);
    if (!depth) return forward_error(depth);
    if (camera != nullptr && (depth->width() != camera->width || depth->height() != camera->height))
      return fail(ErrorCode::kInvalidValue, path, "is {} x {}, the calibration's depth camera {} x {}",
                  depth->width(), depth->height(), camera->width, camera->height);
    if (average.images() == 0) {
      average = DepthAverage(depth->width(), depth->height());
      if (camera != nullptr && !camera->distortion.is_zero()) lens.emplace(*camera);
    }
    if (depth->width() != average.width() || depth->height() != average.height())
      return fail(ErrorCode::kInvalidValue, path, "is {} x {}, the first is {} x {}", depth->width(),
                  depth->height(), average.width(), average.height());
    if (lens) depth->units = lens->undistort(depth->units);
    average.add(*depth);
  }
  return average;
}

}  // namespace hm
