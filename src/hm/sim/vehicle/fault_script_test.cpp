#include "hm/sim/vehicle/fault_script.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace hm {
namespace {

bool mentions(const Error& error, std::string_view text) {
  return to_string(error).find(text) != std::string::npos;
}

TEST(FaultScript, ReadsEveryFault) {
  for (std::size_t i = 0; i < std::size(kFaultNames); ++i) {
    const auto fault = parse_fault(fmt::format("  fault {} at 12.5\tfor 0.25 ", kFaultNames[i]), "s:1");
    ASSERT_TRUE(fault) << to_string(fault.error());
    EXPECT_EQ(fault->kind, static_cast<FaultKind>(i));
    EXPECT_EQ(fault->at.ns, 12'500'000'000);
    EXPECT_EQ(fault->duration.ns, 250'000'000);
  }
  EXPECT_EQ(kFaultNames[static_cast<std::size_t>(FaultKind::kGust)], "gust");
  EXPECT_EQ(std::size(kFaultNames), static_cast<std::size_t>(FaultKind::kGust) + 1);
}

TEST(FaultScript, ErrorsNameLineAndNearestWord) {
  const auto error_of = [](std::string_view line) { return parse_fault(line, "flight.txt:7").error(); };
  EXPECT_TRUE(mentions(error_of("fault lazer_off at 1 for 2"), "flight.txt:7"));
  EXPECT_TRUE(mentions(error_of("fault lazer_off at 1 for 2"), "did you mean 'laser_off'?"));
  EXPECT_TRUE(mentions(error_of("fault motor at 1 for 2"), "did you mean 'motor_lost'?"));
  EXPECT_TRUE(mentions(error_of("fault xyzzyq at 1 for 2"), "valid ones are laser_off camera_black"));
  EXPECT_TRUE(mentions(error_of("fualt gust at 1 for 2"), "'fualt' instead of 'fault'"));
  EXPECT_TRUE(mentions(error_of("fault gust ta 1 for 2"), "'ta' instead of 'at'"));
  EXPECT_TRUE(mentions(error_of("fault gust at 1 during 2"), "'during' instead of 'for'"));
  EXPECT_TRUE(mentions(error_of("fault gust at 1"), "4 words instead of 6"));
  EXPECT_TRUE(mentions(error_of("fault gust at 1 for 2 s"), "7 words instead of 6"));
  EXPECT_TRUE(mentions(error_of(""), "0 words"));
}

TEST(FaultScript, RefusesBadNumbers) {
  for (const std::string_view bad : {"x", "1x", "nan", "inf", "-1", "1e9", "0x10", "--1"}) {
    EXPECT_FALSE(parse_fault(fmt::format("fault gust at {} for 2", bad), "s:1")) << bad;
    EXPECT_FALSE(parse_fault(fmt::format("fault gust at 2 for {}", bad), "s:1")) << bad;
  }
  EXPECT_TRUE(parse_fault("fault gust at 0 for 1", "s:1"));
  EXPECT_FALSE(parse_fault("fault gust at 0 for 0", "s:1"));
}

TEST(FaultScript, EveryPrefixIsReadOrRefused) {
  const std::string whole = "fault gust at 1.5 for 2.5";
  for (std::size_t n = 0; n < whole.size(); ++n) {
    const auto fault = parse_fault(whole.substr(0, n), "s:1");
    const bool is_complete = n >= whole.find("2.5") + 1;
    EXPECT_EQ(fault.has_value(), is_complete) << whole.substr(0, n);
  }
}

TEST(FaultSchedule, SaysWhatIsActiveWhen) {
  const auto schedule = FaultSchedule::parse(
      "# comment\n\nfault gust at 2 for 1 # strong\r\nfault imu_gap at 2.5 for 0.1\nfault gust at 9 for 1",
      "s");
  ASSERT_TRUE(schedule) << to_string(schedule.error());
  ASSERT_EQ(schedule->all().size(), 3U);
  const auto active = [&](FaultKind kind, double t) {
    return schedule->is_active(kind, Duration::from_seconds(t));
  };
  EXPECT_FALSE(active(FaultKind::kGust, 1.999));
  EXPECT_TRUE(active(FaultKind::kGust, 2));
  EXPECT_TRUE(active(FaultKind::kGust, 2.999));
  EXPECT_FALSE(active(FaultKind::kGust, 3));
  EXPECT_TRUE(active(FaultKind::kGust, 9.5));
  EXPECT_TRUE(active(FaultKind::kImuGap, 2.55));
  EXPECT_FALSE(active(FaultKind::kLaserOff, 2.55));
}

TEST(FaultSchedule, ReportsAllErrorsWithTheirLines) {
  const auto schedule = FaultSchedule::parse("fault gust at 1 for 1\nfault gusty at 1 for 1\n\nx\n", "s.txt");
  ASSERT_FALSE(schedule);
  EXPECT_TRUE(mentions(schedule.error(), "s.txt:2"));
  EXPECT_TRUE(mentions(schedule.error(), "did you mean 'gust'?"));
  EXPECT_TRUE(mentions(schedule.error(), "s.txt:4"));
  EXPECT_FALSE(mentions(schedule.error(), "s.txt:1"));
}

}  // namespace
}  // namespace hm
