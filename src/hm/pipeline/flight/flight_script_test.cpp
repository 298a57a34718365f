#include "hm/pipeline/flight/flight_script.hpp"

#include <gmock/gmock.h>

#include "hm/core/angle.hpp"
#include "hm/core/rng.hpp"

namespace hm {
namespace {

using Kind = FlightOrder::Kind;
using testing::HasSubstr;

FlightOrder order_of(std::string_view line) {
  const auto parsed = parse_flight_line(line, "s:1");
  EXPECT_TRUE(parsed) << (parsed ? "" : to_string(parsed.error()));
  return parsed ? std::get<FlightOrder>(*parsed) : FlightOrder{};
}

std::string error_of(std::string_view line) {
  const auto parsed = parse_flight_line(line, "s:1");
  EXPECT_FALSE(parsed) << line;
  if (parsed) return {};
  EXPECT_EQ(parsed.error().code, ErrorCode::kUsage);
  EXPECT_EQ(parsed.error().where, "s:1");
  return parsed.error().message;
}

TEST(FlightScript, ReadsEveryKindOfLine) {
  EXPECT_DOUBLE_EQ(order_of("takeoff 1.3").height_m, 1.3);
  EXPECT_DOUBLE_EQ(order_of("takeoff").height_m, 0);
  const FlightOrder go_to = order_of("  goto 1 -2 1.5 90  # to the door");
  EXPECT_EQ(go_to.kind, Kind::kGoTo);
  EXPECT_EQ(go_to.position_m, Vec3(1, -2, 1.5));
  EXPECT_DOUBLE_EQ(go_to.yaw_rad.value(), 90 * kRadiansPerDegree);
  EXPECT_EQ(go_to.text, "goto 1 -2 1.5 90");
  EXPECT_FALSE(order_of("goto 1 -2 1.5").yaw_rad);
  const FlightOrder step = order_of("step 0.5 -1 0.2 -45");
  EXPECT_EQ(step.kind, Kind::kStep);
  EXPECT_EQ(step.position_m, Vec3(0.5, -1, 0.2));
  EXPECT_DOUBLE_EQ(step.yaw_rad.value(), -45 * kRadiansPerDegree);
  EXPECT_EQ(order_of("return").kind, Kind::kReturn);
  const FlightOrder velocity = order_of("velocity 0.5 0 -0.1 30 for 2.5\r");
  EXPECT_EQ(velocity.velocity_m_s, Vec3(0.5, 0, -0.1));
  EXPECT_DOUBLE_EQ(velocity.yaw_rate_rad_s, 30 * kRadiansPerDegree);
  EXPECT_EQ(velocity.duration, Duration::from_seconds(2.5));
  EXPECT_EQ(order_of("wait 3").duration, Duration::from_seconds(3));
  EXPECT_EQ(order_of("hold").kind, Kind::kHold);
  EXPECT_EQ(order_of("land").kind, Kind::kLand);
  EXPECT_EQ(order_of("estop").kind, Kind::kEStop);
  const auto fault = parse_flight_line("fault imu_gap at 4 for 0.5", "s:1");
  ASSERT_TRUE(fault);
  EXPECT_EQ(std::get<ScriptedFault>(*fault).kind, FaultKind::kImuGap);
}

TEST(FlightScript, NamesTheNearestWordAndTheForm) {
  EXPECT_THAT(error_of("takof 1.3"), HasSubstr("did you mean 'takeoff'"));
  EXPECT_THAT(error_of("xyzzy"), HasSubstr("valid ones are fault takeoff goto"));
  EXPECT_THAT(error_of("fault lasr_off at 1 for 2"), HasSubstr("did you mean 'laser_off'"));
  EXPECT_THAT(error_of("fault laser_off at -1 for 2"), HasSubstr("outside of"));
  EXPECT_THAT(error_of("goto 1 2"), HasSubstr("'goto X Y Z [YAW]'"));
  EXPECT_THAT(error_of("goto 1 two 3"), HasSubstr("'two' is not a number (y)"));
  EXPECT_THAT(error_of("goto 1 nan 3"), HasSubstr("'nan' is not a number"));
  EXPECT_THAT(error_of("goto 1 1e9 3"), HasSubstr("outside of -1000 .. 1000"));
  EXPECT_THAT(error_of("takeoff 0.1"), HasSubstr("height in metres of 0.1 is outside of 0.2 .. 100"));
  EXPECT_THAT(error_of("velocity 1 0 0 0 over 2"), HasSubstr("'over' instead of 'for'"));
  EXPECT_THAT(error_of("wait 0"), HasSubstr("outside of"));
  EXPECT_THAT(error_of("land now"), HasSubstr("it is written 'land'"));
  EXPECT_THAT(error_of("  "), HasSubstr("empty"));
}

TEST(FlightScript, ReportsAllErrorsWithTheirLines) {
  const auto script = parse_flight_script("takeoff 1\n\n# way\ngoto 1 2\nlan\nwait x\n", "way.txt");
  ASSERT_FALSE(script);
  EXPECT_EQ(script.error().code, ErrorCode::kUsage);
  EXPECT_EQ(script.error().where, "way.txt:4");
  EXPECT_THAT(script.error().message, HasSubstr("\nway.txt:5: unknown word 'lan'; did you mean 'land'?"));
  EXPECT_THAT(script.error().message, HasSubstr("\nway.txt:6: 'x' is not a number"));
}

TEST(FlightScript, ReportsOrdersThatCannotBeCarriedOut) {
  const auto error = [](std::string_view text) {
    const auto script = parse_flight_script(text, "s");
    EXPECT_FALSE(script) << text;
    return script ? std::string() : to_string(script.error());
  };
  EXPECT_THAT(error("wait 1\ngoto 1 2 3\ntakeoff"), HasSubstr("s:2: 'goto 1 2 3' before a takeoff"));
  EXPECT_THAT(error("takeoff 1\ntakeoff 2"), HasSubstr("s:2: a takeoff in flight"));
  EXPECT_THAT(error("takeoff 1\nland\nhold"), HasSubstr("s:3: 'hold' before a takeoff"));
  EXPECT_THAT(error("step 1 0 0\nland"), HasSubstr("s:1: 'step 1 0 0' before a takeoff"));
  EXPECT_THAT(error("takeoff\nreturn\nhold"), HasSubstr("s:3: 'hold' before a takeoff"));
  EXPECT_THAT(error("fault gust at 1 for 1"), HasSubstr("no order"));
  EXPECT_TRUE(parse_flight_script("takeoff\nland\ntakeoff\nestop\n", "s"));
}

TEST(FlightScript, WayPointsTakeOffVisitAndLand) {
  const auto script = parse_way_points("# x y z yaw\n1 0 1.2\n2 0 1.2 90\n", "w");
  ASSERT_TRUE(script);
  std::vector<Kind> kinds;
  for (const FlightOrder& order : script->orders) kinds.push_back(order.kind);
  EXPECT_THAT(kinds, testing::ElementsAre(Kind::kTakeOff, Kind::kGoTo, Kind::kGoTo, Kind::kLand));
  EXPECT_DOUBLE_EQ(script->orders[0].height_m, 1.2);
  EXPECT_EQ(script->orders[2].position_m, Vec3(2, 0, 1.2));
  EXPECT_DOUBLE_EQ(script->orders[2].yaw_rad.value(), 90 * kRadiansPerDegree);
  const auto wrong = parse_way_points("1 2\n1 2 x\n", "w");
  ASSERT_FALSE(wrong);
  EXPECT_EQ(wrong.error().where, "w:1");
  EXPECT_THAT(wrong.error().message, HasSubstr("\nw:2: 'x' is not a number (z)"));
  EXPECT_FALSE(parse_way_points("# nothing\n", "w"));
}

TEST(FlightScript, ReadyMadeScriptsAreWhatTheirTextsSay) {
  for (const FlightScript& made :
       {hover_script(1.3, Duration::from_seconds(20)), go_to_script({2, 0.5, 1.4})}) {
    std::string text;
    for (const FlightOrder& order : made.orders) text += order.text + "\n";
    const auto read = parse_flight_script(text, "made");
    ASSERT_TRUE(read) << text;
    ASSERT_EQ(read->orders.size(), made.orders.size());
    for (std::size_t i = 0; i < made.orders.size(); ++i) {
      EXPECT_EQ(read->orders[i].kind, made.orders[i].kind);
      EXPECT_EQ(read->orders[i].position_m, made.orders[i].position_m);
      EXPECT_EQ(read->orders[i].duration, made.orders[i].duration);
      EXPECT_EQ(read->orders[i].height_m, made.orders[i].height_m);
    }
  }
}

TEST(FlightScript, AnyBytesGiveAScriptOrAnError) {
  constexpr std::string_view kPieces[] = {"takeoff", "goto", "velocity", "wait",  "land", "fault",
                                          "gust",    "at",   "for",      "1",     "-2.5", "1e400",
                                          "nan",     "#",    "\n",       "\r",    "\t",   " ",
                                          "\0x",     "\xff", "hold",     "estop", "step", "return"};
  Rng rng(3);
  for (int round = 0; round < 2000; ++round) {
    std::string text;
    for (int i = 0; i < 12; ++i) {
      text += kPieces[static_cast<std::size_t>(rng.uniform() * std::size(kPieces))];
      if (rng.uniform() < 0.7) text += ' ';
    }
    const auto script = parse_flight_script(text, "s");
    if (script)
      EXPECT_FALSE(script->orders.empty());
    else
      EXPECT_FALSE(script.error().message.empty());
  }
}

}  // namespace
}  // namespace hm
