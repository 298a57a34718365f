#include "hm/io/rgbd/carried_imu_file.hpp"

#include <array>
#include <cmath>

#include "hm/core/angle.hpp"
#include "hm/geometry/se2.hpp"
#include "hm/io/bytes/input_file.hpp"
#include "hm/io/bytes/output_file.hpp"
#include "hm/io/bytes/text_lines.hpp"
#include "hm/io/bytes/toml_reader_inl.hpp"
#include "hm/io/laser/laser_readers.hpp"

namespace hm {
namespace {

namespace fs = std::filesystem;

class MountReader : private TomlReader {
 public:
  explicit MountReader(const fs::path& path) : TomlReader(path) {}

  Result<Mat3> read(const toml::table& file) {
    check_keys(file, "", {"imu"});
    Vec3 rpy_deg = Vec3::Zero();
    if (const toml::table* imu = table(file, "imu", {"rpy_deg"});
        imu != nullptr && imu->contains("rpy_deg")) {
      const toml::array* list = imu->get("rpy_deg")->as_array();
      bool right = list != nullptr && list->size() == 3;
      for (std::size_t i = 0; right && i < 3; ++i) {
        const auto number = list->get(i)->value<double>();
        right = number && std::isfinite(*number);
        if (right) rpy_deg[static_cast<Eigen::Index>(i)] = *number;
      }
      if (!right) mistake(imu->get("rpy_deg")->source(), "`rpy_deg` takes three finite numbers");
    }
    if (error_) return tl::unexpected(*error_);
    return rotation_from_roll_pitch_yaw(rpy_deg * kRadiansPerDegree);
  }
};

Result<Mat3> read_mount(const fs::path& path) {
  if (!is_file(path)) return Mat3(Mat3::Identity());
  const auto file = parse_toml_file(path);
  if (!file) return forward_error(file);
  return MountReader(path).read(*file);
}

Result<CarriedImu> read_csv(const fs::path& path, const fs::path& mount) {
  const auto R_camera_imu = read_mount(mount);
  if (!R_camera_imu) return forward_error(R_camera_imu);
  auto recording = detail::read_euroc_folder(path);
  if (!recording) return forward_error(recording);
  CarriedImu imu{std::move(recording->imu), true, path.filename().string()};
  for (ImuSample& sample : imu.samples) {
    sample.angular_velocity_rad_s = *R_camera_imu * sample.angular_velocity_rad_s;
    sample.specific_force_m_s2 = *R_camera_imu * sample.specific_force_m_s2;
  }
  return imu;
}

/// Reads seconds and three components. An unterminated last line may be truncated; lines whose stamps do not
/// increase are skipped.
Result<CarriedImu> read_accelerometer(const fs::path& path) {
  const auto file = TextFile::read(path);
  if (!file) return forward_error(file);
  CarriedImu imu{{}, false, path.filename().string()};
  for (const TextLine& line : file->lines()) {
    const auto columns = words(line.text);
    const auto stamp = columns.size() == 4 ? parse_stamp(columns[0]) : std::nullopt;
    Vec3 kinect = Vec3::Constant(NAN);
    for (std::size_t i = 0; stamp && i < 3; ++i)
      kinect[static_cast<Eigen::Index>(i)] = parse_number(columns[i + 1]).value_or(NAN);
    if (!kinect.allFinite()) {
      if (!line.ended) break;
      return fail(ErrorCode::kCorrupted, file->where(line), "is not a stamp and three accelerations");
    }
    const Vec3 force(-kinect.x(), -kinect.y(), kinect.z());
    const bool repeats = !imu.samples.empty() && (imu.samples.back().specific_force_m_s2 == force ||
                                                  *stamp <= imu.samples.back().stamp);
    if (!repeats) imu.samples.push_back({*stamp, Vec3::Zero(), force, {}});
  }
  return imu;
}

}  // namespace

Result<std::optional<CarriedImu>> read_carried_imu(const fs::path& folder) {
  const auto found = [](Result<CarriedImu> imu) -> Result<std::optional<CarriedImu>> {
    if (!imu) return forward_error(imu);
    return imu->samples.empty() ? std::optional<CarriedImu>() : std::optional(std::move(*imu));
  };
  for (const char* name : {"imu.csv", "imu0.csv", "imu0/data.csv", "mav0/imu0/data.csv"})
    if (is_file(folder / name)) return found(read_csv(folder / name, folder / "imu.toml"));
  if (is_file(folder / "accelerometer.txt")) return found(read_accelerometer(folder / "accelerometer.txt"));
  return std::optional<CarriedImu>();
}

Result<void> write_carried_imu(const fs::path& folder, const std::vector<ImuSample>& samples,
                               const Mat3& R_camera_imu) {
  std::string text =
      "#timestamp [ns],w_x [rad s^-1],w_y [rad s^-1],w_z [rad s^-1],a_x [m s^-2],a_y [m s^-2],a_z [m s^-2]\n";
  for (const ImuSample& sample : samples) {
    const Vec3 &w = sample.angular_velocity_rad_s, &a = sample.specific_force_m_s2;
    text += fmt::format("{},{:.9f},{:.9f},{:.9f},{:.9f},{:.9f},{:.9f}\n", sample.stamp.ns, w.x(), w.y(),
                        w.z(), a.x(), a.y(), a.z());
  }
  if (auto written = write_file_text(folder / "imu.csv", text); !written) return written;
  const Vec3 rpy_deg = roll_pitch_yaw(R_camera_imu) / kRadiansPerDegree;
  return write_file_text(folder / "imu.toml",
                         fmt::format("# how the device's frame is turned in the camera's (x right, y down, z "
                                     "forward)\n[imu]\nrpy_deg = [{:.9f}, {:.9f}, {:.9f}]\n",
                                     rpy_deg.x(), rpy_deg.y(), rpy_deg.z()));
}

Result<void> write_carried_imu(const fs::path& folder, const CarriedImu& imu) {
  if (imu.has_gyroscope) return write_carried_imu(folder, imu.samples, Mat3::Identity());
  std::string text = "# timestamp ax ay az\n";
  for (const ImuSample& sample : imu.samples) {
    const Vec3& force = sample.specific_force_m_s2;
    text +=
        fmt::format("{} {:.9f} {:.9f} {:.9f}\n", stamp_text(sample.stamp), -force.x(), -force.y(), force.z());
  }
  return write_file_text(folder / "accelerometer.txt", text);
}

}  // namespace hm
