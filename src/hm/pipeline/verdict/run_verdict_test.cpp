#include "hm/pipeline/verdict/run_verdict.hpp"

#include <gtest/gtest.h>

namespace hm {
namespace {

constexpr VisitLimits kLimits{9, 0.25, 0.6, 0.4};

std::vector<VisitComparison> comparisons(std::size_t count, double ratio) {
  std::vector<VisitComparison> all;
  for (std::size_t i = 0; i < count; ++i) all.push_back({static_cast<double>(i), ratio});
  return all;
}

RunVerdict judged(const std::vector<VisitComparison>& all) {
  RunVerdict verdict;
  judge_visits(all, kLimits, "scans", verdict);
  return verdict;
}

TEST(RunVerdict, IsTheGravestOfAllAndLeadsWithItsReason) {
  RunVerdict verdict;
  EXPECT_EQ(verdict.value, MapVerdict::kOk);
  EXPECT_FALSE(strict_failure(verdict));
  verdict.add(MapVerdict::kOk, "nothing");
  verdict.add(MapVerdict::kDoubtful, "first");
  verdict.add(MapVerdict::kBroken, "second");
  verdict.add(MapVerdict::kDoubtful, "third");
  EXPECT_EQ(verdict.value, MapVerdict::kBroken);
  EXPECT_EQ(verdict.reasons, (std::vector<std::string>{"second", "first", "third"}));
  EXPECT_EQ(verdict_sentence(verdict, "A map."), "Broken: second. A map.");
  EXPECT_EQ(report_verdict(verdict), HtmlReport::Verdict::kBad);
  EXPECT_EQ(strict_failure(verdict)->message, "the verdict is broken: second; first; third");
  EXPECT_EQ(describe(verdict).sentence("{text}"), "broken: second; first; third");
}

TEST(RunVerdict, AMapThatItsMemoryLimitHasCutIsDoubtful) {
  RunVerdict verdict;
  std::vector<std::string> warnings;
  judge_memory_limit({"tsdf.max_map_mb", 0, 7, "block"}, warnings, verdict);
  judge_memory_limit({"tsdf.max_map_mb", 2, 0, "block"}, warnings, verdict);
  EXPECT_EQ(verdict.value, MapVerdict::kOk);
  judge_memory_limit({"tsdf.max_map_mb", 2, 7, "block"}, warnings, verdict);
  EXPECT_EQ(verdict.value, MapVerdict::kDoubtful);
  EXPECT_EQ(
      warnings,
      (std::vector<std::string>{"the memory cap of 2 MB (tsdf.max_map_mb) was reached: 7 blocks not added"}));
}

TEST(RunVerdict, IsReadBackFromAReport) {
  RunVerdict verdict;
  verdict.add(MapVerdict::kBroken, "first");
  verdict.add(MapVerdict::kDoubtful, "second");
  JsonValue report;
  report["verdict"] = to_json(verdict);
  const RunVerdict again = verdict_of_report(report);
  EXPECT_EQ(again.value, verdict.value);
  EXPECT_EQ(again.reasons, verdict.reasons);
  EXPECT_EQ(verdict_of_report({}).value, MapVerdict::kOk);
  report["verdict"] = JsonValue::object({{"value", "broken"}});
  EXPECT_EQ(verdict_of_report(report).reasons.size(), 1u);
}

TEST(RunVerdict, NothingSeenTwiceIsNoReason) {
  EXPECT_EQ(judged({}).value, MapVerdict::kOk);
  EXPECT_EQ(judged({}).visits->places, 0u);
}

TEST(RunVerdict, ATornStretchIsFoundAndNamed) {
  auto all = comparisons(400, 0.05);
  for (std::size_t i = 200; i < 209; ++i) all[i].contradicted_ratio = 0.8;
  const RunVerdict verdict = judged(all);
  EXPECT_EQ(verdict.value, MapVerdict::kBroken);
  EXPECT_NEAR(verdict.visits->worst_time_s, 204, 5);  // within half a window
  EXPECT_NE(verdict.reasons.front().find("80 %"), std::string::npos) << verdict.reasons.front();
  EXPECT_NEAR(verdict.visits->p95_ratio, 0.05, 1e-9);
  EXPECT_EQ(verdict.visits->medians.size(), all.size());
}

TEST(RunVerdict, SinglePlacesAmongGoodOnesAreOutliers) {
  auto all = comparisons(400, 0.05);
  for (std::size_t i = 0; i < all.size(); i += 7) all[i].contradicted_ratio = 0.9;
  EXPECT_EQ(judged(all).value, MapVerdict::kOk);
}

/// Three scans that are two metres apart: a few metres of a wrong path, in a window of nine an outlier.
TEST(RunVerdict, WhereScansAreFarApartAWindowHasFewer) {
  auto all = comparisons(200, 0.05);
  for (std::size_t i = 100; i < 103; ++i) all[i].contradicted_ratio = 0.7;
  const auto verdict_of = [&](double step_m, double window_m) {
    for (std::size_t i = 0; i < all.size(); ++i) all[i].place_m = {step_m * static_cast<double>(i), 0};
    RunVerdict verdict;
    VisitLimits limits = kLimits;
    limits.window_m = window_m;
    judge_visits(all, limits, "scans", verdict);
    return verdict.value;
  };
  EXPECT_EQ(verdict_of(2, 4.5), MapVerdict::kBroken);
  EXPECT_EQ(verdict_of(2, 0), MapVerdict::kOk);
  EXPECT_EQ(verdict_of(0.5, 4.5), MapVerdict::kOk) << "a metre and a half: people, a door";
}

TEST(RunVerdict, ModerateContradictionsAreDoubtfulAndBrokenWhenWidespread) {
  auto all = comparisons(400, 0.05);
  for (std::size_t i = 200; i < 212; ++i) all[i].contradicted_ratio = 0.45;
  EXPECT_EQ(judged(all).value, MapVerdict::kDoubtful);
  for (std::size_t i = 200; i < 260; ++i) all[i].contradicted_ratio = 0.45;
  EXPECT_EQ(judged(all).value, MapVerdict::kBroken);
}

TEST(RunVerdict, FewComparisonsCallBrokenOnlyWhatMostOfThemContradictNearlyAllOf) {
  EXPECT_EQ(judged(comparisons(3, 0.9)).value, MapVerdict::kDoubtful);
  EXPECT_EQ(judged(comparisons(3, 0.1)).value, MapVerdict::kOk);
  EXPECT_EQ(judged(comparisons(4, 0.9)).value, MapVerdict::kDoubtful);
  EXPECT_EQ(judged(comparisons(6, 0.9)).value, MapVerdict::kBroken);
  EXPECT_EQ(judged(comparisons(8, 0.55)).value, MapVerdict::kDoubtful);
  auto mixed = comparisons(6, 0.9);
  for (std::size_t i = 0; i < 3; ++i) mixed[i].contradicted_ratio = 0.1;
  EXPECT_EQ(judged(mixed).value, MapVerdict::kDoubtful);
}

TEST(RunVerdict, ManyMissingPosesSpeakAgainstAResult) {
  const auto judged = [](std::size_t missing, std::size_t all) {
    RunVerdict verdict;
    judge_missing_poses(missing, all, "scans", verdict);
    return verdict;
  };
  EXPECT_EQ(judged(0, 0).value, MapVerdict::kOk);
  EXPECT_EQ(judged(5, 100).value, MapVerdict::kOk);
  EXPECT_EQ(judged(6, 100).value, MapVerdict::kDoubtful);
  EXPECT_EQ(judged(31, 100).value, MapVerdict::kBroken);
  EXPECT_EQ(judged(31, 100).reasons, std::vector<std::string>{"31 % of the scans have no pose"});
}

}  // namespace
}  // namespace hm
