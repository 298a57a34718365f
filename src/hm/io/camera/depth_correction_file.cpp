#include <bit>
#include <cstring>

#include "hm/core/hash.hpp"
#include "hm/io/bytes/byte_cursor.hpp"
#include "hm/io/bytes/file_bytes.hpp"
#include "hm/io/camera/calibration_file.hpp"

namespace hm {
namespace {

constexpr std::string_view kMagic = "HMDEPTH1";
constexpr std::size_t kMostBytes = std::size_t{1} << 30;

class CorrectionBytes {
 public:
  void add(std::string_view text) { bytes_.insert(bytes_.end(), text.begin(), text.end()); }
  template <class T>
  void add(T value) {
    static_assert(std::is_arithmetic_v<T> && std::endian::native == std::endian::little);
    add_raw(&value, sizeof value);
  }
  void add(const std::vector<float>& values) { add_raw(values.data(), values.size() * sizeof(float)); }
  [[nodiscard]] const std::vector<std::uint8_t>& all() const { return bytes_; }

 private:
  void add_raw(const void* from, std::size_t count) {
    const auto* begin = static_cast<const std::uint8_t*>(from);
    bytes_.insert(bytes_.end(), begin, begin + count);
  }
  std::vector<std::uint8_t> bytes_;
};

std::vector<float> read_floats(detail::ByteCursor& cursor, std::size_t count) {
  const auto bytes = cursor.take(count * sizeof(float));
  std::vector<float> values(bytes.size() / sizeof(float));
  if (!values.empty()) std::memcpy(values.data(), bytes.data(), values.size() * sizeof(float));
  return values;
}

}  // namespace

Result<DepthCorrectionModel> read_depth_correction(const std::filesystem::path& path) {
  const auto bytes = read_file_bytes(path, kMostBytes);
  if (!bytes) return forward_error(bytes);
  const std::span<const std::uint8_t> all(*bytes);
  if (all.size() < kMagic.size() + 8 || std::memcmp(all.data(), kMagic.data(), kMagic.size()) != 0)
    return fail(ErrorCode::kCorrupted, path, "this is no depth correction (it does not begin with {})",
                kMagic);
  std::uint64_t stored = 0;
  std::memcpy(&stored, all.data() + all.size() - 8, 8);
  if (stored != fnv1a(all.first(all.size() - 8)))
    return fail(ErrorCode::kCorrupted, path, "the checksum of the {} bytes is wrong: damaged, or cut off",
                all.size());
  detail::ByteCursor cursor(all.subspan(kMagic.size(), all.size() - kMagic.size() - 8));
  DepthCorrectionModel model;
  const auto mode = cursor.value<std::int32_t>();
  if (mode < 0 || mode >= static_cast<std::int32_t>(std::size(kDepthFitModeNames)))
    return fail(ErrorCode::kUnsupported, path, "kind {} of depth correction is not known", mode);
  model.mode = static_cast<DepthFitMode>(mode);
  for (int* number : {&model.width, &model.height, &model.columns, &model.rows, &model.terms})
    *number = cursor.value<std::int32_t>();
  model.min_depth_m = cursor.value<double>();
  model.max_depth_m = cursor.value<double>();
  // Sizes are checked against the number of bytes.
  const auto plane = static_cast<std::uint64_t>(static_cast<std::uint32_t>(model.columns)) *
                     static_cast<std::uint32_t>(model.rows);
  const auto planes = static_cast<std::uint64_t>(static_cast<std::uint32_t>(model.terms)) +
                      (model.mode == DepthFitMode::kSpline ? 0 : 2);
  if (!cursor.ok() || planes > 8 || plane > kMostBytes ||
      plane * planes * sizeof(float) != cursor.remaining())
    return fail(ErrorCode::kCorrupted, path, "its size does not fit the grid of {} x {} x {}", model.columns,
                model.rows, model.terms);
  model.coefficients = read_floats(cursor, plane * static_cast<std::uint64_t>(model.terms));
  if (model.mode != DepthFitMode::kSpline) {
    model.lowest_s = read_floats(cursor, plane);
    model.highest_s = read_floats(cursor, plane);
  }
  if (auto checked = check_model(model); !checked) {
    checked.error().where = path;
    return forward_error(checked);
  }
  return model;
}

Result<void> write_depth_correction(const std::filesystem::path& path, const DepthCorrectionModel& model) {
  if (const auto checked = check_model(model); !checked)
    return fail(ErrorCode::kInvalidValue, path, "{}", checked.error().message);
  CorrectionBytes bytes;
  bytes.add(kMagic);
  bytes.add(static_cast<std::int32_t>(model.mode));
  for (const int number : {model.width, model.height, model.columns, model.rows, model.terms})
    bytes.add(static_cast<std::int32_t>(number));
  bytes.add(model.min_depth_m);
  bytes.add(model.max_depth_m);
  bytes.add(model.coefficients);
  bytes.add(model.lowest_s);
  bytes.add(model.highest_s);
  bytes.add(fnv1a(bytes.all()));
  return write_file_bytes(path, bytes.all());
}

}  // namespace hm
