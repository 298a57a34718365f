#include "hm/io/rgbd/tum_writer.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "hm/io/bytes/append_file.hpp"
#include "hm/io/bytes/file_bytes.hpp"
#include "hm/io/bytes/output_file.hpp"
#include "hm/io/bytes/text_lines.hpp"
#include "hm/io/camera/camera_file.hpp"
#include "hm/io/image/image_file.hpp"
#include "hm/io/lists/stamped_list.hpp"
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

std::string depth_name(const RgbdFrame& frame) { return "depth/" + stamp_text(frame.stamp) + ".png"; }
std::string color_name(const RgbdFrame& frame) { return "rgb/" + stamp_text(frame.color_stamp) + ".png"; }

/// One of the lists of images: kept until the end, or a file that grows.
struct GrowingList {
  std::string text;
  std::optional<AppendFile> file;

  Result<void> add(const std::string& line) {
    if (!file) {
      text += line;
      return {};
    }
    file->append({reinterpret_cast<const std::uint8_t*>(line.data()), line.size()});
    return file->flush();
  }
};

/// Opens a list to append to, after its last whole line; `last` becomes its last stamp.
Result<void> open_list(const fs::path& path, GrowingList& list, std::optional<Time>& last) {
  std::error_code code;
  if (!fs::exists(path, code)) {
    auto file = AppendFile::create(path);
    if (!file) return forward_error(file);
    list.file.emplace(std::move(*file));
    return list.add(std::exchange(list.text, {}));
  }
  const auto bytes = read_file_bytes(path);
  if (!bytes) return forward_error(bytes);
  const auto end = std::find(bytes->rbegin(), bytes->rend(), std::uint8_t{'\n'});
  auto file = AppendFile::continue_at(path, static_cast<std::uint64_t>(bytes->rend() - end));
  if (!file) return forward_error(file);
  list.file.emplace(std::move(*file));
  const auto images = detail::read_image_list(path);
  if (!images) return forward_error(images);
  if (!images->images.empty()) last = images->images.back().stamp;
  return {};
}

/// Writes camera.txt, or checks that the one that is there says the same.
Result<void> settle_camera(const fs::path& folder, const std::string& text) {
  const fs::path path = folder / "camera.txt";
  std::error_code code;
  if (!fs::exists(folder / "depth.txt", code)) return write_file_text(path, text);
  const auto bytes = read_file_bytes(path);
  if (!bytes) return forward_error(bytes);
  if (std::equal(bytes->begin(), bytes->end(), text.begin(), text.end())) return {};
  return fail(ErrorCode::kUsage, path, "the recording that is to be continued is of another camera");
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
  GrowingList depth_list{"# depth maps\n# timestamp filename\n", {}};
  GrowingList color_list{"# color images\n# timestamp filename\n", {}};
  std::string associations;
  std::vector<fs::path> images;  ///< not synced to disk yet
  bool finished = false;

  /// Makes the folders.
  static Result<std::unique_ptr<Impl>> make(const fs::path& folder, const PinholeCamera& camera,
                                            double units_per_m);
  [[nodiscard]] bool is_growing() const { return depth_list.file.has_value(); }
  Result<void> add_color(const RgbdFrame& frame, PngEffort effort);
  /// Writes an image. Images are synced to disk together at the end, since syncing each would limit the frame
  /// rate.
  template <class Pixel>
  Result<void> write_picture(const std::string& name, const Image<Pixel>& image, PngEffort effort) {
    images.push_back(folder / name);
    return write_file_bytes(images.back(), encode_png(image, effort), Durability::kLater);
  }
};

TumWriter::TumWriter(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
TumWriter::TumWriter(TumWriter&&) noexcept = default;
TumWriter& TumWriter::operator=(TumWriter&&) noexcept = default;
TumWriter::~TumWriter() = default;

Result<std::unique_ptr<TumWriter::Impl>> TumWriter::Impl::make(const fs::path& folder,
                                                               const PinholeCamera& camera,
                                                               double units_per_m) {
  HM_CHECK(units_per_m > 0, "units_per_m = {}", units_per_m);
  if (auto checked = check_camera(camera); !checked) return forward_error(checked);
  for (const fs::path& path : {folder / "depth", folder / "rgb"})
    if (auto made = make_folder(path); !made) return forward_error(made);
  auto impl = std::make_unique<Impl>();
  impl->folder = folder;
  impl->camera = camera;
  impl->units_per_m = units_per_m;
  return impl;
}

Result<TumWriter> TumWriter::create(const fs::path& folder, const PinholeCamera& camera, double units_per_m) {
  std::error_code ignored;
  for (const char* name : {"depth.txt", "rgb.txt", "depth", "rgb", "groundtruth.txt"})
    if (fs::exists(folder / name, ignored))
      return fail(ErrorCode::kUsage, folder, "there is a recording already ({}); choose another folder",
                  name);
  auto impl = Impl::make(folder, camera, units_per_m);
  if (!impl) return forward_error(impl);
  return TumWriter(std::move(*impl));
}

Result<TumWriter> TumWriter::append(const fs::path& folder, const PinholeCamera& camera, double units_per_m) {
  auto made = Impl::make(folder, camera, units_per_m);
  if (!made) return forward_error(made);
  Impl& impl = **made;
  auto opened = settle_camera(folder, camera_file_text(camera, units_per_m));
  if (opened) opened = open_list(folder / "rgb.txt", impl.color_list, impl.last_color_stamp);
  if (opened) opened = open_list(folder / "depth.txt", impl.depth_list, impl.last_stamp);
  if (!opened) return forward_error(opened);
  return TumWriter(std::move(*made));
}

std::optional<Time> TumWriter::last_stamp() const { return impl_->last_stamp; }

Result<void> TumWriter::Impl::add_color(const RgbdFrame& frame, PngEffort effort) {
  // A kill between the lines of the two lists has left this one.
  const bool is_listed = is_growing() && last_color_stamp == frame.color_stamp;
  if (last_color_stamp && frame.color_stamp <= *last_color_stamp && !is_listed)
    return fail(ErrorCode::kInvalidValue, folder, "colour stamp {} does not increase",
                stamp_text(frame.color_stamp));
  const std::string stamp = stamp_text(frame.color_stamp), name = color_name(frame);
  if (auto written = write_picture(name, frame.color, effort); !written) return written;
  last_color_stamp = frame.color_stamp;
  if (is_listed) return {};
  if (!is_growing())
    associations += fmt::format("{} {} {} {}\n", stamp, name, stamp_text(frame.stamp), depth_name(frame));
  return color_list.add(fmt::format("{} {}\n", stamp, name));
}

/// With the folders, whose entries are new.
std::vector<fs::path> TumWriter::take_unsynced() {
  std::vector<fs::path> all = std::exchange(impl_->images, {});
  if (!all.empty())
    for (const char* name : {"depth", "rgb"}) all.push_back(impl_->folder / name);
  if (impl_->is_growing())
    for (const char* name : {"rgb.txt", "depth.txt"}) all.push_back(impl_->folder / name);
  return all;
}

Result<void> sync_files(const std::vector<fs::path>& paths) {
  for (const fs::path& path : paths)
    if (const int failure = sync_to_disk(path); failure != 0)
      return fail(ErrorCode::kUnreadable, path, "cannot be written: {}",
                  std::generic_category().message(failure));
  return {};
}

Result<void> TumWriter::add(const RgbdFrame& frame, PngEffort effort) {
  Impl& self = *impl_;
  HM_CHECK(!self.finished, "add() after finish()");
  HM_CHECK(frame.depth.width() == self.camera.width && frame.depth.height() == self.camera.height, "{} x {}",
           frame.depth.width(), frame.depth.height());
  if (self.last_stamp && frame.stamp <= *self.last_stamp)
    return fail(ErrorCode::kInvalidValue, self.folder, "depth stamp {} does not increase",
                stamp_text(frame.stamp));
  const std::string name = depth_name(frame);
  if (auto written = self.write_picture(name, in_units(frame.depth, self.units_per_m), effort); !written)
    return written;
  self.last_stamp = frame.stamp;
  if (frame.T_world_camera) self.poses.push_back({frame.stamp, *frame.T_world_camera});
  if (!frame.color.empty())
    if (auto written = self.add_color(frame, effort); !written) return written;
  return self.depth_list.add(fmt::format("{} {}\n", stamp_text(frame.stamp), name));
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
  if (auto synced = sync_files(take_unsynced()); !synced || self.is_growing()) return synced;
  std::vector<std::pair<const char*, std::string>> files{
      {"camera.txt", camera_file_text(self.camera, self.units_per_m)},
      {"groundtruth.txt", pose_lines(self.truth ? *self.truth : self.poses)},
      {"rgb.txt", self.color_list.text},
      {"associations.txt", self.associations},
      {"depth.txt", self.depth_list.text}};
  if (self.device) files.emplace_back("poses.txt", pose_lines(*self.device));
  for (const auto& [name, text] : files)
    if (auto written = write_file_text(self.folder / name, text); !written) return written;
  if (self.imu.empty()) return {};
  return write_carried_imu(self.folder, self.imu, self.R_camera_imu);
}

Result<RgbdFrame> read_written_depth(const fs::path& folder, const RgbdFrame& written) {
  RgbdFrame frame;
  frame.stamp = written.stamp;
  frame.color_stamp = written.color_stamp;
  auto depth = read_depth_image(folder / depth_name(written));
  if (!depth) return forward_error(depth);
  frame.depth = {std::move(*depth), written.depth.unit_m};
  return frame;
}

Result<RgbdFrame> read_written_frame(const fs::path& folder, const RgbdFrame& written) {
  auto frame = read_written_depth(folder, written);
  if (!frame) return frame;
  auto color = read_color_image(folder / color_name(written));
  if (!color) return forward_error(color);
  frame->color = std::move(*color);
  return frame;
}

}  // namespace hm
