#include "hm/io/pose/relations_file.hpp"

#include <gmock/gmock.h>

#include "hm/geometry/se2.hpp"
#include "hm/io/laser/laser_recording.hpp"
#include "hm/io/testing/io_test_support.hpp"

namespace hm {
namespace {

using ::testing::HasSubstr;

TEST(RelationsFile, Reads) {
  const TemporaryFolder folder;
  test::write_bytes(folder / "a.relations",
                    "# t1 t2 x y z roll pitch yaw\n"
                    "976052905.167303 976052911.885496 -0.056990 -0.128430 0.5 0.1 0.2 -1.682210\n\n"
                    "976052912 976052911 1 2 3 0 0 0\n976052912 97605");
  const auto list = read_relations(folder / "a.relations");
  ASSERT_TRUE(list) << to_string(list.error());
  ASSERT_EQ(list->relations.size(), 2U);
  const PoseRelation& first = list->relations[0];
  EXPECT_EQ(first.from.ns, 976'052'905'167'303'000);
  EXPECT_EQ(first.to.ns, 976'052'911'885'496'000);
  EXPECT_EQ(first.T_from_to.translation(), Vec3(-0.056990, -0.128430, 0.5));
  EXPECT_LT((roll_pitch_yaw(first.T_from_to.rotation()) - Vec3(0.1, 0.2, -1.682210)).norm(), 1e-12);
  ASSERT_EQ(list->skipped.size(), 1U);
  EXPECT_EQ(list->skipped[0].reason, SkippedLines::Reason::kCutOff);
}

TEST(RelationsFile, MistakesAreNamed) {
  const TemporaryFolder folder;
  for (const std::string text :
       {"1 2 3\n", "1 2 0 0 0 0 0 nan\n", "1 2 0 0 0 0 0 0 0\n", "a 2 0 0 0 0 0 0\n"}) {
    test::write_bytes(folder / "a.relations", "1 2 0 0 0 0 0 0\n" + text);
    const auto list = read_relations(folder / "a.relations");
    ASSERT_FALSE(list) << text;
    EXPECT_THAT(list.error().where, HasSubstr("a.relations:2"));
  }
  test::write_bytes(folder / "a.relations", "");
  EXPECT_FALSE(read_relations(folder / "a.relations"));
  EXPECT_FALSE(read_relations(folder / "none"));
}

TEST(RelationsFile, MendedStampsReplaceWrittenOnes) {
  const auto s = [](double seconds) { return Time::from_seconds(seconds); };
  std::vector<PoseRelation> relations = {{s(1), s(2), {}}, {s(3), s(1), {}}, {s(2.5), s(4), {}}};
  const std::vector<CorrectedStamp> corrected = {{s(1), s(1.5)}, {s(3), s(3.5)}};
  correct_relations(relations, corrected);
  EXPECT_EQ(relations[0].from, s(1.5));
  EXPECT_EQ(relations[0].to, s(2));
  EXPECT_EQ(relations[1].from, s(3.5));
  EXPECT_EQ(relations[1].to, s(1.5));
  EXPECT_EQ(relations[2].from, s(2.5));
  EXPECT_EQ(relations[2].to, s(4));
}

TEST(RelationsFile, EveryDamageIsAnErrorOrRelations) {
  const TemporaryFolder folder;
  const std::string text =
      "976052905.167303 976052911.885496 -0.05 -0.12 0.5 0.1 0.2 -1.68\n1 2 3 4 5 6 7 8\n";
  test::for_each_damaged(text, 500, [&](const std::string& bytes) {
    test::write_bytes(folder / "damaged", bytes);
    const auto list = read_relations(folder / "damaged");
    if (!list) return;
    for (const PoseRelation& relation : list->relations) EXPECT_TRUE(is_rigid(relation.T_from_to));
  });
}

}  // namespace
}  // namespace hm
