#pragma once
#include <gtest/gtest.h>

#include <string>

#include "hm/core/rng.hpp"
#include "hm/io/bytes/file_bytes.hpp"
#include "hm/io/image/image_file.hpp"
#include "hm/io/rgbd/recording.hpp"
#include "hm/io/rgbd/tum_writer.hpp"
#include "hm/io/testing/real_data_test_support.hpp"
#include "hm/io/testing/temporary_folder_test_support.hpp"

/// Small recordings for tests of readers.
namespace hm::testing_recordings {

inline const PinholeCamera kSmallCamera{24, 16, 20.0, 21.0, 11.5, 7.5, {}};

inline DepthImage random_depth(int width, int height, std::uint64_t seed, double unit_m = 1.0 / 5000) {
  Rng rng(seed);
  DepthImage depth{Image<std::uint16_t>(width, height), unit_m};
  for (auto& units : depth.units.pixels()) units = static_cast<std::uint16_t>(rng.below(65535));
  return depth;
}

inline Image<Rgb8> random_color(int width, int height, std::uint64_t seed) {
  Rng rng(seed);
  Image<Rgb8> color(width, height);
  for (Rgb8& p : color.pixels())
    p = {static_cast<std::uint8_t>(rng.below(256)), static_cast<std::uint8_t>(rng.below(256)),
         static_cast<std::uint8_t>(rng.below(256))};
  return color;
}

inline SE3 random_pose(std::uint64_t seed) {
  Rng rng(seed);
  Vec6 twist;
  for (int i = 0; i < 6; ++i) twist[i] = rng.uniform(-1.5, 1.5);
  return SE3::exp(twist);
}

/// Frame i of a recording at 10 Hz, with epoch stamps that need every nanosecond.
inline RgbdFrame small_frame(std::size_t i) {
  RgbdFrame frame;
  frame.index = i;
  frame.stamp = Time{1305031102'160407123 + static_cast<std::int64_t>(i) * 100'000'007};
  frame.color_stamp = frame.stamp + Duration{3'000'001};
  frame.depth = random_depth(kSmallCamera.width, kSmallCamera.height, i + 1);
  frame.color = random_color(kSmallCamera.width, kSmallCamera.height, i + 100);
  frame.T_world_camera = random_pose(i + 200);
  return frame;
}

inline void write_small_tum(const std::filesystem::path& folder, std::size_t frames) {
  auto writer = TumWriter::create(folder, kSmallCamera);
  ASSERT_TRUE(writer) << to_string(writer.error());
  for (std::size_t i = 0; i < frames; ++i) ASSERT_TRUE(writer->add(small_frame(i)));
  ASSERT_TRUE(writer->finish());
}

inline std::string matrix_text(const Mat4& m) {
  std::string text;
  for (int r = 0; r < 4; ++r) text += fmt::format("{} {} {} {}\n", m(r, 0), m(r, 1), m(r, 2), m(r, 3));
  return text;
}

/// Writes frame-XXXXXX.{depth.png,color.png,pose.txt}, depth in millimetres.
inline void write_seven_scenes_frame(const std::filesystem::path& folder, std::size_t number,
                                     const std::string& pose_text) {
  std::filesystem::create_directories(folder);
  const std::string stem = fmt::format("frame-{:06}", number);
  ASSERT_TRUE(write_png(folder / (stem + ".depth.png"), random_depth(32, 24, number).units));
  ASSERT_TRUE(write_png(folder / (stem + ".color.png"), random_color(32, 24, number)));
  ASSERT_TRUE(write_file_text(folder / (stem + ".pose.txt"), pose_text));
}

/// Writes an ICL-NUIM folder: associations.txt with frame numbers, depth first as in the published data.
inline void write_small_icl(const std::filesystem::path& folder, std::size_t frames) {
  std::filesystem::create_directories(folder / "depth");
  std::filesystem::create_directories(folder / "rgb");
  std::string associations, poses;
  for (std::size_t i = 1; i <= frames; ++i) {
    ASSERT_TRUE(write_png(folder / "depth" / fmt::format("{}.png", i), random_depth(32, 24, i).units));
    ASSERT_TRUE(write_png(folder / "rgb" / fmt::format("{}.png", i), random_color(32, 24, i)));
    associations += fmt::format("{0} depth/{0}.png {0} rgb/{0}.png\n", i);
    poses += fmt::format("{} {} 0 -2.5 0 0 0 1\n", i, 0.25 * static_cast<double>(i));
  }
  ASSERT_TRUE(write_file_text(folder / "associations.txt", associations));
  ASSERT_TRUE(write_file_text(folder / "groundtruth.txt", poses));
}

inline std::string file_text(const std::filesystem::path& path) {
  const auto bytes = read_file_bytes(path);
  EXPECT_TRUE(bytes);
  return bytes ? std::string(bytes->begin(), bytes->end()) : std::string();
}

inline bool same_pixels(const auto& a, const auto& b) {
  return a.width() == b.width() && a.height() == b.height() && std::ranges::equal(a.pixels(), b.pixels());
}

inline double pose_difference(const SE3& a, const SE3& b) {
  return (a.matrix() - b.matrix()).cwiseAbs().maxCoeff();
}

inline std::filesystem::path real_recording(const std::string& name) {
  return real_data_folder() / "rgbd" / name;
}

}  // namespace hm::testing_recordings
