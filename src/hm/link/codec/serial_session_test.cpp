#include "hm/link/codec/serial_session.hpp"

#include <gtest/gtest.h>

#include <initializer_list>
#include <set>

namespace hm {
namespace {

constexpr std::int64_t kSecondUs = 1'000'000;

SerialFrame config_frame() { return make_serial_frame(SerialControlConfig{}, SerialDirection::kUp); }
SerialFrame ack_frame(std::uint8_t flag) {
  return make_serial_frame(SerialAck{flag}, SerialDirection::kDown);
}

TEST(SerialAckSender, WaitsForItsOwnAck) {
  SerialAckSender sender;
  ASSERT_TRUE(sender.send(config_frame()));
  EXPECT_FALSE(sender.send(config_frame()));
  const auto sent = sender.poll(0);
  ASSERT_TRUE(sent);
  EXPECT_EQ(sent->flag & kSerialAckFlag, 1);
  EXPECT_FALSE(sender.receive(ack_frame(static_cast<std::uint8_t>(sent->flag + 2))));
  EXPECT_EQ(sender.state(), SerialAckSender::State::kWaiting);
  EXPECT_TRUE(sender.receive(*acknowledge(*sent)));
  EXPECT_EQ(sender.state(), SerialAckSender::State::kAcknowledged);
}

TEST(SerialAckSender, GivesUpAfterASecondAndDoesNotRepeatUnlessTold) {
  SerialAckSender sender;
  sender.send(config_frame());
  EXPECT_TRUE(sender.poll(0));
  EXPECT_FALSE(sender.poll(kSecondUs - 1));
  EXPECT_EQ(sender.state(), SerialAckSender::State::kWaiting);
  EXPECT_FALSE(sender.poll(kSecondUs));
  EXPECT_EQ(sender.state(), SerialAckSender::State::kTimedOut);
  SerialAckSender patient(3);
  patient.send(config_frame());
  int frames = 0;
  for (std::int64_t t = 0; t < 10 * kSecondUs; t += 100'000) frames += patient.poll(t).has_value();
  EXPECT_EQ(frames, 3);
  EXPECT_EQ(patient.state(), SerialAckSender::State::kTimedOut);
}

// The author's ids were random odd bytes: one in 128 ACKs that came late was taken for the next packet's.
TEST(SerialAckSender, ALateAckIsNotTakenForThatOfTheNextPackets) {
  SerialAckSender sender;
  std::set<std::uint8_t> flags;
  sender.send(config_frame());
  const auto first = sender.poll(0);
  std::int64_t now = kSecondUs;
  for (int i = 1; i < 128; ++i) {
    sender.poll(now);  // times out
    ASSERT_TRUE(sender.send(config_frame()));
    const auto sent = sender.poll(now);
    ASSERT_TRUE(sent);
    EXPECT_TRUE(flags.insert(sent->flag).second);
    EXPECT_FALSE(sender.receive(*acknowledge(*first)));
    now += kSecondUs;
  }
}

TEST(SerialAckSender, OnlyFramesWithTheFlagAreAcknowledged) {
  SerialFrame frame = config_frame();
  EXPECT_FALSE(acknowledge(frame));
  frame.flag = 7;
  EXPECT_EQ(read_serial_packet<SerialAck>(*acknowledge(frame))->flag, 7);
  EXPECT_FALSE(acknowledge(ack_frame(1)));
}

TEST(SerialHandshake, StartsWithTheAutoBaudByteAndTriesFiveTimes) {
  SerialHandshake handshake;
  int dummies = 0;
  for (std::int64_t t = 0; t < 3 * kSecondUs; t += 100'000) {
    const auto output = handshake.poll(t);
    if (output.count == 0) continue;
    EXPECT_EQ(output.bytes[0], dummies == 0 ? 'a' : 0x3E);
    EXPECT_EQ(t, dummies * SerialHandshake::kPeriodUs);
    ++dummies;
  }
  EXPECT_EQ(dummies, 5);
  EXPECT_EQ(handshake.state(), SerialHandshake::State::kFailed);
}

TEST(SerialHandshake, AnAckConnects) {
  SerialHandshake handshake;
  handshake.receive(ack_frame(1));
  EXPECT_EQ(handshake.state(), SerialHandshake::State::kConnecting);  // of nothing that was sent
  const auto output = handshake.poll(0);
  SerialParser microcontroller(SerialDirection::kUp);
  microcontroller.parse({output.bytes.data(), output.count},
                        [&](const SerialFrame& frame) { handshake.receive(*acknowledge(frame)); });
  EXPECT_EQ(handshake.state(), SerialHandshake::State::kConnected);
  EXPECT_EQ(handshake.poll(10 * kSecondUs).count, 0U);
}

TEST(SerialSchedule, StreamsAreSentAtTheirPeriodsAndPhases) {
  const SerialTransmitConfig config;
  EXPECT_TRUE(is_due(config, SerialStream::kImu, 20));
  EXPECT_TRUE(is_due(config, SerialStream::kPose, 25));
  EXPECT_TRUE(is_due(config, SerialStream::kFlightState, 63));
  EXPECT_TRUE(is_due(config, SerialStream::kStatus, 81));
  EXPECT_TRUE(is_due(config, SerialStream::kRcData, 107));
  EXPECT_TRUE(is_due(config, SerialStream::kDebug, 200));
  int sent = 0;
  for (std::uint32_t loop = 0; loop < 1000; ++loop) sent += is_due(config, SerialStream::kStatus, loop);
  EXPECT_EQ(sent, 20);
}

TEST(SerialSchedule, PeriodZeroIsNeverAndALargePhaseStillSends) {
  SerialTransmitConfig config;
  config.period_ms[0] = 0;
  config.period_ms[3] = 10;
  config.phase_ms[3] = 25;
  int imu = 0, pose = 0;
  for (std::uint32_t loop = 0; loop < 100; ++loop) {
    imu += is_due(config, SerialStream::kImu, loop);
    pose += is_due(config, SerialStream::kPose, loop);
  }
  EXPECT_EQ(imu, 0);
  EXPECT_EQ(pose, 10);
}

// The author joined the bits with ||, which is 1: off and idle claimed pitch only.
TEST(SerialAxes, OffAndIdleClaimAllAxes) {
  constexpr std::array<std::uint8_t, 4> kModes{2, 2, 2, 2}, kPartly{0, 2, 0, 2};
  for (const std::uint8_t state : std::initializer_list<std::uint8_t>{0, 3})
    EXPECT_EQ(claimed_axes(state, kPartly), 15) << int{state};
  for (const std::uint8_t state : std::initializer_list<std::uint8_t>{1, 2})
    EXPECT_EQ(claimed_axes(state, kModes), kSerialYaw | kSerialThrust);
  for (const std::uint8_t state : std::initializer_list<std::uint8_t>{4, 5}) {
    EXPECT_EQ(claimed_axes(state, kModes), 15);
    EXPECT_EQ(claimed_axes(state, kPartly), kSerialPitch | kSerialThrust);
  }
}

// The author's two ends both divided by 1000.
TEST(SerialStatus, TheBatteryIsInVoltsAtBothEnds) {
  SerialStatus status;
  status.battery_v = battery_volts(11'100);
  const auto received = read_serial_packet<SerialStatus>(make_serial_frame(status, SerialDirection::kDown));
  EXPECT_FLOAT_EQ(received->battery_v, 11.1F);
}

}  // namespace
}  // namespace hm
