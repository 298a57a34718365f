#include "hm/io/rgbd/tum_writer.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "hm/io/bytes/file_bytes.hpp"
#include "hm/io/bytes/output_file.hpp"
#include "hm/io/bytes/text_lines.hpp"
#include "hm/io/camera/camera_file.hpp"
#include "hm/io/image/image_file.hpp"
#include "hm/io/rgbd/carried_imu_file.hpp"

namespace hm {
namespace {

namespace fs = std::filesystem;

std::string pose_lines(const Trajectory& poses) {
  std::string text = "# timestamp tx ty tz qx qy qz qw\n";
  for (const StampedPose& pose : poses) {
    const Vec3& t = pose.T_world_base.translation();
    Eigen::Quaterniond q = pose.T_world_base.quaternion();
    if (q.w() < 0) q.coeffs() = -q.coeffs();
    text += fmt::format("{} {:.9f} {:.9f} {:.9f} {:.12f} {:.12f} {:.12f} {:.12f}\n", stamp_text(pose.stamp),
                        t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
  }
  return text;
}

/// Converts depths to another unit; 0 where they do not fit.
Image<std::uint16_t> in_units(const DepthImage& depth, double units_per_m) {
  const double factor = depth.unit_m * units_per_m;
  if (std::fabs(factor - 1.0) < 1e-9) return depth.units;
  Image<std::uint16_t> result(depth.width(), depth.height());
  std::ranges::transform(depth.units.pixels(), result.data(), [&](std::uint16_t units) {
    const double value = std::round(units * factor);
    return value < 65535.0 ? static_cast<std::uint16_t>(value) : std::uint16_t{0};
  });
  return result;
}

}  // namespace

struct TumWriter::Impl {
  fs::path folder;
  PinholeCamera camera;
  double units_per_m = 5000;
  Trajectory poses;
  std::optional<Trajectory> truth;
  std::optional<Trajectory> device;
  std::vector<ImuSample> imu;
  Mat3 R_camera_imu = Mat3::Identity();
  std::optional<Time> last_stamp, last_color_stamp;
  std::string depth_list = "# depth maps\n# timestamp filename\n";
  std::string color_list = "# color images\n# timestamp filename\n";
  std::string associations;
  std::vector<fs::path> images;
  bool finished = false;

  Result<void> add_color(const RgbdFrame& frame, const std::string& depth_name);
  /// Writes an image. Images are synced to disk together at the end, since syncing each would limit the frame
  /// rate.
  template <class Pixel>
  Result<void> write_picture(const std::string& name, const Image<Pixel>& image) {
    images.push_back(folder / name);
    return write_file_bytes(images.back(), encode_png(image, PngEffort::kFast), Durability::kLater);
  }
  Result<void> sync_images() const;
};

TumWriter::TumWriter(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
TumWriter::TumWriter(TumWriter&&) noexcept = default;
TumWriter& TumWriter::operator=(TumWriter&&) noexcept = default;
TumWriter::~TumWriter() = default;

Result<TumWriter> TumWriter::create(const fs::path& folder, const PinholeCamera& camera, double units_per_m) {
  HM_CHECK(units_per_m > 0, "units_per_m = {}", units_per_m);
  if (auto checked = check_camera(camera); !checked) return forward_error(checked);
  std::error_code ignored;
  for (const char* name : {"depth.txt", "rgb.txt", "depth", "rgb", "groundtruth.txt"})
    if (fs::exists(folder / name, ignored))
      return fail(ErrorCode::kUsage, folder, "there is a recording already ({}); choose another folder",
                  name);
  for (const fs::path& path : {folder / "depth", folder / "rgb"})
    if (auto made = make_folder(path); !made) return forward_error(made);
  auto impl = std::make_unique<Impl>();
  impl->folder = folder;
  impl->camera = camera;
  impl->units_per_m = units_per_m;
  return TumWriter(std::move(impl));
}

Result<void> TumWriter::Impl::add_color(const RgbdFrame& frame, const std::string& depth_name) {
  if (last_color_stamp && frame.color_stamp <= *last_color_stamp)
    return fail(ErrorCode::kInvalidValue, folder, "colour stamp {} does not increase",
                stamp_text(frame.color_stamp));
  const std::string stamp = stamp_text(frame.color_stamp);
  const std::string name = "rgb/" + stamp + ".png";
  if (auto written = write_picture(name, frame.color); !written) return written;
  last_color_stamp = frame.color_stamp;
  color_list += fmt::format("{} {}\n", stamp, name);
  associations += fmt::format("{} {} {} {}\n", stamp, name, stamp_text(frame.stamp), depth_name);
  return {};
}

Result<void> TumWriter::Impl::sync_images() const {
  std::vector<fs::path> all = images;
  for (const char* name : {"depth", "rgb"}) all.push_back(folder / name);
  for (const fs::path& path : all)
    if (const int failure = sync_to_disk(path); failure != 0)
      return fail(ErrorCode::kUnreadable, path, "cannot be written: {}",
                  std::generic_category().message(failure));
  return {};
}

Result<void> TumWriter::add(const RgbdFrame& frame) {
  Impl& self = *impl_;
  HM_CHECK(!self.finished, "add() after finish()");
  HM_CHECK(frame.depth.width() == self.camera.width && frame.depth.height() == self.camera.height, "{} x {}",
           frame.depth.width(), frame.depth.height());
  if (self.last_stamp && frame.stamp <= *self.last_stamp)
    return fail(ErrorCode::kInvalidValue, self.folder, "depth stamp {} does not increase",
                stamp_text(frame.stamp));
  const std::string stamp = stamp_text(frame.stamp);
  const std::string name = "depth/" + stamp + ".png";
  if (auto written = self.write_picture(name, in_units(frame.depth, self.units_per_m)); !written)
    return written;
  self.last_stamp = frame.stamp;
  self.depth_list += fmt::format("{} {}\n", stamp, name);
  if (frame.T_world_camera) self.poses.push_back({frame.stamp, *frame.T_world_camera});
  if (frame.color.empty()) return {};
  return self.add_color(frame, name);
}

void TumWriter::set_device_poses(Trajectory poses) { impl_->device = std::move(poses); }
void TumWriter::set_ground_truth(Trajectory poses) { impl_->truth = std::move(poses); }
void TumWriter::set_imu(std::vector<ImuSample> samples, const Mat3& R_camera_imu) {
  impl_->imu = std::move(samples);
  impl_->R_camera_imu = R_camera_imu;
}

Result<void> TumWriter::finish() {
  Impl& self = *impl_;
  HM_CHECK(!self.finished, "finish() twice");
  self.finished = true;
  if (auto synced = self.sync_images(); !synced) return synced;
  std::vector<std::pair<const char*, std::string>> files{
      {"camera.txt", camera_file_text(self.camera, self.units_per_m)},
      {"groundtruth.txt", pose_lines(self.truth ? *self.truth : self.poses)},
      {"rgb.txt", self.color_list},
      {"associations.txt", self.associations},
      {"depth.txt", self.depth_list}};
  if (self.device) files.emplace_back("poses.txt", pose_lines(*self.device));
  for (const auto& [name, text] : files)
    if (auto written = write_file_text(self.folder / name, text); !written) return written;
  if (self.imu.empty()) return {};
  return write_carried_imu(self.folder, self.imu, self.R_camera_imu);
}

}  // namespace hm
