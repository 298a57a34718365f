#include "hm/io/lists/stamped_list.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "hm/core/rng.hpp"
#include "hm/io/bytes/file_bytes.hpp"
#include "hm/io/bytes/text_lines.hpp"
#include "hm/io/camera/camera_file.hpp"
#include "hm/io/testing/temporary_folder_test_support.hpp"

namespace hm::detail {
namespace {

TEST(TextLines, BlankLinesCommentsCrlfAndByteOrderMark) {
  const TextFile file("\xEF\xBB\xBFone 1\r\n\r\n  # a comment\r\n\t two\t2 \n\nthree", "x.txt");
  const auto lines = file.lines();
  ASSERT_EQ(lines.size(), 3U);
  EXPECT_EQ(lines[0].text, "one 1");
  EXPECT_EQ(lines[1].text, "two\t2");
  EXPECT_EQ(file.where(lines[1]), "x.txt:4");
  EXPECT_TRUE(lines[1].ended);
  EXPECT_FALSE(lines[2].ended);
  EXPECT_EQ(words(lines[1].text), (std::vector<std::string_view>{"two", "2"}));
  EXPECT_EQ(file.comments(), (std::vector<std::string_view>{"# a comment"}));
  EXPECT_TRUE(words("  \t ").empty());
  EXPECT_EQ(cells("a, b c ,,d", ','), (std::vector<std::string_view>{"a", "b c", "", "d"}));
}

TEST(TextLines, StampsAreExact) {
  EXPECT_EQ(parse_stamp("1305031102.160407123")->ns, 1305031102160407123);
  EXPECT_EQ(parse_stamp("1305031102.160407")->ns, 1305031102160407000);
  EXPECT_EQ(parse_stamp("0.000000001")->ns, 1);
  EXPECT_EQ(parse_stamp("-0.5")->ns, -500000000);
  EXPECT_EQ(parse_stamp("1.305031102160407e+09")->ns, 1305031102160407000);
  EXPECT_EQ(parse_stamp("7")->ns, 7000000000);
  EXPECT_EQ(parse_stamp("1305031102160")->ns, 1305031102160000000);  // milliseconds
  EXPECT_EQ(parse_stamp("1305031102160.25")->ns, 1305031102160250000);
  EXPECT_EQ(parse_stamp("1305031102160407")->ns, 1305031102160407000);
  EXPECT_EQ(parse_stamp("1305031102160407123")->ns, 1305031102160407123);
  for (const char* bad : {"", "x", "1.2.3", "nan", "inf", "1e300", "12s", "9999999999999", "130503110216",
                          "1305031102160x", "1305031102160.1.2"})
    EXPECT_FALSE(parse_stamp(bad)) << bad;
  for (const std::int64_t ns : {0L, 1L, -1L, -500000000L, 1305031102160407123L})
    EXPECT_EQ(parse_stamp(stamp_text({ns}))->ns, ns);
  EXPECT_EQ(stamp_text({-1500000000}), "-1.500000000");
  EXPECT_TRUE(std::isnan(*parse_number("nan")));
  EXPECT_EQ(*parse_number("+1e-3"), 1e-3);
  EXPECT_FALSE(parse_number("1,5"));
}

TEST(LongestIncreasing, IsIncreasingAndAsLongAsTheSlowReferenceSays) {
  Rng rng(5);
  for (int round = 0; round < 300; ++round) {
    std::vector<Time> stamps(rng.below(30));
    for (Time& t : stamps) t.ns = rng.below(20);
    const auto kept = longest_increasing(stamps);
    for (std::size_t k = 1; k < kept.size(); ++k) {
      EXPECT_LT(kept[k - 1], kept[k]);
      EXPECT_LT(stamps[kept[k - 1]], stamps[kept[k]]);
    }
    std::size_t longest = 0;  // quadratic: the longest run that ends at each element
    std::vector<std::size_t> length(stamps.size(), 1);
    for (std::size_t i = 0; i < stamps.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j)
        if (stamps[j] < stamps[i]) length[i] = std::max(length[i], length[j] + 1);
      longest = std::max(longest, length[i]);
    }
    EXPECT_EQ(kept.size(), longest);
  }
}

TEST(Associate, MatchesTheGreedyReference) {
  Rng rng(6);
  for (int round = 0; round < 200; ++round) {
    std::vector<Time> a, b;
    for (std::int64_t t = 0, n = rng.below(20); n > 0; --n) a.push_back({t += 1 + rng.below(50)});
    for (std::int64_t t = 0, n = rng.below(20); n > 0; --n) b.push_back({t += 1 + rng.below(50)});
    // Reference: again and again the closest free pair (ties: first in a, then in b).
    std::vector<std::optional<std::size_t>> expected(a.size());
    std::vector<bool> used(b.size());
    while (true) {
      std::int64_t closest = 21;
      std::size_t best_i = 0, best_j = 0;
      for (std::size_t i = 0; i < a.size(); ++i)
        for (std::size_t j = 0; j < b.size(); ++j)
          if (!expected[i] && !used[j] && std::abs((a[i] - b[j]).ns) < closest) {
            closest = std::abs((a[i] - b[j]).ns);
            best_i = i;
            best_j = j;
          }
      if (closest > 20) break;
      expected[best_i] = best_j;
      used[best_j] = true;
    }
    EXPECT_EQ(associate(a, b, Duration{20}), expected);
  }
}

class ListFile : public ::testing::Test {
 protected:
  std::filesystem::path write(const std::string& text) {
    EXPECT_TRUE(write_file_text(folder_.path() / "list.txt", text));
    return folder_.path() / "list.txt";
  }
  std::string line(int number) const {
    return (folder_.path() / "list.txt").string() + ":" + std::to_string(number);
  }
  TemporaryFolder folder_;
};

TEST_F(ListFile, BackwardAndRepeatedStampsAreLeftOutAndCounted) {
  const auto list = read_image_list(
      write("1.0 a.png\n2.0 b.png\n3 c.png\n1.5 d.png\n3 e.png\n99 f.png\n4 g.png\n5 h h.png\n"));
  ASSERT_TRUE(list);
  std::vector<std::string> kept;
  for (const StampedImage& picture : list->images) kept.push_back(picture.path);
  // One stamp far ahead does not cost those behind it.
  EXPECT_EQ(kept, (std::vector<std::string>{"a.png", "b.png", "c.png", "g.png", "h h.png"}));
  ASSERT_EQ(list->skipped.size(), 1U);
  EXPECT_EQ(list->skipped[0].count, 3U);
  EXPECT_EQ(to_string(list->skipped[0]),
            "3 lines of list.txt left out: stamps that run backwards or repeat (first: list.txt:4)");
}

/// A list that was written in the order of a folder's listing once kept 12 of 101 frames.
TEST_F(ListFile, ImagesInNoOrderOfTimeAreSorted) {
  std::string text;
  for (int i = 0; i < 100; ++i) {
    const int frame = 37 * i % 100;
    text += fmt::format("{}.5 {}.png\n", frame, frame);
  }
  const auto list = read_image_list(write(text + "37.5 again.png\n"));
  ASSERT_TRUE(list) << to_string(list.error());
  ASSERT_EQ(list->images.size(), 100U);
  for (int i = 0; i < 100; ++i) {
    EXPECT_EQ(list->images[static_cast<std::size_t>(i)].path, fmt::format("{}.png", i));
    EXPECT_EQ(list->images[static_cast<std::size_t>(i)].stamp, Time::from_seconds(i + 0.5));
  }
  ASSERT_EQ(list->skipped.size(), 1U);
  EXPECT_EQ(list->skipped[0].first_line, 101U);
}

TEST_F(ListFile, AMalformedLineNamesItsPlace) {
  for (const auto& [text, number] : std::vector<std::pair<std::string, int>>{
           {"# c\n1.0 a.png\nx b.png\n", 3}, {"1.0\n", 1}, {"1.0 a\n\nnan b\n", 3}}) {
    const auto list = read_image_list(write(text));
    ASSERT_FALSE(list) << text;
    EXPECT_EQ(list.error().where, line(number));
    EXPECT_EQ(list.error().code, ErrorCode::kCorrupted);
  }
  EXPECT_EQ(read_associations(write("1 rgb/1.png 1 depth/1.png\n2 a.png 2 b.png\n")).error().where, line(2));
}

TEST_F(ListFile, ACutOffLastLineIsLeftOut) {
  const auto list = read_image_list(write("1 a.png\n2"));
  ASSERT_TRUE(list);
  EXPECT_EQ(list->images.size(), 1U);
  ASSERT_EQ(list->skipped.size(), 1U);
  EXPECT_EQ(list->skipped[0].reason, SkippedLines::Reason::kCutOff);
}

TEST_F(ListFile, PathsOfWindowsHaveSlashes) {
  const auto list = read_image_list(write("1 depth\\1.png\r\n2 a b\\2.png\r\n"));
  ASSERT_TRUE(list);
  EXPECT_EQ(list->images[0].path, "depth/1.png");
  EXPECT_EQ(list->images[1].path, "a b/2.png");
  const auto both = read_associations(write("1 rgb\\1.png 1 depth\\1.png\r\n"));
  ASSERT_TRUE(both);
  EXPECT_EQ(both->depth.images[0].path, "depth/1.png");
  EXPECT_EQ(both->color.images[0].path, "rgb/1.png");
}

TEST_F(ListFile, AssociationsInEitherOrder) {
  for (const char* text : {"1.5 rgb/a.png 1.25 depth/b.png\n", "1.25 depth/b.png 1.5 rgb/a.png\n"}) {
    const auto list = read_associations(write(text));
    ASSERT_TRUE(list);
    EXPECT_EQ(list->depth.images[0].path, "depth/b.png");
    EXPECT_EQ(list->depth.images[0].stamp, Time::from_seconds(1.25));
    EXPECT_EQ(list->color.images[0].stamp, Time::from_seconds(1.5));
  }
}

TEST_F(ListFile, CameraFileRoundTripAndComments) {
  const PinholeCamera camera{640,
                             480,
                             517.306408,
                             -516.469215,
                             318.64304,
                             255.313989,
                             {0.262383, -0.953104, -0.005358, 0.002628, 1.163314}};
  const auto back = read_camera_file(write(camera_file_text(camera, 5000)));
  ASSERT_TRUE(back) << to_string(back.error());
  EXPECT_EQ(back->camera.fx, camera.fx);
  EXPECT_EQ(back->camera.fy, camera.fy);
  EXPECT_EQ(back->camera.cy, camera.cy);
  EXPECT_EQ(back->camera.distortion.k3, camera.distortion.k3);
  EXPECT_EQ(back->camera.distortion.p1, camera.distortion.p1);
  EXPECT_EQ(back->depth_units_per_m, 5000.0);
  const auto other =
      read_camera_file(write("fx: 500 # pixels\r\nfy = 501\r\ncx 1\ncy 2\nlens wide\nrate_hz 15"));
  ASSERT_TRUE(other) << to_string(other.error());
  EXPECT_EQ(other->camera.fy, 501);
  EXPECT_EQ(other->camera.width, 0);
  EXPECT_EQ(other->rate_hz, 15.0);
  EXPECT_EQ(other->unknown_keys, (std::vector<std::string>{"lens"}));
}

TEST_F(ListFile, CameraFileErrorsNameTheLine) {
  EXPECT_EQ(read_camera_file(write("fx 1\nfy nan\ncx 1\ncy 1\n")).error().where, line(2));
  EXPECT_EQ(read_camera_file(write("fx 1\nfx 2\nfy 1\ncx 1\ncy 1\n")).error().where, line(2));
  EXPECT_EQ(read_camera_file(write("fx 1\nfy 1\ncx 1\ncy 1\nwidth 0\n")).error().where, line(5));
  EXPECT_EQ(read_camera_file(write("fx 1\nfy 1\ncx 1\ncy 1\ndepth_scale -5\n")).error().where, line(5));
  const auto realsense = read_camera_file(write("fx 1\nfy 1\ncx 1\ncy 1\ndepth_scale 0.001\n"));
  ASSERT_FALSE(realsense);
  EXPECT_EQ(realsense.error().where, line(5));
  EXPECT_EQ(realsense.error().message,
            "depth_scale 0.001 looks like metres per unit: write 1000 (units per metre)");
  EXPECT_TRUE(read_camera_file(write("fx 1\nfy 1\ncx 1\ncy 1\ndepth_scale 1\nrate_hz 0.5\n")));
  EXPECT_EQ(read_camera_file(write("fx 1\ncx 1\n")).error().message,
            "fy, cy missing: write one `key value` a line, as `fx 525`");
  EXPECT_FALSE(read_camera_file(write("fx 0\nfy 1\ncx 1\ncy 1\n")));
  EXPECT_FALSE(read_camera_file(write("")));
}

TEST_F(ListFile, NumbersWithoutNamesAreACameraWhereThereAreFour) {
  for (const char* text : {"525 526 319.5 239.5\n", "525\n526\n319.5\n239.5\n", "525, 526, 319.5, 239.5",
                           "525 0 319.5\n0 526 239.5\n0 0 1\n"}) {
    const auto read = read_camera_file(write(text));
    ASSERT_TRUE(read) << text << to_string(read.error());
    EXPECT_EQ(read->camera.fx, 525);
    EXPECT_EQ(read->camera.fy, 526);
    EXPECT_EQ(read->camera.cx, 319.5);
    EXPECT_EQ(read->camera.cy, 239.5);
    EXPECT_EQ(read->camera.width, 0);
    EXPECT_FALSE(read->depth_units_per_m);
  }
  EXPECT_THAT(read_camera_file(write("525 526 319.5 239.5 1000")).error().message,
              ::testing::StartsWith("5 numbers without names, where fx fy cx cy alone"));
  EXPECT_FALSE(read_camera_file(write("525 526 319.5 1e9")));
}

TEST_F(ListFile, ImplausibleIntrinsicsAreRefusedWithTheNumber) {
  for (const auto& [fx, cx, number] : {std::tuple{"1e300", "320", "fx = 1e+300"},
                                       {"1e-3", "320", "fx = 0.001"},
                                       {"525", "-1e9", "cx = -1000000000"}}) {
    const auto text = fmt::format("width 640\nheight 480\nfx {}\nfy 525\ncx {}\ncy 240\n", fx, cx);
    const auto camera = read_camera_file(write(text));
    ASSERT_FALSE(camera) << text;
    EXPECT_THAT(camera.error().message, ::testing::HasSubstr(number));
  }
  EXPECT_FALSE(read_intrinsics_matrix(write("1e300 0 320\n0 525 240\n0 0 1")));
}

TEST_F(ListFile, IntrinsicsMatrix) {
  const auto camera = read_intrinsics_matrix(write("5.85e+02 0 3.2e+02\n0 5.84e+02 2.4e+02 \n 0 0 1\n"));
  ASSERT_TRUE(camera);
  EXPECT_EQ(camera->fy, 584);
  EXPECT_EQ(camera->cx, 320);
  EXPECT_FALSE(read_intrinsics_matrix(write("1 2 3 4")));
  EXPECT_FALSE(read_intrinsics_matrix(write("585 0 320 0 585 240 0 0 2")));
  EXPECT_EQ(read_intrinsics_matrix(write("585 0 320\n0 z 240\n0 0 1")).error().where, line(2));
}

TEST(KnownCamera, TumByName) {
  EXPECT_EQ(known_tum_camera("rgbd_dataset_freiburg1_xyz")->fx, 517.3);
  EXPECT_EQ(known_tum_camera("tum_fr2_desk")->fx, 520.9);
  EXPECT_EQ(known_tum_camera("tum_fr1_xyz_part")->fx, 517.3);
  EXPECT_EQ(known_tum_camera("fr2_large_with_loop.bag")->fx, 520.9);
  EXPECT_TRUE(known_tum_camera("Freiburg3_long_office_household")->distortion.is_zero());
  EXPECT_EQ(known_bonn_camera("rgbd_bonn_crowd2")->fx, 542.822841);
  EXPECT_FALSE(known_bonn_camera("bonn"));
  for (const char* name : {"kitchen", "my_fr2024", "fr2024", "fr2", "fr2_kitchen", "my_fr2_desk", "fr4_desk",
                           "fr", "freiburg", "fr1_xyzzy", "fr1_large_no_loop", "from1_xyz", ""})
    EXPECT_FALSE(known_tum_camera(name)) << name;
}

}  // namespace
}  // namespace hm::detail
