#include "hm/io/laser/laser_rig_file.hpp"

#include <array>
#include <cmath>
#include <set>
#include <string>
#include <string_view>

#include "hm/core/angle.hpp"
#include "hm/geometry/se2.hpp"
#include "hm/io/bytes/output_file.hpp"
#include "hm/io/bytes/toml_reader_inl.hpp"

namespace hm {
namespace {

class RigReader : private TomlReader {
 public:
  explicit RigReader(const std::filesystem::path& path) : TomlReader(path) {}
  Result<LaserRig> read(const toml::table& file);

 private:
  Vec3 vector(const toml::table& table, std::string_view key);
  SE3 pose(const toml::table& table);
  BeamRange beams(const toml::table& table, std::string_view what);
  std::optional<LaserRig::Mirror> mirror(const toml::table& file, std::string_view key,
                                         const SE3& T_base_laser);
  void check_overlap(const LaserRig& rig, const toml::table& file);
};

Vec3 RigReader::vector(const toml::table& table, std::string_view key) {
  const toml::node* node = table.get(key);
  if (node == nullptr) return Vec3::Zero();
  const toml::array* list = node->as_array();
  Vec3 result = Vec3::Zero();
  bool right = list != nullptr && list->size() == 3;
  for (std::size_t i = 0; right && i < 3; ++i) {
    const auto number = list->get(i)->value<double>();
    right = number && std::isfinite(*number) && !list->get(i)->is_boolean();
    if (right) result[static_cast<Eigen::Index>(i)] = *number;
  }
  if (!right) mistake(node->source(), "`{}` takes three finite numbers", key);
  return result;
}

SE3 RigReader::pose(const toml::table& table) {
  return {rotation_from_roll_pitch_yaw(vector(table, "rpy_deg") * kRadiansPerDegree), vector(table, "xyz_m")};
}

BeamRange RigReader::beams(const toml::table& table, std::string_view what) {
  const toml::node* node = table.get("beams");
  if (node == nullptr) {
    mistake(table.source(), "[{}] needs `beams = [first, one past the last]`", what);
    return {};
  }
  const toml::array* list = node->as_array();
  std::array<std::int64_t, 2> ends{};
  bool right = list != nullptr && list->size() == 2;
  for (std::size_t i = 0; right && i < 2; ++i) {
    const auto* number = list->get(i)->as_integer();
    right = number != nullptr;
    if (right) ends[i] = number->get();
  }
  constexpr std::int64_t kMostBeams = 1'000'000;
  if (!right || ends[0] < 0 || ends[1] <= ends[0] || ends[1] > kMostBeams) {
    mistake(node->source(), "`beams` takes two whole numbers, the first beam and one past the last");
    return {};
  }
  return {static_cast<std::size_t>(ends[0]), static_cast<std::size_t>(ends[1])};
}

std::optional<LaserRig::Mirror> RigReader::mirror(const toml::table& file, std::string_view key,
                                                  const SE3& T_base_laser) {
  const toml::table* found = table(file, key, {"beams", "xyz_m", "rpy_deg"});
  if (found == nullptr) return std::nullopt;
  return LaserRig::Mirror{beams(*found, key), T_base_laser * pose(*found)};
}

void RigReader::check_overlap(const LaserRig& rig, const toml::table& file) {
  std::vector<BeamRange> ranges;
  if (rig.horizontal) ranges.push_back(*rig.horizontal);
  if (rig.down) ranges.push_back(rig.down->beams);
  if (rig.up) ranges.push_back(rig.up->beams);
  for (std::size_t i = 0; i < ranges.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      if (ranges[i].begin < ranges[j].end && ranges[j].begin < ranges[i].end)
        mistake(file.source(), "beams {} to {} and {} to {} overlap", ranges[j].begin, ranges[j].end,
                ranges[i].begin, ranges[i].end);
}

Result<LaserRig> RigReader::read(const toml::table& file) {
  LaserRig rig;
  check_keys(file, "", {"laser", "imu", "range", "horizontal", "down", "up"});
  if (const auto* laser = table(file, "laser", {"xyz_m", "rpy_deg"})) rig.T_base_laser = pose(*laser);
  if (const auto* imu = table(file, "imu", {"xyz_m", "rpy_deg"})) rig.T_base_imu = pose(*imu);
  if (const auto* range = table(file, "range", {"xyz_m", "rpy_deg"})) rig.T_base_range = pose(*range);
  if (const auto* horizontal = table(file, "horizontal", {"beams"}))
    rig.horizontal = beams(*horizontal, "horizontal");
  rig.down = mirror(file, "down", rig.T_base_laser);
  rig.up = mirror(file, "up", rig.T_base_laser);
  check_overlap(rig, file);
  if (error_) return tl::make_unexpected(*error_);
  return rig;
}

std::string pose_text(const SE3& pose) {
  const Vec3 rpy_deg = roll_pitch_yaw(pose.rotation()) / kRadiansPerDegree;
  const Vec3& t = pose.translation();
  return fmt::format("xyz_m = [{}, {}, {}]\nrpy_deg = [{}, {}, {}]\n", t.x(), t.y(), t.z(), rpy_deg.x(),
                     rpy_deg.y(), rpy_deg.z());
}

std::string beams_text(const BeamRange& beams) {
  return fmt::format("beams = [{}, {}]  # from the first to before the last\n", beams.begin, beams.end);
}

std::string mirror_text(std::string_view name, const LaserRig::Mirror& mirror, const SE3& T_base_laser) {
  return fmt::format("\n[{}]  # a mirror: its virtual laser in the laser's frame\n", name) +
         beams_text(mirror.beams) + pose_text(T_base_laser.inverse() * mirror.T_base_virtual_laser);
}

}  // namespace

Result<LaserRig> read_laser_rig(const std::filesystem::path& path) {
  const auto file = parse_toml_file(path);
  if (!file) return forward_error(file);
  return RigReader(path).read(*file);
}

Result<void> write_laser_rig(const std::filesystem::path& path, const LaserRig& rig) {
  std::string text = "# Where the sensors sit on the vehicle (base: x forward, y left, z up).\n[laser]\n" +
                     pose_text(rig.T_base_laser) + "\n[imu]\n" + pose_text(rig.T_base_imu);
  if (rig.T_base_range) text += "\n[range]  # looks along its own x axis\n" + pose_text(*rig.T_base_range);
  if (rig.horizontal) text += "\n[horizontal]\n" + beams_text(*rig.horizontal);
  if (rig.down) text += mirror_text("down", *rig.down, rig.T_base_laser);
  if (rig.up) text += mirror_text("up", *rig.up, rig.T_base_laser);
  OutputFile file(path);
  file.write(text);
  return file.finish();
}

}  // namespace hm
