#pragma once
#include <cstdint>

/// The inner loops of DepthRegistration. Rows are padded to whole blocks and begin on a cache line.
namespace hm::detail {

inline constexpr int kBlock_px = 32;
inline constexpr int kRowBlock_px = 2 * kBlock_px;  ///< both halves of a row are whole blocks

/// What a cell holds is the closeness of its reading, 2^16 less the depth: the nearest is the largest, and 0
/// is none.
inline constexpr std::uint16_t kNone = 0, kClosest = 65535;

/// Where directions of columns lie in their list: the columns of a block one axis after the other, of each
/// the even ones, then the odd ones.
constexpr int column_at(int x, int axis) {
  return x / kBlock_px * 3 * kBlock_px + axis * kBlock_px + x % 2 * kBlock_px / 2 + x % kBlock_px / 2;
}

/// Where the readings of a row of the depth camera go: one of z units lies at z (column + row) + origin,
/// homogeneous, in cells. Cells are pixels of the colour camera with a border around them, which takes what
/// it does not see.
struct ProjectedRow {
  int width = 0;                   ///< a multiple of kRowBlock_px
  const float* columns = nullptr;  ///< at column_at()
  float row[3] = {};
  float origin[3] = {};
  float first_row = 0;  ///< of cells: those before are not within reach
  float stride = 0;     ///< cells of a row
  /// Readings that are within reach. All others are taken as holes, which go where the reading to the right
  /// of them goes, or a lowest one.
  std::uint16_t lowest = 1, highest = 65535;
};

/// Where the readings of a row went: for each its cell, from the first within reach, and its closeness to the
/// other camera. Has a block's room before and after it.
struct PlacedRow {
  std::uint16_t* cells = nullptr;
  std::uint16_t* closeness = nullptr;
};

/// Two steps, each of another row: they do not wait for each other, and one keeps the vector units busy while
/// the other one waits for memory.
struct RegistrationStep {
  ProjectedRow projection;
  const std::uint16_t* depth = nullptr;  ///< what is projected, and one more ...
  PlacedRow placed;                      ///< ... to there

  PlacedRow splatted;  ///< each of these goes into its cell ...
  /// ... of these (the first within reach), unless a nearer one is there. Whole vectors are read and written,
  /// wherever a cell's number of 16 bits leads: there are 2^16 + kBlock_px cells from this one on.
  std::uint16_t* closest = nullptr;
};

/// Where one reading goes, whatever it is; rows and columns before the first are very large numbers.
struct PlacedReading {
  std::uint32_t row = 0, column = 0;
  std::uint16_t closeness = kNone;
};
PlacedReading place_plain(const ProjectedRow& row, int x, std::uint16_t units);

/// One reading after the other: what the vector code must do to the last bit. True when there was something
/// that is no hole, but beyond lowest and highest.
bool register_step_plain(const RegistrationStep& step);
bool register_step_simd(const RegistrationStep& step);

/// Three rows of cells, one below the other -> depths of the middle one; holes between two neighbours (left
/// and right, else above and below) that agree get their mean. A cell before each row is read, and up to
/// kBlock_px after it.
struct FilledRow {
  const std::uint16_t *above = nullptr, *cells = nullptr, *below = nullptr;
  int width = 0;
};
void fill_row_plain(const FilledRow& row, std::uint16_t* depth);
void fill_row_simd(const FilledRow& row, std::uint16_t* depth);

}  // namespace hm::detail
