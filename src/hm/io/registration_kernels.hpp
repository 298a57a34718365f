#pragma once
#include <cstdint>

/// The inner loops of DepthRegistration.
namespace hm::detail {

/// Where the readings of a row of the depth camera go. Cells are pixels of the colour camera with a border of
/// one around them, which takes what it does not see.
struct ProjectedRow {
  int width = 0;
  /// A reading of z units lies at z (of_column + of_row) + origin, homogeneous, in cells; padded to whole
  /// vectors.
  const float* of_column[3] = {};
  float of_row[3] = {};
  float origin[3] = {};
  float last_x = 0, last_y = 0;  ///< the border beyond the last pixels
  int stride = 0;                ///< cells of a row
};

/// For each reading its cell, and its depth seen from the colour camera less 1 (65535: none, so that the
/// nearest is the least). Writes whole vectors: up to 15 numbers beyond the row.
void project_row_plain(const ProjectedRow& row, const std::uint16_t* depth, std::int32_t* cells,
                       std::uint16_t* nearness);
void project_row_simd(const ProjectedRow& row, const std::uint16_t* depth, std::int32_t* cells,
                      std::uint16_t* nearness);

/// Depths of a row of cells less 1 -> depths; holes between two neighbours (left and right, else above and
/// below) that agree get their mean. `cells` is the first pixel's.
void fill_row_plain(const std::uint16_t* cells, int stride, int width, std::uint16_t* depth);
void fill_row_simd(const std::uint16_t* cells, int stride, int width, std::uint16_t* depth);

}  // namespace hm::detail
