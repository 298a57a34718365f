#include "hm/pipeline/experiments/experiment.hpp"

#include <gtest/gtest.h>

#include <map>

#include "hm/io/testing/temporary_folder_test_support.hpp"

namespace hm {
namespace {

/// Measured values of a tiny experiment by their quantity.
class TinyExperiment : public testing::Test {
 protected:
  std::map<std::string, double> run(const char* name) {
    const Experiment* experiment = find_experiment(name);
    EXPECT_NE(experiment, nullptr);
    ExperimentOptions options;
    options.output = folder_.path();
    options.tiny = true;
    const auto summary = run_experiments(std::span(experiment, 1), options);
    EXPECT_TRUE(summary.has_value()) << to_string(summary.error());
    std::map<std::string, double> values;
    for (const ExperimentRow& row : summary->outcomes.front().rows) values[row.quantity] = row.measured;
    EXPECT_TRUE(std::filesystem::exists(folder_.path() / "report.html"));
    return values;
  }
  TemporaryFolder folder_;
};

TEST_F(TinyExperiment, HeightIsRightOverAnObjectAndItsLevelIsFound) {
  const auto values = run("height");
  EXPECT_LT(values.at("error of the height, RMS"), 5);
  EXPECT_NEAR(values.at("level measured over the object of 10 cm"), 10, 2);
}

TEST_F(TinyExperiment, HoversUnderBothControlLaws) {
  const auto values = run("hover");
  for (const char* law : {"published control", "default control"})
    for (const char* quantity : {": |x| at most, by the truth", ": |z| at most, by the estimate"}) {
      const double value_cm = values.at(std::string(law) + quantity);
      EXPECT_GT(value_cm, 0) << law << quantity;
      EXPECT_LT(value_cm, 40) << law << quantity;
    }
}

TEST_F(TinyExperiment, ReachesWayPointsUnderBothControlLaws) {
  const auto values = run("waypoints");
  EXPECT_EQ(values.at("default control: way points reached, of 1"), 1);
  EXPECT_LT(values.at("default control: true distance from them, at most"), 15);
  EXPECT_LT(values.at("default control: true heading off when they are reached, at most"), 15);
  EXPECT_EQ(values.count("published control: way points reached, of 1"), 1U);
}

TEST(Experiments, StoppedIsCancelled) {
  const TemporaryFolder folder;
  ExperimentOptions options;
  options.output = folder.path();
  options.tiny = true;
  std::stop_source stop;
  stop.request_stop();
  options.run.stop = stop.get_token();
  const auto summary = run_experiments(std::span(find_experiment("height"), 1), options);
  ASSERT_FALSE(summary.has_value());
  EXPECT_EQ(summary.error().code, ErrorCode::kCancelled);
}

ExperimentFindings one_row() {
  ExperimentFindings findings;
  findings.rows = {{"answer", 42.0, 41.5, "cm"}};
  findings.add_figures = [](HtmlReport&) {};
  return findings;
}

constexpr Experiment kWorks{"works", "Fig. 0.1", "nothing",
                            [](const ExperimentOptions&) -> Result<ExperimentFindings> { return one_row(); }};
constexpr Experiment kFails{"fails", "Fig. 0.2", "nothing",
                            [](const ExperimentOptions&) -> Result<ExperimentFindings> {
                              return fail(ErrorCode::kInvalidValue, "a.png", "is damaged");
                            }};

TEST(Experiments, OthersGoOnAfterOneFailed) {
  const TemporaryFolder folder;
  ExperimentOptions options;
  options.output = folder.path();
  const Experiment chosen[] = {kFails, kWorks};
  const auto summary = run_experiments(chosen, options);
  ASSERT_TRUE(summary.has_value()) << to_string(summary.error());
  ASSERT_EQ(summary->outcomes.size(), 1U);
  EXPECT_EQ(summary->outcomes.front().experiment->name, "works");
  EXPECT_TRUE(std::filesystem::exists(folder.path() / "works" / "report.html"));
  ASSERT_EQ(summary->failed.size(), 1U);
  EXPECT_EQ(summary->failed.front().experiment->name, "fails");
  ASSERT_TRUE(experiment_failure(*summary).has_value());
  EXPECT_NE(experiment_failure(*summary)->message.find("fails"), std::string::npos);
  ASSERT_EQ(summary->warnings.size(), 1U);
  EXPECT_NE(summary->warnings.front().find("a.png: is damaged"), std::string::npos);
}

TEST(Experiments, ASingleOneThatFailsIsAnError) {
  const TemporaryFolder folder;
  ExperimentOptions options;
  options.output = folder.path();
  const auto failed = run_experiments(std::span(&kFails, 1), options);
  ASSERT_FALSE(failed.has_value());
  EXPECT_EQ(failed.error().code, ErrorCode::kInvalidValue);
  const auto worked = run_experiments(std::span(&kWorks, 1), options);
  ASSERT_TRUE(worked.has_value());
  EXPECT_FALSE(experiment_failure(*worked).has_value());
}

}  // namespace
}  // namespace hm
