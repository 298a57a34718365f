#include <gtest/gtest.h>

#include <array>

#include "hm/io/image/image_codec.hpp"
#include "hm/io/image/png_test_support.hpp"

/// What is faster than libpng against libpng, pixel by pixel.
namespace hm {
namespace {

using Bytes = std::vector<std::uint8_t>;

template <class Pixel>
std::optional<Image<Pixel>> plain(const Bytes& bytes);
template <>
std::optional<Image<Rgb8>> plain<Rgb8>(const Bytes& bytes) {
  return detail::decode_plain_png_color(bytes);
}
template <>
std::optional<Image<std::uint16_t>> plain<std::uint16_t>(const Bytes& bytes) {
  return detail::decode_plain_png_gray16(bytes);
}
Result<Image<Rgb8>> by_libpng(const Bytes& bytes, Rgb8) { return detail::decode_png_color(bytes, "x"); }
Result<Image<std::uint16_t>> by_libpng(const Bytes& bytes, std::uint16_t) {
  return detail::decode_png_gray16(bytes, "x");
}

/// Noise on a slope: the filters predict some of it, and their sums exceed a byte.
std::vector<Bytes> rows_of(std::size_t row_bytes, std::size_t height, std::uint64_t seed) {
  Rng rng(seed);
  std::vector<Bytes> rows(height, Bytes(row_bytes));
  for (std::size_t y = 0; y < height; ++y)
    for (std::size_t x = 0; x < row_bytes; ++x)
      rows[y][x] = static_cast<std::uint8_t>(x + 3 * y + rng.below(y % 2 == 0 ? 256 : 9));
  return rows;
}

template <class Pixel>
void expect_as_libpng(int bit_depth, int color_type) {
  constexpr std::array kFilters{PNG_FILTER_NONE, PNG_FILTER_SUB,   PNG_FILTER_UP,
                                PNG_FILTER_AVG,  PNG_FILTER_PAETH, PNG_ALL_FILTERS};
  constexpr std::array<std::pair<int, std::size_t>, 4> kSizes{{{1, 1}, {1, 9}, {7, 1}, {61, 40}}};
  for (const int filter : kFilters)
    for (const auto& [width, height] : kSizes) {
      const auto rows = rows_of(static_cast<std::size_t>(width) * sizeof(Pixel), height, 5);
      const Bytes bytes = png_of_kind(width, bit_depth, color_type, PNG_INTERLACE_NONE, rows, filter);
      const auto image = plain<Pixel>(bytes);
      ASSERT_TRUE(image) << filter << ": " << width << " x " << height;
      EXPECT_TRUE(same_pixels(*image, *by_libpng(bytes, Pixel{})))
          << filter << ": " << width << " x " << height;
    }
}

TEST(PlainPng, EveryFilterIsUndoneAsByLibpng) {
  expect_as_libpng<Rgb8>(8, PNG_COLOR_TYPE_RGB);
  expect_as_libpng<std::uint16_t>(16, PNG_COLOR_TYPE_GRAY);
}

TEST(PlainPng, WhatItWritesLibpngReads) {
  for (const PngEffort effort : {PngEffort::kStored, PngEffort::kFast}) {
    for (const auto& image : {random_color(37, 23, 1), random_color(1, 1, 2), Image<Rgb8>(640, 480)})
      EXPECT_TRUE(same_pixels(*by_libpng(detail::encode_plain_png(image, effort), Rgb8{}), image));
    for (const auto& image : {random_depth(37, 23, 1), random_depth(1, 1, 2), Image<std::uint16_t>(640, 480)})
      EXPECT_TRUE(same_pixels(*by_libpng(detail::encode_plain_png(image, effort), std::uint16_t{}), image));
  }
}

TEST(PlainPng, OtherKindsAreLeftToLibpng) {
  const auto is_plain_color = [](const Bytes& bytes) { return plain<Rgb8>(bytes).has_value(); };
  EXPECT_TRUE(is_plain_color(png_of_kind(2, 8, PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE, rows_of(6, 3, 1))));
  EXPECT_FALSE(is_plain_color(png_of_kind(2, 8, PNG_COLOR_TYPE_RGB, PNG_INTERLACE_ADAM7, rows_of(6, 3, 1))));
  EXPECT_FALSE(is_plain_color(png_of_kind(2, 16, PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE, rows_of(12, 3, 1))));
  EXPECT_FALSE(is_plain_color(png_of_kind(2, 8, PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_NONE, rows_of(2, 3, 1))));
  EXPECT_FALSE(is_plain_color(png_of_kind(2, 16, PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_NONE, rows_of(4, 3, 1))));
  EXPECT_FALSE(
      is_plain_color(png_of_kind(2, 8, PNG_COLOR_TYPE_RGB_ALPHA, PNG_INTERLACE_NONE, rows_of(8, 3, 1))));
  EXPECT_FALSE(
      is_plain_color(png_of_kind(2, 2, PNG_COLOR_TYPE_PALETTE, PNG_INTERLACE_NONE, rows_of(1, 3, 1))));
  EXPECT_FALSE(
      plain<std::uint16_t>(png_of_kind(2, 8, PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_NONE, rows_of(2, 3, 1))));
}

/// `bytes` with a chunk after the header.
Bytes with_chunk(Bytes bytes, std::string_view name, std::string_view text) {
  Bytes chunk{0, 0, 0, static_cast<std::uint8_t>(text.size())};
  chunk.insert(chunk.end(), name.begin(), name.end());
  chunk.insert(chunk.end(), text.begin(), text.end());
  const std::uint32_t checksum = png_checksum(std::span(chunk).subspan(4));
  for (int shift = 24; shift >= 0; shift -= 8) chunk.push_back(static_cast<std::uint8_t>(checksum >> shift));
  constexpr std::ptrdiff_t kAfterHeader = 33;
  bytes.insert(bytes.begin() + kAfterHeader, chunk.begin(), chunk.end());
  return bytes;
}

TEST(PlainPng, ChunksThatAreNotNeededAreSkippedAndOthersLeftToLibpng) {
  const auto image = random_color(5, 4, 3);
  const Bytes bytes = encode_png(image, PngEffort::kFast);
  const auto commented = plain<Rgb8>(with_chunk(bytes, "tEXt", "Comment: a kitchen"));
  ASSERT_TRUE(commented);
  EXPECT_TRUE(same_pixels(*commented, image));
  EXPECT_FALSE(plain<Rgb8>(with_chunk(bytes, "NEWS", "needed")));
  Bytes damaged = with_chunk(bytes, "tEXt", "Comment: a kitchen");
  damaged[45] ^= 1;
  EXPECT_FALSE(plain<Rgb8>(damaged));
}

TEST(PlainPng, EveryPrefixAndEveryChangedByteIsNoticed) {
  const Bytes files[] = {encode_png(random_color(9, 7, 1), PngEffort::kFast),
                         encode_png(random_color(9, 7, 1), PngEffort::kStored),
                         encode_png(random_depth(9, 7, 1), PngEffort::kFast)};
  for (const Bytes& file : files) {
    for (std::size_t n = 0; n < file.size(); ++n) {
      // A heap copy of the exact size, so that a read past the end is seen by ASan.
      const Bytes prefix(file.begin(), file.begin() + static_cast<std::ptrdiff_t>(n));
      EXPECT_FALSE(plain<Rgb8>(prefix)) << n;
      EXPECT_FALSE(plain<std::uint16_t>(prefix)) << n;
    }
    for (std::size_t i = 0; i < file.size(); ++i) {
      Bytes changed = file;
      changed[i] ^= 0x40;
      EXPECT_FALSE(plain<Rgb8>(changed)) << i;
      EXPECT_FALSE(plain<std::uint16_t>(changed)) << i;
    }
  }
}

}  // namespace
}  // namespace hm
