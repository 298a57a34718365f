#include "hm/io/mesh/ply_header.hpp"

#include <algorithm>
#include <array>
#include <charconv>

namespace hm {
namespace {

constexpr std::size_t kMaxHeaderLines = 1000;

std::optional<PlyScalar> scalar_named(std::string_view name) {
  struct Name {
    std::string_view name;
    PlyScalar type;
  };
  static constexpr std::array<Name, 16> kNames{{{"char", PlyScalar::kInt8},
                                                {"int8", PlyScalar::kInt8},
                                                {"uchar", PlyScalar::kUint8},
                                                {"uint8", PlyScalar::kUint8},
                                                {"short", PlyScalar::kInt16},
                                                {"int16", PlyScalar::kInt16},
                                                {"ushort", PlyScalar::kUint16},
                                                {"uint16", PlyScalar::kUint16},
                                                {"int", PlyScalar::kInt32},
                                                {"int32", PlyScalar::kInt32},
                                                {"uint", PlyScalar::kUint32},
                                                {"uint32", PlyScalar::kUint32},
                                                {"float", PlyScalar::kFloat},
                                                {"float32", PlyScalar::kFloat},
                                                {"double", PlyScalar::kDouble},
                                                {"float64", PlyScalar::kDouble}}};
  for (const Name& entry : kNames)
    if (entry.name == name) return entry.type;
  return std::nullopt;
}

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

class PlyHeaderReader {
 public:
  explicit PlyHeaderReader(InputFile& file) : file_(file) {}

  Result<PlyHeader> read() {
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
        return std::move(header_);
      }
      if (const auto added = read_header_line(words); !added) return forward_error(added);
      has_format |= words[0] == "format";
    }
    return fail(ErrorCode::kTruncated, file_.at_line(), "the header does not end");
  }

 private:
  Result<void> read_header_line(const std::vector<std::string_view>& words) {
    if (words[0] == "format" && words.size() == 3) {
      if (words[1] == "ascii")
        header_.encoding = PlyEncoding::kAscii;
      else if (words[1] == "binary_little_endian")
        header_.encoding = PlyEncoding::kLittleEndian;
      else if (words[1] == "binary_big_endian")
        header_.encoding = PlyEncoding::kBigEndian;
      else
        return header_error("an unknown encoding");
      return {};
    }
    if (words[0] == "element" && words.size() == 3) {
      PlyElement element{std::string(words[1]), 0, {}};
      const auto [end, error] =
          std::from_chars(words[2].data(), words[2].data() + words[2].size(), element.count);
      if (error != std::errc{} || end != words[2].data() + words[2].size())
        return header_error("a wrong count");
      header_.elements.push_back(std::move(element));
      return {};
    }
    if (words[0] != "property" || header_.elements.empty()) return header_error("an unknown line");
    PlyProperty property;
    const bool list = words.size() == 5 && words[1] == "list";
    if (!list && words.size() != 3) return header_error("a wrong property");
    const auto type = scalar_named(words[list ? 3 : 1]);
    if (list) property.count_type = scalar_named(words[2]);
    const bool count_is_real = property.count_type && *property.count_type >= PlyScalar::kFloat;
    if (!type || (list && !property.count_type) || count_is_real) return header_error("an unknown type");
    property.type = *type;
    property.name = words.back();
    header_.elements.back().properties.push_back(std::move(property));
    return {};
  }

  [[nodiscard]] tl::unexpected<Error> header_error(std::string_view what) const {
    return fail(ErrorCode::kCorrupted, file_.at_line(), "{} in the header of a PLY file", what);
  }

  InputFile& file_;
  PlyHeader header_;
};

}  // namespace

std::size_t size_of(PlyScalar type) {
  constexpr std::array<std::size_t, 8> kSizes{1, 1, 2, 2, 4, 4, 4, 8};
  return kSizes[static_cast<std::size_t>(type)];
}

Result<PlyHeader> read_ply_header(InputFile& file) { return PlyHeaderReader(file).read(); }

}  // namespace hm
