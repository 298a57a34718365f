#pragma once
#include <cstdint>

/// The inner loops of DepthRegistration. Rows are padded to whole blocks and begin on a cache line.
namespace hm::detail {

inline constexpr int kBlock_px = 16;
inline constexpr std::uint16_t kNone = 65535;  ///< no reading, of depths less 1

/// Where the readings of a row of the depth camera go: one of z units lies at z (of_column + of_row) +
/// origin, homogeneous, in cells. Cells are pixels of the colour camera with a border around them, which
/// takes what it does not see. Beyond the image of_column[2] is no number: nothing there is a reading.
struct ProjectedRow {
  int width = 0;  ///< whole blocks
  const float* of_column[3] = {};
  float of_row[3] = {};
  float origin[3] = {};
  std::uint32_t last_x = 0, last_y = 0;  ///< the border beyond the last pixels
  std::uint32_t stride = 0;              ///< cells of a row
};

/// Where the readings of a row went: for each its cell, and its depth seen from the colour camera less 1 (the
/// nearest is the least).
struct PlacedRow {
  std::uint32_t* cells = nullptr;
  std::uint16_t* nearness = nullptr;
};

/// Two steps, each of another row: they do not wait for each other, and one keeps the vector units busy while
/// the other one waits for memory.
struct RegistrationStep {
  ProjectedRow projection;
  const std::uint16_t* depth = nullptr;  ///< what is projected ...
  PlacedRow placed;                      ///< ... to there

  PlacedRow splatted;                ///< each of these goes into its cell ...
  std::uint16_t* nearest = nullptr;  ///< ... of these unless a nearer one is there
};

/// One reading after the other: what the vector code must do to the last bit.
void register_step_plain(const RegistrationStep& step);
void register_step_simd(const RegistrationStep& step);

/// Depths of a row of cells less 1 -> depths; holes between two neighbours (left and right, else above and
/// below) that agree get their mean. `cells` is the first pixel's.
void fill_row_plain(const std::uint16_t* cells, int stride, int width, std::uint16_t* depth);
void fill_row_simd(const std::uint16_t* cells, int stride, int width, std::uint16_t* depth);

}  // namespace hm::detail
