#include "hm/geometry/state_bytes.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace hm {
namespace {

enum class Colour { kRed, kGreen, kBlue };

struct Item {
  std::int32_t number = 0;
  std::optional<double> maybe;
  template <class Archive>
  void visit_state(Archive& archive) {
    archive(number, maybe);
  }
};

struct Everything {
  bool yes = false;
  double value = 0;
  float small = 0;
  std::string text;
  std::array<std::uint64_t, 2> words{};
  Mat3 matrix = Mat3::Zero();
  SE3 pose;
  Time stamp;
  std::deque<Item> items;
  std::vector<std::uint8_t> raw;
  Colour colour = Colour::kRed;
  template <class Archive>
  void visit_state(Archive& archive) {
    archive(yes, value, small, text, words, matrix, pose, stamp, items, raw);
    archive.choice(colour, 3);
  }
};

Everything example() {
  Everything all;
  all.yes = true;
  all.value = 0.1 + 0.2;
  all.small = 1e-40F;
  all.text = std::string("a\0b", 3);
  all.words = {1, ~std::uint64_t{0}};
  all.matrix << 1, 2, 3, 4, 5, 6, 7, 8, 9;
  all.pose = SE3::exp((Vec6() << 1, 2, 3, 0.1, 0.2, 0.3).finished());
  all.stamp = {-5};
  all.items = {{7, {}}, {-8, 2.5}};
  all.raw = {0, 255};
  all.colour = Colour::kBlue;
  return all;
}

std::vector<std::uint8_t> bytes_of(Everything all) {
  StateWriter writer;
  writer(all);
  return writer.take();
}

TEST(StateBytes, EveryFieldComesBackToTheBit) {
  const Everything in = example();
  const auto bytes = bytes_of(in);
  StateReader reader(bytes);
  Everything out;
  reader(out);
  EXPECT_TRUE(reader.ok());
  EXPECT_EQ(reader.remaining(), 0u);
  EXPECT_EQ(out.yes, in.yes);
  EXPECT_EQ(out.value, in.value);
  EXPECT_EQ(out.text, in.text);
  EXPECT_EQ(out.words, in.words);
  EXPECT_EQ(out.matrix, in.matrix);
  EXPECT_EQ(out.pose.matrix(), in.pose.matrix());
  EXPECT_EQ(out.stamp, in.stamp);
  ASSERT_EQ(out.items.size(), 2u);
  EXPECT_EQ(out.items[0].maybe, in.items[0].maybe);
  EXPECT_EQ(out.items[1].number, -8);
  EXPECT_EQ(out.items[1].maybe, in.items[1].maybe);
  EXPECT_EQ(out.raw, in.raw);
  EXPECT_EQ(out.colour, in.colour);
  EXPECT_EQ(bytes_of(out), bytes) << "the single precision number too";
}

TEST(StateBytes, EveryPrefixIsRefused) {
  const auto bytes = bytes_of(example());
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    StateReader reader{std::span(bytes).first(size)};
    Everything out;
    reader(out);
    EXPECT_FALSE(reader.ok()) << size;
  }
}

TEST(StateBytes, RefusesWhatCannotBe) {
  const auto refused = [](Everything all) {
    const auto bytes = bytes_of(std::move(all));
    StateReader reader(bytes);
    Everything out;
    reader(out);
    return !reader.ok();
  };
  Everything all = example();
  all.value = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(refused(all));
  all = example();
  all.matrix(1, 2) = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(refused(all));
  all = example();
  all.pose = SE3(2 * Mat3::Identity(), Vec3::Zero());
  EXPECT_TRUE(refused(all)) << "not rigid";
  all = example();
  all.colour = static_cast<Colour>(3);
  EXPECT_TRUE(refused(all)) << "no such value";
  auto bytes = bytes_of(example());
  bytes[0] = 2;
  StateReader reader(bytes);
  bool yes = false;
  reader(yes);
  EXPECT_FALSE(reader.ok()) << "neither true nor false";
}

TEST(StateBytes, ACountAloneCostsNoMemory) {
  StateWriter writer;
  std::uint64_t count = std::uint64_t{1} << 60;
  writer(count);
  for (int kind = 0; kind < 3; ++kind) {
    StateReader reader(writer.bytes());
    std::vector<double> numbers;
    std::string text;
    std::vector<std::uint8_t> raw;
    kind == 0 ? reader(numbers) : kind == 1 ? reader(text) : reader(raw);
    EXPECT_FALSE(reader.ok());
    EXPECT_LE(numbers.capacity(), 2u);
  }
}

}  // namespace
}  // namespace hm
