#pragma once
#include <array>
#include <cstdint>

/// The inner loops of DepthCorrection and DepthRegistration, for one row of an image. What is read and what
/// is written has room for whole blocks of columns.
namespace hm::detail {

/// Columns that are computed together.
inline constexpr int kRowBlock = 16;

/// The coefficients of a row are a weighted sum of four tables, [term][column]: of the rows of control points
/// around it.
struct CorrectionRow {
  int columns = 0;  ///< whole blocks
  int terms = 0;
  std::array<const float*, 4> tables{};
  std::array<float, 4> weights{};
  const float* lowest_s = nullptr;  ///< of each column
  const float* highest_s = nullptr;
  float s_factor = 0, s_offset = 0;  ///< units to s
  float units_per_m = 0;
};

/// Adds its correction to each reading, rounds it and keeps it within 1 .. 65535; 0 stays 0.
void correct_row(const CorrectionRow& row, const std::uint16_t* from, std::uint16_t* to);

/// A reading of z units at column x lies at z (column[.][x] + row[.]) + origin[.], homogeneous, in pixels of
/// a colour camera of width x height.
struct ProjectedRow {
  int columns = 0;  ///< whole blocks
  std::array<const float*, 3> column{};
  std::array<float, 3> row{}, origin{};
  int width = 0, height = 0;
};

/// For each reading the index of the colour camera's pixel that it goes to, and its closeness, 2^16 less its
/// depth there in units. Both are 0 where there is no reading or the colour camera does not see it.
void project_row(const ProjectedRow& row, const std::uint16_t* depth, std::int32_t* pixels,
                 std::uint16_t* closeness);

/// Closeness of the pixels of a row and of its neighbours; before and after `here` is 0.
struct FilledRow {
  const std::uint16_t* above = nullptr;
  const std::uint16_t* here = nullptr;
  const std::uint16_t* below = nullptr;
};

/// Depth of each pixel from its closeness. Without a reading it is the mean of both neighbours in the row
/// where those agree, else that of the neighbours above and below, else 0. Readings agree when they differ by
/// at most 3 % of their mean.
void fill_row(const FilledRow& row, int columns, std::uint16_t* depth);

}  // namespace hm::detail
