#include "hm/io/camera/camera_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "hm/core/text/counted.hpp"
#include "hm/io/bytes/text_lines.hpp"

namespace hm {
namespace {

struct Entry {
  double value = 0;
  std::size_t line = 0;
};
using Entries = std::map<std::string, Entry, std::less<>>;

constexpr std::array<std::string_view, 13> kKnownKeys{
    "width", "height", "fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "depth_scale", "rate_hz"};

/// First words of the names of TUM's recordings for each camera; parts and variants (`_part`, `_validation`,
/// `_with_person`) follow. fr3 is already undistorted.
constexpr std::array<std::string_view, 3> kTumSequences{
    "xyz rpy 360 floor desk desk2 room plant teddy",
    "xyz rpy 360_hemisphere 360_kidnap desk large_no_loop large_with_loop pioneer_360 pioneer_slam "
    "pioneer_slam2 pioneer_slam3 coke dishes flowerbouquet metallic_sphere metallic_sphere2",
    "long_office cabinet large_cabinet teddy nostructure structure sitting walking checkerboard"};
constexpr std::array<PinholeCamera, 3> kTumCameras{
    PinholeCamera{640, 480, 517.3, 516.5, 318.6, 255.3, {0.2624, -0.9531, -0.0054, 0.0026, 1.1633}},
    PinholeCamera{640, 480, 520.9, 521.0, 325.1, 249.7, {0.2312, -0.7849, -0.0033, -0.0001, 0.9172}},
    PinholeCamera{640, 480, 535.4, 539.2, 320.1, 247.6, {}}};

/// Splits `key value` at any separator, without a trailing comment.
std::vector<std::string> key_and_value(std::string_view line) {
  std::string plain(line.substr(0, line.find('#')));
  std::ranges::replace_if(
      plain, [](char c) { return c == '=' || c == ':' || c == ','; }, ' ');
  std::vector<std::string> result;
  for (const std::string_view word : words(plain)) result.emplace_back(word);
  return result;
}

Result<Entries> read_entries(const TextFile& file, std::vector<std::string>& unknown_keys) {
  Entries entries;
  for (const TextLine& line : file.lines()) {
    const std::vector<std::string> word = key_and_value(line.text);
    if (word.empty()) continue;
    if (std::ranges::find(kKnownKeys, word[0]) == kKnownKeys.end()) {
      unknown_keys.push_back(word[0]);
      continue;
    }
    if (word.size() != 2)
      return fail(ErrorCode::kCorrupted, file.where(line), "expected `{} number`, found `{}`", word[0],
                  line.text);
    const auto value = parse_number(word[1]);
    if (!value || !std::isfinite(*value))
      return fail(ErrorCode::kInvalidValue, file.where(line), "{}: `{}` is not a number", word[0], word[1]);
    const auto [place, is_new] = entries.insert({word[0], {*value, line.number}});
    if (!is_new && place->second.value != *value)
      return fail(ErrorCode::kCorrupted, file.where(line), "{} was {} in line {}", word[0],
                  place->second.value, place->second.line);
  }
  return entries;
}

Result<void> check_needed(const Entries& entries, const std::string& where) {
  std::string missing;
  for (const std::string_view key : {"fx", "fy", "cx", "cy"})
    if (!entries.contains(key)) missing += missing.empty() ? std::string(key) : ", " + std::string(key);
  if (!missing.empty())
    return fail(ErrorCode::kCorrupted, where, "{} missing: write one `key value` a line, as `fx 525`",
                missing);
  return {};
}

/// The numbers of a file that holds nothing else, without names; empty for another file.
std::vector<double> bare_numbers(const TextFile& file) {
  std::vector<double> numbers;
  for (const TextLine& line : file.lines())
    for (const std::string& word : key_and_value(line.text)) {
      const auto value = parse_number(word);
      if (!value) return {};
      numbers.push_back(*value);
    }
  return numbers;
}

/// fx fy cx cy, or a camera matrix.
Result<CameraFile> camera_of_numbers(const std::vector<double>& numbers, const std::filesystem::path& path) {
  CameraFile file;
  if (numbers.size() == 4) {
    file.camera.fx = numbers[0], file.camera.fy = numbers[1];
    file.camera.cx = numbers[2], file.camera.cy = numbers[3];
    if (auto checked = check_intrinsics(file.camera, path); !checked) return forward_error(checked);
    return file;
  }
  if (numbers.size() != 9 && numbers.size() != 16)
    return fail(
        ErrorCode::kCorrupted, path,
        "{} without names, where fx fy cx cy alone, or a 3x3 matrix, would do: write one `key value` a "
        "line, as `fx 525` (also width, height, k1, k2, p1, p2, k3, depth_scale)",
        counted(numbers.size(), "number"));
  const auto camera = camera_of_matrix(numbers, path);
  if (!camera) return forward_error(camera);
  file.camera = *camera;
  return file;
}

}  // namespace

Result<void> check_intrinsics(PinholeCamera camera, const std::string& where) {
  if (camera.width == 0 && camera.height == 0) camera.width = camera.height = 1;
  auto checked = check_camera(camera);
  if (!checked) checked.error().where = where;
  return checked;
}

bool is_image_size(double pixels) { return pixels >= 1 && pixels <= 32768 && pixels == std::floor(pixels); }

Result<void> check_depth_scale(double units_per_m, const std::string& where, std::string_view name) {
  constexpr double kMost = 1e6;
  if (units_per_m >= 1 && units_per_m <= kMost) return {};
  if (units_per_m < 1 && units_per_m * kMost >= 1)
    return fail(ErrorCode::kInvalidValue, where,
                "{} {} looks like metres per unit: write {:.6g} (units per metre)", name, units_per_m,
                1 / units_per_m);
  return fail(ErrorCode::kInvalidValue, where, "{} {} cannot be right: 1 to 1e6 units per metre", name,
              units_per_m);
}

Result<void> check_given_depth_scale(double units_per_m) {
  auto checked = check_depth_scale(units_per_m, "--depth-units-per-m", "the value");
  if (!checked) checked.error().code = ErrorCode::kUsage;
  return checked;
}

Result<CameraFile> read_camera_file(const std::filesystem::path& path) {
  const auto text = TextFile::read(path);
  if (!text) return forward_error(text);
  if (const auto numbers = bare_numbers(*text); !numbers.empty()) return camera_of_numbers(numbers, path);
  CameraFile file;
  const auto entries = read_entries(*text, file.unknown_keys);
  if (!entries) return forward_error(entries);
  if (auto complete = check_needed(*entries, path); !complete) return forward_error(complete);
  const auto number = [&](std::string_view key) -> std::optional<double> {
    const auto found = entries->find(key);
    return found == entries->end() ? std::nullopt : std::optional(found->second.value);
  };
  const auto where = [&](std::string_view key) {
    return fmt::format("{}:{}", text->where(), entries->find(key)->second.line);
  };
  for (const std::string_view key : {"width", "height"})
    if (const auto size = number(key); size && !is_image_size(*size))
      return fail(ErrorCode::kInvalidValue, where(key), "{} = {} cannot be right", key, *size);
  if (const auto rate_hz = number("rate_hz"); rate_hz && !(*rate_hz >= 1e-3 && *rate_hz <= 1e6))
    return fail(ErrorCode::kInvalidValue, where("rate_hz"), "rate_hz = {} cannot be right", *rate_hz);
  if (const auto scale = number("depth_scale"))
    if (auto checked = check_depth_scale(*scale, where("depth_scale"), "depth_scale"); !checked)
      return forward_error(checked);
  PinholeCamera& c = file.camera;
  c.width = static_cast<int>(number("width").value_or(0));
  c.height = static_cast<int>(number("height").value_or(0));
  c.fx = *number("fx"), c.fy = *number("fy"), c.cx = *number("cx"), c.cy = *number("cy");
  c.distortion = {number("k1").value_or(0), number("k2").value_or(0), number("p1").value_or(0),
                  number("p2").value_or(0), number("k3").value_or(0)};
  if (auto checked = check_intrinsics(c, path); !checked) return forward_error(checked);
  file.depth_units_per_m = number("depth_scale");
  file.rate_hz = number("rate_hz");
  return file;
}

Result<PinholeCamera> camera_of_matrix(std::span<const double> matrix, const std::filesystem::path& where) {
  if (matrix.size() != 9 && matrix.size() != 16)
    return fail(ErrorCode::kCorrupted, where, "expected a 3x3 or 4x4 matrix, found {} numbers",
                matrix.size());
  const auto side = static_cast<Eigen::Index>(matrix.size() == 9 ? 3 : 4);
  const Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> K(
      matrix.data(), side, side);
  PinholeCamera camera;
  camera.fx = K(0, 0), camera.fy = K(1, 1), camera.cx = K(0, 2), camera.cy = K(1, 2);
  Eigen::MatrixXd shape = Eigen::MatrixXd::Identity(side, side);
  shape.topLeftCorner<2, 3>() << camera.fx, K(0, 1), camera.cx, 0, camera.fy, camera.cy;
  if (K != shape) return fail(ErrorCode::kCorrupted, where, "a camera matrix is fx 0 cx, 0 fy cy, 0 0 1");
  if (auto checked = check_intrinsics(camera, where); !checked) return forward_error(checked);
  return camera;
}

Result<PinholeCamera> read_intrinsics_matrix(const std::filesystem::path& path) {
  const auto text = TextFile::read(path);
  if (!text) return forward_error(text);
  std::vector<double> k;
  for (const TextLine& line : text->lines()) {
    for (const std::string_view word : words(line.text)) {
      const auto value = parse_number(word);
      if (!value || !std::isfinite(*value))
        return fail(ErrorCode::kCorrupted, text->where(line), "`{}` is not a number", word);
      k.push_back(*value);
    }
  }
  return camera_of_matrix(k, path);
}

std::string camera_file_text(const PinholeCamera& c, double depth_units_per_m) {
  const LensDistortion& d = c.distortion;
  return fmt::format(
      "# pinhole camera, pixels; depth_scale is the number in a depth image that stands for one metre\n"
      "width {}\nheight {}\nfx {}\nfy {}\ncx {}\ncy {}\nk1 {}\nk2 {}\np1 {}\np2 {}\nk3 {}\ndepth_scale {}\n",
      c.width, c.height, c.fx, c.fy, c.cx, c.cy, d.k1, d.k2, d.p1, d.p2, d.k3, depth_units_per_m);
}

std::optional<PinholeCamera> known_tum_camera(std::string_view recording) {
  std::string name(recording);
  std::ranges::transform(name, name.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  std::string_view rest = name;
  const auto skip = [&rest](std::string_view word) {
    const bool found = rest.starts_with(word);
    if (found) rest.remove_prefix(word.size());
    return found;
  };
  if (!skip("rgbd_dataset_")) skip("tum_");
  if (!skip("freiburg") && !skip("fr")) return std::nullopt;
  const std::size_t number = rest.empty() ? kTumSequences.size() : static_cast<std::size_t>(rest[0] - '1');
  if (number >= kTumSequences.size() || rest.size() < 2 || (rest[1] != '_' && rest[1] != '-'))
    return std::nullopt;
  rest.remove_prefix(2);
  const std::vector<std::string_view> known = words(kTumSequences[number]);
  const auto is_rest = [rest](std::string_view sequence) {
    return rest.starts_with(sequence) &&
           (rest.size() == sequence.size() ||
            std::string_view("_-.").find(rest[sequence.size()]) != std::string_view::npos);
  };
  if (std::ranges::none_of(known, is_rest)) return std::nullopt;
  return kTumCameras[number];
}

std::optional<PinholeCamera> known_bonn_camera(std::string_view recording) {
  if (!recording.starts_with("rgbd_bonn_")) return std::nullopt;
  return PinholeCamera{
      640, 480, 542.822841, 542.57687, 315.59352, 237.756098, {0.039903, -0.099343, -0.00073, -0.000144, 0}};
}

}  // namespace hm
