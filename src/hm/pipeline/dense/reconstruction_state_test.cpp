#include "hm/pipeline/dense/reconstruction_state.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "hm/core/rng.hpp"

namespace hm {
namespace {

ReconstructionState random_state(Rng& rng) {
  ReconstructionState state;
  state.recording = "a \"quoted\" folder/\xc3\xa4";
  state.kind = RecordingKind::kIclNuim;
  state.first_stamp = {1305031102160407000};
  state.next_frame = 17;
  state.frames_read = 15;
  state.frames_integrated = 12;
  state.volumes_refused = 3;
  state.skipped = {{2, "no pose"}, {5, "unreadable: depth/5.png: ends at byte 200"}};
  state.interior_marks = {{-3, 0, 7}, {1, 2, -300}};
  for (int i = 0; i < 12; ++i) {
    const Vec3 axis(rng.normal(), rng.normal(), rng.normal());
    state.trajectory.push_back({{state.first_stamp.ns + i * 33333333},
                                SE3(so3_exp(axis), 100 * Vec3(rng.normal(), rng.normal(), 0))});
  }
  return state;
}

TEST(ReconstructionState, ReadsBackExactly) {
  Rng rng(1);
  for (int round = 0; round < 20; ++round) {
    const ReconstructionState state = random_state(rng);
    const auto back = state_from_json(state_to_json(state), "map");
    ASSERT_TRUE(back) << to_string(back.error());
    EXPECT_EQ(state_to_json(*back), state_to_json(state));
    EXPECT_EQ(back->interior_marks, state.interior_marks);
    ASSERT_EQ(back->trajectory.size(), 12u);
    for (std::size_t i = 0; i < 12; ++i) {
      EXPECT_EQ(back->trajectory[i].stamp.ns, state.trajectory[i].stamp.ns);
      EXPECT_EQ(back->trajectory[i].T_world_base.matrix(), state.trajectory[i].T_world_base.matrix());
    }
  }
}

TEST(ReconstructionState, DamagedTextIsAnErrorOrHarmless) {
  Rng rng(2);
  const std::string good = state_to_json(random_state(rng));
  for (std::size_t length = 0; length < good.size(); length += 7)
    EXPECT_FALSE(state_from_json(good.substr(0, length), "map"));
  for (int round = 0; round < 2000; ++round) {
    std::string text = good;
    text[rng.below(static_cast<std::uint32_t>(text.size()))] = static_cast<char>(rng.below(256));
    (void)state_from_json(text, "map");  // must not crash
  }
  for (const char* text :
       {"", "null", "[]", "{}", "{\"state_version\": 99}", "{\"state_version\": \"1\"}",
        "{\"state_version\": 1, \"kind\": 3}", "{\"state_version\": 1, \"kind\": 4294967296}"})
    EXPECT_FALSE(state_from_json(text, "map")) << text;
}

TEST(ReconstructionState, ResumingNeedsTheSameParametersAndRecording) {
  Rng rng(3);
  const ReconstructionState state = random_state(rng);
  RecordingInfo info;
  info.kind = state.kind;
  info.frame_count = 100;
  info.stamps = {state.first_stamp};
  DenseParameters parameters;
  MapHeader header;
  header.parameters_toml = list_reconstruction(parameters).to_toml();
  EXPECT_TRUE(check_resumable(header, header, state, info, parameters, "map"));

  DenseParameters other = parameters;
  other.tsdf.voxel_size_m = 0.05;
  other.mesh.simplify_keep_ratio = 0.1;
  const auto differs = check_resumable(header, header, state, info, other, "map");
  ASSERT_FALSE(differs);
  EXPECT_EQ(differs.error().code, ErrorCode::kUsage);
  EXPECT_THAT(differs.error().message, testing::HasSubstr("tsdf.voxel_size_m = 0.02 (now 0.05)"));
  EXPECT_THAT(differs.error().message, testing::Not(testing::HasSubstr("simplify")));

  RecordingInfo later = info;
  later.stamps = {{state.first_stamp.ns + 1}};
  EXPECT_FALSE(check_resumable(header, header, state, later, parameters, "map"));
  RecordingInfo shorter = info;
  shorter.frame_count = 10;
  EXPECT_FALSE(check_resumable(header, header, state, shorter, parameters, "map"));

  MapHeader crafted = header;
  crafted.voxel_size_m += 0.01;
  const auto contradicts = check_resumable(crafted, header, state, info, parameters, "map");
  ASSERT_FALSE(contradicts);
  EXPECT_EQ(contradicts.error().code, ErrorCode::kCorrupted);
  EXPECT_THAT(contradicts.error().message, ::testing::HasSubstr("its header says voxels of"));
}

}  // namespace
}  // namespace hm
