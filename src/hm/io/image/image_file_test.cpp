#include "hm/io/image/image_file.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "hm/core/rng.hpp"
#include "hm/io/bytes/file_bytes.hpp"
#include "hm/io/image/png_test_support.hpp"
#include "hm/io/testing/temporary_folder_test_support.hpp"

namespace hm {
namespace {

/// An image that JPEG can hold well: smooth gradients.
Image<Rgb8> smooth_colors(int width, int height) {
  Image<Rgb8> image(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      image(x, y) = {static_cast<std::uint8_t>(255 * x / width), static_cast<std::uint8_t>(255 * y / height),
                     static_cast<std::uint8_t>(128 + 60 * std::sin(0.1 * (x + y)))};
  return image;
}

TEST(PngFile, ColorRoundTripIsExact) {
  const TemporaryFolder folder;
  for (const PngEffort effort : {PngEffort::kFast, PngEffort::kDefault, PngEffort::kSmall}) {
    for (const auto& image : {random_color(37, 23, 1), smooth_colors(64, 5), random_color(1, 1, 2)}) {
      ASSERT_TRUE(write_png(folder.path() / "a.png", image, effort));
      const auto back = read_color_image(folder.path() / "a.png");
      ASSERT_TRUE(back) << to_string(back.error());
      EXPECT_TRUE(same_pixels(*back, image));
      EXPECT_EQ(read_image_size(folder.path() / "a.png"), (ImageSize{image.width(), image.height()}));
    }
  }
}

TEST(PngFile, DepthRoundTripIsExact) {
  const TemporaryFolder folder;
  for (const PngEffort effort : {PngEffort::kFast, PngEffort::kDefault}) {
    const auto image = random_depth(41, 19, 3);
    ASSERT_TRUE(write_png(folder.path() / "d.png", image, effort));
    const auto back = read_depth_png(folder.path() / "d.png");
    ASSERT_TRUE(back) << to_string(back.error());
    EXPECT_TRUE(same_pixels(*back, image));
  }
}

TEST(PngFile, SixteenBitsAreStoredBigEndian) {
  // The file format's own order: read a hand-made big-endian row.
  const auto bytes = png_of_kind(2, 16, PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_NONE, {{0x01, 0x02, 0xFF, 0xFE}});
  const auto depth = decode_depth_png(bytes, "x");
  ASSERT_TRUE(depth);
  EXPECT_EQ((*depth)(0, 0), 0x0102);
  EXPECT_EQ((*depth)(1, 0), 0xFFFE);
}

TEST(PngFile, EveryKindBecomesRgb) {
  const auto first_row = [](const std::vector<std::uint8_t>& bytes) {
    const auto image = decode_color_image(bytes, "x");
    EXPECT_TRUE(image);
    return image ? std::vector<Rgb8>(image->row(0).begin(), image->row(0).end()) : std::vector<Rgb8>{};
  };
  using Rows = std::vector<Rgb8>;
  EXPECT_EQ(first_row(png_of_kind(4, 1, PNG_COLOR_TYPE_GRAY, 0, {{0b01010000}})),
            (Rows{{0, 0, 0}, {255, 255, 255}, {0, 0, 0}, {255, 255, 255}}));
  EXPECT_EQ(first_row(png_of_kind(2, 4, PNG_COLOR_TYPE_GRAY, 0, {{0xF1}})),
            (Rows{{255, 255, 255}, {17, 17, 17}}));
  EXPECT_EQ(first_row(png_of_kind(2, 8, PNG_COLOR_TYPE_GRAY, 0, {{7, 200}})),
            (Rows{{7, 7, 7}, {200, 200, 200}}));
  EXPECT_EQ(first_row(png_of_kind(1, 16, PNG_COLOR_TYPE_GRAY, 0, {{0x80, 0x80}})), (Rows{{128, 128, 128}}));
  EXPECT_EQ(first_row(png_of_kind(2, 8, PNG_COLOR_TYPE_GRAY_ALPHA, 0, {{9, 0, 10, 255}})),
            (Rows{{9, 9, 9}, {10, 10, 10}}));
  EXPECT_EQ(first_row(png_of_kind(1, 8, PNG_COLOR_TYPE_RGB_ALPHA, 0, {{1, 2, 3, 4}})), (Rows{{1, 2, 3}}));
  EXPECT_EQ(first_row(png_of_kind(1, 16, PNG_COLOR_TYPE_RGB, 0, {{1, 1, 2, 2, 3, 3}})), (Rows{{1, 2, 3}}));
  EXPECT_EQ(first_row(png_of_kind(2, 2, PNG_COLOR_TYPE_PALETTE, 0, {{0b11010000}})),
            (Rows{{255, 0, 1}, {40, 50, 60}}));
  EXPECT_EQ(first_row(png_of_kind(2, 8, PNG_COLOR_TYPE_RGB, PNG_INTERLACE_ADAM7,
                                  {{1, 2, 3, 4, 5, 6}, {7, 8, 9, 1, 1, 1}})),
            (Rows{{1, 2, 3}, {4, 5, 6}}));
}

TEST(PngFile, DepthOfTheWrongKindIsAnErrorThatSaysSo) {
  const auto gray8 = decode_depth_png(png_of_kind(2, 8, PNG_COLOR_TYPE_GRAY, 0, {{7, 200}}), "gray.png");
  ASSERT_FALSE(gray8);
  EXPECT_EQ(to_string(gray8.error()), "gray.png: a depth image must be 16-bit gray; this is 8-bit gray");
  const auto color = decode_depth_png(encode_png(smooth_colors(4, 4)), "color.png");
  ASSERT_FALSE(color);
  EXPECT_EQ(to_string(color.error()), "color.png: a depth image must be 16-bit gray; this is 8-bit colour");
  const auto jpeg = decode_depth_png(encode_jpeg(smooth_colors(8, 8)), "c.jpg");
  ASSERT_FALSE(jpeg);
  EXPECT_EQ(jpeg.error().code, ErrorCode::kUnsupported);
}

TEST(JpegFile, RoundTripIsClose) {
  const auto image = smooth_colors(160, 120);
  const auto back = decode_color_image(encode_jpeg(image, 95), "x.jpg");
  ASSERT_TRUE(back) << to_string(back.error());
  ASSERT_EQ(back->width(), 160);
  double sum = 0;
  for (std::size_t i = 0; i < image.size(); ++i)
    sum += std::abs(image.pixels()[i].r - back->pixels()[i].r) +
           std::abs(image.pixels()[i].g - back->pixels()[i].g) +
           std::abs(image.pixels()[i].b - back->pixels()[i].b);
  EXPECT_LT(sum / static_cast<double>(3 * image.size()), 2.0);
}

TEST(ImageFile, MissingEmptyAndForeignFilesAreErrors) {
  const TemporaryFolder folder;
  EXPECT_EQ(read_color_image(folder.path() / "none.png").error().code, ErrorCode::kNotFound);
  EXPECT_EQ(read_color_image(folder.path()).error().code, ErrorCode::kUnreadable);
  ASSERT_TRUE(write_file_text(folder.path() / "empty.png", ""));
  EXPECT_EQ(read_depth_png(folder.path() / "empty.png").error().code, ErrorCode::kTruncated);
  ASSERT_TRUE(write_file_text(folder.path() / "text.png", "hello"));
  const auto text = read_color_image(folder.path() / "text.png");
  ASSERT_FALSE(text);
  EXPECT_EQ(text.error().where, folder.path() / "text.png");
  EXPECT_FALSE(write_png(folder.path() / "no" / "such" / "folder.png", smooth_colors(2, 2)));
  EXPECT_FALSE(write_png(folder.path() / "x.png", Image<Rgb8>()));
}

TEST(ImageFile, EveryPrefixIsAnErrorThatNamesTheFile) {
  const std::vector<std::uint8_t> files[] = {
      encode_png(smooth_colors(9, 7)), encode_jpeg(smooth_colors(24, 16)), encode_png(random_depth(6, 5, 4))};
  for (const auto& file : files) {
    for (std::size_t n = 0; n < file.size(); ++n) {
      // A heap copy of the exact size, so that a read past the end is seen by ASan.
      const std::vector<std::uint8_t> prefix(file.begin(), file.begin() + static_cast<std::ptrdiff_t>(n));
      const auto color = decode_color_image(prefix, "cut");
      ASSERT_FALSE(color) << n << " of " << file.size();
      EXPECT_EQ(color.error().where, "cut");
      EXPECT_FALSE(decode_depth_png(prefix, "cut"));
    }
  }
  const auto cut = decode_color_image(std::span(files[0]).first(files[0].size() - 5), "cut");
  EXPECT_EQ(cut.error().code, ErrorCode::kTruncated);
  EXPECT_NE(cut.error().message.find(std::to_string(files[0].size() - 5)), std::string::npos);
}

TEST(ImageFile, RandomCorruptionsNeverCrash) {
  const std::vector<std::uint8_t> files[] = {
      encode_png(smooth_colors(19, 11)), encode_jpeg(smooth_colors(40, 24)),
      encode_png(random_depth(16, 9, 5)),
      png_of_kind(2, 2, PNG_COLOR_TYPE_PALETTE, PNG_INTERLACE_ADAM7, {{0b11010000}, {0}})};
  Rng rng(77);
  int refused = 0;
  for (int round = 0; round < 2000; ++round) {
    auto bytes = files[round % 4];
    const std::uint32_t changes = 1 + rng.below(6);
    for (std::uint32_t i = 0; i < changes; ++i)
      bytes[rng.below(static_cast<std::uint32_t>(bytes.size()))] = static_cast<std::uint8_t>(rng.below(256));
    const auto color = decode_color_image(bytes, "bad");
    const auto depth = decode_depth_png(bytes, "bad");
    if (!color) ++refused;
    if (color) {
      EXPECT_LE(color->width(), kMaxImageEdge_px);
    }
    if (depth) {
      EXPECT_LE(depth->height(), kMaxImageEdge_px);
    }
  }
  // PNG carries checksums: nearly every change must be noticed there.
  EXPECT_GT(refused, 1300);
}

TEST(ImageFile, AHeaderThatClaimsTooMuchIsRefusedBeforeMemoryIsAskedFor) {
  // A valid header (with its checksum) of 16000 x 4000 on the data of a 2 x 2 image.
  auto huge = png_of_kind(2, 16, PNG_COLOR_TYPE_GRAY, 0, {{1, 2, 3, 4}, {5, 6, 7, 8}});
  const auto put_u32 = [&](std::size_t at, std::uint32_t value) {
    for (std::size_t i = 0; i < 4; ++i) huge[at + i] = static_cast<std::uint8_t>(value >> (24 - 8 * i));
  };
  put_u32(16, 16000);
  put_u32(20, 4000);
  put_u32(29, png_checksum(std::span(huge).subspan(12, 17)));
  const auto depth = decode_depth_png(huge, "huge");
  ASSERT_FALSE(depth);
  EXPECT_NE(depth.error().message.find("cannot hold an image of 16000 x 4000"), std::string::npos)
      << depth.error().message;
  put_u32(16, 16000);
  put_u32(20, 16000);
  EXPECT_FALSE(decode_depth_png(huge, "huge"));
}

TEST(DepthPicture, TheMarkOfNoReadingBecomes0) {
  const TemporaryFolder folder;
  Image<std::uint16_t> depth(5, 2, 1234);
  depth(1, 0) = 65535, depth(2, 1) = 65534, depth(4, 1) = 0;
  ASSERT_TRUE(write_png(folder.path() / "d.png", depth));
  const auto read = read_depth_image(folder.path() / "d.png");
  ASSERT_TRUE(read);
  depth(1, 0) = 0;
  EXPECT_TRUE(std::ranges::equal(read->pixels(), depth.pixels()));
  EXPECT_FALSE(read_depth_image(folder.path() / "none.png"));
}

/// A binary PGM as netpbm describes it; the largest value as a Kinect's tools write it.
std::vector<std::uint8_t> pgm_of(const Image<std::uint16_t>& image, const std::string& header) {
  std::vector<std::uint8_t> bytes(header.begin(), header.end());
  for (const std::uint16_t pixel : image.pixels()) {
    bytes.push_back(static_cast<std::uint8_t>(pixel >> 8U));
    bytes.push_back(static_cast<std::uint8_t>(pixel & 255U));
  }
  return bytes;
}

TEST(PgmFile, SixteenBitsAreReadHighByteFirst) {
  const TemporaryFolder folder;
  Image<std::uint16_t> raw(3, 2, 700);
  raw(1, 0) = 2047, raw(2, 1) = 0x0102;
  for (const char* header : {"P5 3 2 2047\n", "P5\n# a comment 9 9\n3 2\n2047\n"}) {
    ASSERT_TRUE(write_file_bytes(folder.path() / "d.pgm", pgm_of(raw, header)));
    const auto read = read_depth_image(folder.path() / "d.pgm");
    ASSERT_TRUE(read) << to_string(read.error());
    EXPECT_TRUE(std::ranges::equal(read->pixels(), raw.pixels()));
  }
}

TEST(PgmFile, EveryPrefixAndWrongHeadersAreErrorsThatNameThePlace) {
  const Image<std::uint16_t> raw(3, 2, 700);
  const auto whole = pgm_of(raw, "P5 3 2 2047\n");
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const auto read = decode_depth_pgm(std::span(whole).first(size), "d.pgm");
    ASSERT_FALSE(read) << size;
    EXPECT_NE(read.error().where.find("d.pgm"), std::string::npos);
  }
  for (const char* header :
       {"P5 3 2 255\n", "P5 3 2 65536\n", "P5 0 2 2047\n", "P5 -3 2 2047\n", "P5 99999 99999 2047\n",
        "P5 99999999999 2 2047\n", "P6 3 2 2047\n", "P5 a b c\n"})
    EXPECT_FALSE(decode_depth_pgm(pgm_of(raw, header), "d.pgm")) << header;
  const auto cut = decode_depth_pgm(std::span(whole).first(whole.size() - 1), "d.pgm");
  EXPECT_NE(to_string(cut.error()).find("byte 23"), std::string::npos) << to_string(cut.error());
}

TEST(ImageFile, SizeOfAPgmIsInItsHeader) {
  const TemporaryFolder folder;
  const auto size_of = [&](const char* text) {
    EXPECT_TRUE(write_file_text(folder.path() / "depth.pgm", text));
    return read_image_size(folder.path() / "depth.pgm");
  };
  EXPECT_EQ(size_of("P5\n# a sensor\n224 172\n65535\n"), (ImageSize{224, 172}));
  EXPECT_EQ(size_of("P5 3 2 255\n"), (ImageSize{3, 2}));
  EXPECT_EQ(size_of("P5\n224 172\n").error().code, ErrorCode::kCorrupted);
  EXPECT_FALSE(size_of("P5\n0 172\n65535\n"));
}

}  // namespace
}  // namespace hm
