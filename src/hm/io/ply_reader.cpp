#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hm/io/mesh_formats.hpp"

namespace hm {
namespace {

enum class Encoding { kAscii, kLittleEndian, kBigEndian };
enum class Scalar { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat, kDouble };

constexpr std::size_t kMaxHeaderLines = 1000;

std::size_t size_of(Scalar type) {
  constexpr std::array<std::size_t, 8> kSizes{1, 1, 2, 2, 4, 4, 4, 8};
  return kSizes[static_cast<std::size_t>(type)];
}

std::optional<Scalar> scalar_named(std::string_view name) {
  struct Name {
    std::string_view name;
    Scalar type;
  };
  static constexpr std::array<Name, 16> kNames{{{"char", Scalar::kInt8},
                                                {"int8", Scalar::kInt8},
                                                {"uchar", Scalar::kUint8},
                                                {"uint8", Scalar::kUint8},
                                                {"short", Scalar::kInt16},
                                                {"int16", Scalar::kInt16},
                                                {"ushort", Scalar::kUint16},
                                                {"uint16", Scalar::kUint16},
                                                {"int", Scalar::kInt32},
                                                {"int32", Scalar::kInt32},
                                                {"uint", Scalar::kUint32},
                                                {"uint32", Scalar::kUint32},
                                                {"float", Scalar::kFloat},
                                                {"float32", Scalar::kFloat},
                                                {"double", Scalar::kDouble},
                                                {"float64", Scalar::kDouble}}};
  for (const Name& entry : kNames)
    if (entry.name == name) return entry.type;
  return std::nullopt;
}

struct Property {
  std::string name;
  Scalar type = Scalar::kFloat;
  std::optional<Scalar> count_type;  ///< of a list
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;

  [[nodiscard]] int index_of(std::string_view property) const {
    for (std::size_t i = 0; i < properties.size(); ++i)
      if (properties[i].name == property) return static_cast<int>(i);
    return -1;
  }
};

struct Header {
  Encoding encoding = Encoding::kAscii;
  std::vector<Element> elements;
};

std::vector<std::string_view> words_of(std::string_view line) {
  std::vector<std::string_view> words;
  while (true) {
    const std::size_t begin = line.find_first_not_of(" \t");
    if (begin == std::string_view::npos) return words;
    line.remove_prefix(begin);
    const std::size_t end = std::min(line.find_first_of(" \t"), line.size());
    words.push_back(line.substr(0, end));
    line.remove_prefix(end);
  }
}

class PlyReader {
 public:
  explicit PlyReader(InputFile& file) : file_(file) {}

  Result<TriangleMesh> read() {
    if (const auto header = read_header(); !header) return forward_error(header);
    for (const Element& element : header_.elements) {
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
    return header_.encoding == Encoding::kAscii ? file_.at_line() : file_.at_byte();
  }
  [[nodiscard]] tl::unexpected<Error> header_error(std::string_view what) const {
    return fail(ErrorCode::kCorrupted, file_.at_line(), "{} in the header of a PLY file", what);
  }
  [[nodiscard]] tl::unexpected<Error> ended(const Element& element, std::uint64_t index) const {
    return fail(ErrorCode::kTruncated, here(), "the file ends within {} {} of {}", element.name, index,
                element.count);
  }

  Result<void> read_header() {
    std::string_view line;
    if (!file_.read_line(line) || line != "ply")
      return fail(ErrorCode::kCorrupted, file_.at_byte(0), "does not start with 'ply'");
    bool has_format = false;
    for (std::size_t lines = 0; file_.read_line(line); ++lines) {
      if (lines > kMaxHeaderLines) return header_error("too many lines");
      const auto words = words_of(line);
      if (words.empty() || words[0] == "comment" || words[0] == "obj_info") continue;
      if (words[0] == "end_header") {
        if (!has_format) return header_error("no 'format'");
        return {};
      }
      if (const auto added = read_header_line(words); !added) return added;
      has_format |= words[0] == "format";
    }
    return fail(ErrorCode::kTruncated, file_.at_line(), "the header does not end");
  }

  Result<void> read_header_line(const std::vector<std::string_view>& words) {
    if (words[0] == "format" && words.size() == 3) {
      if (words[1] == "ascii")
        header_.encoding = Encoding::kAscii;
      else if (words[1] == "binary_little_endian")
        header_.encoding = Encoding::kLittleEndian;
      else if (words[1] == "binary_big_endian")
        header_.encoding = Encoding::kBigEndian;
      else
        return header_error("an unknown encoding");
      return {};
    }
    if (words[0] == "element" && words.size() == 3) {
      Element element{std::string(words[1]), 0, {}};
      const auto [end, error] =
          std::from_chars(words[2].data(), words[2].data() + words[2].size(), element.count);
      if (error != std::errc{} || end != words[2].data() + words[2].size())
        return header_error("a wrong count");
      header_.elements.push_back(std::move(element));
      return {};
    }
    if (words[0] != "property" || header_.elements.empty()) return header_error("an unknown line");
    Property property;
    const bool list = words.size() == 5 && words[1] == "list";
    if (!list && words.size() != 3) return header_error("a wrong property");
    const auto type = scalar_named(words[list ? 3 : 1]);
    if (list) property.count_type = scalar_named(words[2]);
    const bool count_is_real = property.count_type && *property.count_type >= Scalar::kFloat;
    if (!type || (list && !property.count_type) || count_is_real) return header_error("an unknown type");
    property.type = *type;
    property.name = words.back();
    header_.elements.back().properties.push_back(std::move(property));
    return {};
  }

  /// The rest of the file must be able to hold the element, before memory is set aside for it.
  Result<void> check_count(const Element& element) const {
    std::uint64_t bytes_each = 0;
    for (const Property& property : element.properties) {
      const std::size_t binary = size_of(property.count_type.value_or(property.type));
      bytes_each += header_.encoding == Encoding::kAscii ? 2 : binary;
    }
    const std::uint64_t most = bytes_each == 0 ? 0 : (file_.remaining() + 1) / bytes_each;
    if (element.count > most)
      return fail(ErrorCode::kTruncated, here(), "{} x {} do not fit in the {} bytes left", element.count,
                  element.name, file_.remaining());
    return {};
  }

  /// Makes the next element's values readable: in ascii files, its line.
  bool next_record() {
    if (header_.encoding != Encoding::kAscii) return true;
    do {
      if (!file_.read_line(rest_)) return false;
    } while (rest_.find_first_not_of(" \t") == std::string_view::npos);
    return true;
  }

  std::optional<double> next_value(Scalar type) {
    if (header_.encoding != Encoding::kAscii) return next_binary(type);
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
  static double as(const std::array<char, 8>& bytes) {
    T value;
    std::memcpy(&value, bytes.data(), sizeof value);
    return static_cast<double>(value);
  }

  std::optional<double> next_binary(Scalar type) {
    std::array<char, 8> bytes{};
    const std::size_t size = size_of(type);
    if (!file_.read(bytes.data(), size)) return std::nullopt;
    if (header_.encoding == Encoding::kBigEndian)
      std::reverse(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size));
    switch (type) {
      case Scalar::kInt8:
        return as<std::int8_t>(bytes);
      case Scalar::kUint8:
        return as<std::uint8_t>(bytes);
      case Scalar::kInt16:
        return as<std::int16_t>(bytes);
      case Scalar::kUint16:
        return as<std::uint16_t>(bytes);
      case Scalar::kInt32:
        return as<std::int32_t>(bytes);
      case Scalar::kUint32:
        return as<std::uint32_t>(bytes);
      case Scalar::kFloat:
        return as<float>(bytes);
      case Scalar::kDouble:
        return as<double>(bytes);
    }
    return std::nullopt;
  }

  /// Reads one property; a list's values are put into list_.
  std::optional<double> next_property(const Property& property) {
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

  Result<void> read_vertices(const Element& element) {
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

  static std::uint8_t to_byte(double value, Scalar type) {
    if (type >= Scalar::kFloat) value *= 255.0;
    if (type == Scalar::kUint16) value /= 257.0;
    return static_cast<std::uint8_t>(std::lround(std::clamp(std::isnan(value) ? 0.0 : value, 0.0, 255.0)));
  }

  Result<void> read_faces(const Element& element) {
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

  Result<void> skip(const Element& element) {
    for (std::uint64_t i = 0; i < element.count; ++i) {
      if (!next_record()) return ended(element, i);
      for (const Property& property : element.properties)
        if (!next_property(property)) return ended_or_wrong(element, i);
    }
    return {};
  }

  [[nodiscard]] tl::unexpected<Error> ended_or_wrong(const Element& element, std::uint64_t index) const {
    if (header_.encoding != Encoding::kAscii && file_.remaining() == 0) return ended(element, index);
    return fail(ErrorCode::kCorrupted, here(), "the values of {} {} are missing or no numbers", element.name,
                index);
  }

  InputFile& file_;
  Header header_;
  std::string_view rest_;     ///< of the line, in ascii files
  std::vector<double> list_;  ///< the values of the list read last
  TriangleMesh mesh_;
};

}  // namespace

Result<TriangleMesh> read_ply(InputFile& file) { return PlyReader(file).read(); }

}  // namespace hm
