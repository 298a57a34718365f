#include "hm/station/web/qr_text.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace hm {
namespace {

/// Modules of a printed code, dark ones true; upper and lower halves of each line.
std::vector<std::vector<bool>> modules_of(const std::string& text) {
  const std::map<std::string, std::pair<bool, bool>> halves{
      {"\u2588", {false, false}}, {"\u2580", {false, true}}, {"\u2584", {true, false}}, {" ", {true, true}}};
  std::vector<std::vector<bool>> rows(2);
  for (std::size_t i = 0; i < text.size();) {
    if (text[i] == '\n') {
      rows.resize(rows.size() + 2);
      ++i;
      continue;
    }
    const std::string letter = text.substr(i, text[i] == ' ' ? 1 : 3);
    i += letter.size();
    rows[rows.size() - 2].push_back(halves.at(letter).first);
    rows.back().push_back(halves.at(letter).second);
  }
  rows.resize(rows.size() - 2);
  return rows;
}

TEST(QrText, IsACodeWithItsQuietZone) {
  const auto text = qr_text("http://192.168.178.20:8710/?token=0123456789abcdef0123456789abcdef");
  ASSERT_TRUE(text);
  const auto rows = modules_of(*text);
  const std::size_t width = rows.front().size();
  ASSERT_EQ(width, 4 + 33 + 4);  // version 4 (33 modules): 67 letters
  for (const auto& row : rows) ASSERT_EQ(row.size(), width);
  for (std::size_t i = 0; i < width; ++i)
    for (std::size_t edge = 0; edge < 4; ++edge) {
      EXPECT_FALSE(rows[edge][i]);
      EXPECT_FALSE(rows[i][edge]);
      EXPECT_FALSE(rows[i][width - 1 - edge]);
      EXPECT_FALSE(rows[width - 1 - edge][i]);
    }
  // Finder patterns in three corners: rings of 7 dark, 5 light, 3 dark modules.
  for (const auto& [x0, y0] : {std::pair{4, 4}, {4 + 26, 4}, {4, 4 + 26}})
    for (int y = 0; y < 7; ++y)
      for (int x = 0; x < 7; ++x) {
        const int ring = std::max(std::abs(x - 3), std::abs(y - 3));
        EXPECT_EQ(rows[static_cast<std::size_t>(y0 + y)][static_cast<std::size_t>(x0 + x)], ring != 2);
      }
  // The timing pattern between them alternates.
  for (std::size_t x = 12; x < 4 + 25; ++x) EXPECT_EQ(rows[10][x], x % 2 == 0) << x;
}

TEST(QrText, ATextThatIsTooLongHasNone) { EXPECT_FALSE(qr_text(std::string(3000, 'x'))); }

}  // namespace
}  // namespace hm
