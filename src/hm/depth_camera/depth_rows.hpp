#pragma once
#include <array>
#include <cstdint>

/// Inner loops of DepthCorrection and DepthRegistration, one image row at a time. All input and output rows
/// must be padded to whole blocks of columns.
namespace hm::detail {

/// Number of columns processed together.
inline constexpr int kRowBlock = 16;

/// Coefficients of one image row: a weighted sum of four tables, [term][column], one for each surrounding row
/// of control points.
struct CorrectionRow {
  int columns = 0;  ///< whole blocks
  int terms = 0;
  std::array<const float*, 4> tables{};
  std::array<float, 4> weights{};
  const float* lowest_s = nullptr;  ///< per column
  const float* highest_s = nullptr;
  float s_factor = 0, s_offset = 0;  ///< s = s_factor * units + s_offset
  float units_per_m = 0;
};

/// Adds the correction to each reading, rounds and clamps to 1 .. 65535; 0 stays 0.
void correct_row(const CorrectionRow& row, const std::uint16_t* from, std::uint16_t* to);

/// Projection of one row: a reading of z units at column x lies at z (column[.][x] + row[.]) + origin[.],
/// homogeneous, in pixels of a colour camera of width x height.
struct ProjectedRow {
  int columns = 0;  ///< whole blocks
  std::array<const float*, 3> column{};
  std::array<float, 3> row{}, origin{};
  int width = 0, height = 0;
};

/// Computes for each reading the index of its pixel in the colour camera and its closeness, 2^16 minus its
/// depth there in units. Both are 0 where there is no reading or it lies outside the colour image.
void project_row(const ProjectedRow& row, const std::uint16_t* depth, std::int32_t* pixels,
                 std::uint16_t* closeness);

/// Closeness of a row and of its neighbouring rows; one element before and after `here` must be readable and
/// 0.
struct FilledRow {
  const std::uint16_t* above = nullptr;
  const std::uint16_t* here = nullptr;
  const std::uint16_t* below = nullptr;
};

/// Converts closeness to depth. A pixel without a reading becomes the mean of its left and right neighbours
/// if these agree, else that of the upper and lower ones if these agree, else 0. Readings agree when they
/// differ by at most 3 % of their mean.
void fill_row(const FilledRow& row, int columns, std::uint16_t* depth);

}  // namespace hm::detail
