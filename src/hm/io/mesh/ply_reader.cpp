#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hm/io/mesh/mesh_formats.hpp"
#include "hm/io/mesh/ply_header.hpp"

namespace hm {
namespace {

class PlyReader {
 public:
  explicit PlyReader(InputFile& file) : file_(file) {}

  Result<TriangleMesh> read() {
    auto header = read_ply_header(file_);
    if (!header) return forward_error(header);
    header_ = std::move(*header);
    for (const PlyElement& element : header_.elements) {
      if (const auto fits = check_count(element); !fits) return forward_error(fits);
      Result<void> done;
      if (element.name == "vertex")
        done = read_vertices(element);
      else if (element.name == "face")
        done = read_faces(element);
      else if (element.name == "tristrips")
        return fail(ErrorCode::kUnsupported, file_.name(), "triangle strips");
      else
        done = skip(element);
      if (!done) return forward_error(done);
    }
    for (const auto& triangle : mesh_.triangles)
      for (const std::uint32_t index : triangle)
        if (index >= mesh_.vertices.size())
          return fail(ErrorCode::kCorrupted, file_.name(), "a face names vertex {} of {}", index,
                      mesh_.vertices.size());
    return std::move(mesh_);
  }

 private:
  [[nodiscard]] std::string here() const {
    return header_.encoding == PlyEncoding::kAscii ? file_.at_line() : file_.at_byte();
  }
  [[nodiscard]] tl::unexpected<Error> ended(const PlyElement& element, std::uint64_t index) const {
    return fail(ErrorCode::kTruncated, here(), "the file ends within {} {} of {}", element.name, index,
                element.count);
  }

  /// The rest of the file must be able to hold the element, before memory is set aside for it.
  Result<void> check_count(const PlyElement& element) const {
    std::uint64_t bytes_each = 0;
    for (const PlyProperty& property : element.properties) {
      const std::size_t binary = size_of(property.count_type.value_or(property.type));
      bytes_each += header_.encoding == PlyEncoding::kAscii ? 2 : binary;
    }
    const std::uint64_t most = bytes_each == 0 ? 0 : (file_.remaining() + 1) / bytes_each;
    if (element.count > most)
      return fail(ErrorCode::kTruncated, here(), "{} x {} do not fit in the {} bytes left", element.count,
                  element.name, file_.remaining());
    return {};
  }

  /// Makes the next element's values readable: in ascii files, its line.
  bool next_record() {
    if (header_.encoding != PlyEncoding::kAscii) return true;
    do {
      if (!file_.read_line(rest_)) return false;
    } while (rest_.find_first_not_of(" \t") == std::string_view::npos);
    return true;
  }

  std::optional<double> next_value(PlyScalar type) {
    if (header_.encoding != PlyEncoding::kAscii) return next_binary(type);
    const std::size_t begin = rest_.find_first_not_of(" \t");
    if (begin == std::string_view::npos) return std::nullopt;
    rest_.remove_prefix(begin);
    if (rest_.front() == '+') rest_.remove_prefix(1);
    double value = 0;
    const auto [end, error] = std::from_chars(rest_.data(), rest_.data() + rest_.size(), value);
    if (error != std::errc{}) return std::nullopt;
    rest_.remove_prefix(static_cast<std::size_t>(end - rest_.data()));
    if (!rest_.empty() && rest_.front() != ' ' && rest_.front() != '\t') return std::nullopt;
    return value;
  }

  template <class T>
  std::optional<double> next_binary_as() {
    std::array<char, sizeof(T)> bytes{};
    if (!file_.read(bytes.data(), bytes.size())) return std::nullopt;
    if (header_.encoding == PlyEncoding::kBigEndian) std::reverse(bytes.begin(), bytes.end());
    return static_cast<double>(std::bit_cast<T>(bytes));
  }

  std::optional<double> next_binary(PlyScalar type) {
    switch (type) {
      case PlyScalar::kInt8:
        return next_binary_as<std::int8_t>();
      case PlyScalar::kUint8:
        return next_binary_as<std::uint8_t>();
      case PlyScalar::kInt16:
        return next_binary_as<std::int16_t>();
      case PlyScalar::kUint16:
        return next_binary_as<std::uint16_t>();
      case PlyScalar::kInt32:
        return next_binary_as<std::int32_t>();
      case PlyScalar::kUint32:
        return next_binary_as<std::uint32_t>();
      case PlyScalar::kFloat:
        return next_binary_as<float>();
      case PlyScalar::kDouble:
        return next_binary_as<double>();
    }
    return std::nullopt;
  }

  /// Reads one property; a list's values are put into list_.
  std::optional<double> next_property(const PlyProperty& property) {
    if (!property.count_type) return next_value(property.type);
    const auto count = next_value(*property.count_type);
    if (!count || !(*count >= 0) || *count > static_cast<double>(file_.size())) return std::nullopt;
    list_.clear();
    for (double i = 0; i < *count; ++i) {
      const auto value = next_value(property.type);
      if (!value) return std::nullopt;
      list_.push_back(*value);
    }
    return count;
  }

  Result<void> read_vertices(const PlyElement& element) {
    std::array<int, 9> columns{};
    constexpr std::array<std::string_view, 9> kNames{"x", "y", "z", "nx", "ny", "nz", "red", "green", "blue"};
    for (std::size_t i = 0; i < columns.size(); ++i) columns[i] = element.index_of(kNames[i]);
    for (std::size_t i = 0; i < 3; ++i)
      if (columns[i] < 0)
        return fail(ErrorCode::kCorrupted, file_.name(), "the vertices have no {}", kNames[i]);
    const auto all = [&](std::size_t first) {
      return std::min({columns[first], columns[first + 1], columns[first + 2]}) >= 0;
    };
    if (!mesh_.vertices.empty()) return fail(ErrorCode::kCorrupted, file_.name(), "two lists of vertices");
    const bool has_normals = all(3), has_colors = all(6);
    std::vector<double> values(element.properties.size());
    for (std::uint64_t i = 0; i < element.count; ++i) {
      if (!next_record()) return ended(element, i);
      for (std::size_t p = 0; p < values.size(); ++p) {
        const auto value = next_property(element.properties[p]);
        if (!value) return ended_or_wrong(element, i);
        values[p] = *value;
      }
      const auto value_at = [&](std::size_t column) {
        return values[static_cast<std::size_t>(columns[column])];
      };
      const auto vector_at = [&](std::size_t first) -> Eigen::Vector3f {
        return Eigen::Vector3d(value_at(first), value_at(first + 1), value_at(first + 2)).cast<float>();
      };
      mesh_.vertices.emplace_back(vector_at(0));
      if (!mesh_.vertices.back().allFinite())
        return fail(ErrorCode::kInvalidValue, here(), "vertex {} is not finite", i);
      if (has_normals) mesh_.normals.emplace_back(vector_at(3));
      if (!has_colors) continue;
      std::array<std::uint8_t, 3> rgb{};
      for (std::size_t c = 0; c < 3; ++c)
        rgb[c] = to_byte(value_at(6 + c), element.properties[static_cast<std::size_t>(columns[6 + c])].type);
      mesh_.colors.push_back({rgb[0], rgb[1], rgb[2]});
    }
    return {};
  }

  static std::uint8_t to_byte(double value, PlyScalar type) {
    if (type >= PlyScalar::kFloat) value *= 255.0;
    if (type == PlyScalar::kUint16) value /= 257.0;
    return static_cast<std::uint8_t>(std::lround(std::clamp(std::isnan(value) ? 0.0 : value, 0.0, 255.0)));
  }

  Result<void> read_faces(const PlyElement& element) {
    int indices = element.index_of("vertex_indices");
    if (indices < 0) indices = element.index_of("vertex_index");
    if (indices < 0 || !element.properties[static_cast<std::size_t>(indices)].count_type)
      return fail(ErrorCode::kCorrupted, file_.name(), "the faces have no vertex_indices");
    std::vector<std::uint32_t> polygon;
    for (std::uint64_t i = 0; i < element.count; ++i) {
      if (!next_record()) return ended(element, i);
      for (std::size_t p = 0; p < element.properties.size(); ++p) {
        if (!next_property(element.properties[p])) return ended_or_wrong(element, i);
        if (static_cast<int>(p) != indices) continue;
        polygon.clear();
        for (const double index : list_) {
          if (!(index >= 0) || index > std::numeric_limits<std::uint32_t>::max())
            return fail(ErrorCode::kCorrupted, here(), "face {} names vertex {}", i, index);
          polygon.push_back(static_cast<std::uint32_t>(index));
        }
      }
      for (std::size_t corner = 2; corner < polygon.size(); ++corner)
        mesh_.triangles.push_back({polygon[0], polygon[corner - 1], polygon[corner]});
    }
    return {};
  }

  Result<void> skip(const PlyElement& element) {
    for (std::uint64_t i = 0; i < element.count; ++i) {
      if (!next_record()) return ended(element, i);
      for (const PlyProperty& property : element.properties)
        if (!next_property(property)) return ended_or_wrong(element, i);
    }
    return {};
  }

  [[nodiscard]] tl::unexpected<Error> ended_or_wrong(const PlyElement& element, std::uint64_t index) const {
    if (header_.encoding != PlyEncoding::kAscii && file_.remaining() == 0) return ended(element, index);
    return fail(ErrorCode::kCorrupted, here(), "the values of {} {} are missing or no numbers", element.name,
                index);
  }

  InputFile& file_;
  PlyHeader header_;
  std::string_view rest_;     ///< of the line, in ascii files
  std::vector<double> list_;  ///< the values of the list read last
  TriangleMesh mesh_;
};

}  // namespace

Result<TriangleMesh> read_ply(InputFile& file) { return PlyReader(file).read(); }

}  // namespace hm
