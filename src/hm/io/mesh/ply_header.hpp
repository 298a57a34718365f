#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hm/core/result.hpp"
#include "hm/io/bytes/input_file.hpp"

namespace hm {

enum class PlyEncoding { kAscii, kLittleEndian, kBigEndian };
enum class PlyScalar { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat, kDouble };

struct PlyProperty {
  std::string name;
  PlyScalar type = PlyScalar::kFloat;
  std::optional<PlyScalar> count_type;  ///< of a list
};

struct PlyElement {
  std::string name;
  std::uint64_t count = 0;
  std::vector<PlyProperty> properties;

  [[nodiscard]] int index_of(std::string_view property) const {
    for (std::size_t i = 0; i < properties.size(); ++i)
      if (properties[i].name == property) return static_cast<int>(i);
    return -1;
  }
};

struct PlyHeader {
  PlyEncoding encoding = PlyEncoding::kAscii;
  std::vector<PlyElement> elements;
};

std::size_t size_of(PlyScalar type);

/// Reads up to and including the line `end_header`.
Result<PlyHeader> read_ply_header(InputFile& file);

}  // namespace hm
