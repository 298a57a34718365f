#include "hm/link/status_text.hpp"

#include <gtest/gtest.h>

#include <string>

#include "hm/link/testing/pipe_transport.hpp"

namespace hm {
namespace {

constexpr MavlinkAddress kSpeakingVehicle{1, 1};

MavStatusText part_of(std::uint16_t id, std::uint8_t number, const std::string& text) {
  MavStatusText part;
  part.severity = kMavError;
  part.id = id;
  part.chunk_seq = number;
  std::ranges::copy(text, part.text.begin());
  return part;
}

std::vector<std::string> words(const std::vector<LinkText>& texts) {
  std::vector<std::string> result;
  for (const LinkText& text : texts) result.push_back(text.text);
  return result;
}

TEST(StatusTextReader, GivesWhatAPeerSendsOfAnyLength) {
  link_testing::PipePair way;
  MavlinkPeerOptions options;
  options.address = kSpeakingVehicle;
  MavlinkPeer vehicle(way.vehicle, options), station(way.station, link_testing::station_options());
  for (const std::size_t length : {0U, 1U, 49U, 50U, 51U, 99U, 100U, 101U, 1000U}) {
    std::string said(length, 'x');
    if (length > 0) said.back() = 'y';
    vehicle.send_text(kMavWarning, said);
    StatusTextReader reader;
    std::vector<LinkText> heard;
    station.step([] { return Time{1}; },
                 [&](const MavlinkFrame& frame) {
                   if (const auto message = read_mavlink_message<MavStatusText>(frame))
                     for (LinkText& text : reader.add(*message, frame.from)) heard.push_back(std::move(text));
                 });
    ASSERT_EQ(heard.size(), 1U) << length;
    EXPECT_EQ(heard[0].text, said);
    EXPECT_EQ(heard[0].severity, kMavWarning);
  }
}

TEST(StatusTextReader, WhatIsMissingIsShown) {
  const std::string full(50, 'a');
  StatusTextReader reader;
  EXPECT_TRUE(reader.add(part_of(3, 0, full), kSpeakingVehicle).empty());
  EXPECT_TRUE(reader.add(part_of(3, 0, full), kSpeakingVehicle).empty()) << "the same part again";
  EXPECT_EQ(words(reader.add(part_of(3, 2, "end"), kSpeakingVehicle)),
            (std::vector<std::string>{full + "...end"}));
  EXPECT_TRUE(reader.add(part_of(4, 0, full), kSpeakingVehicle).empty());
  EXPECT_EQ(words(reader.add(part_of(5, 1, "end"), kSpeakingVehicle)),
            (std::vector<std::string>{full + "...", "...end"}));
  EXPECT_TRUE(reader.add(part_of(6, 0, full), kSpeakingVehicle).empty());
  EXPECT_EQ(words(reader.add(part_of(6, 0, "of another"), {7, 1})),
            (std::vector<std::string>{full + "...", "of another"}));
  EXPECT_TRUE(reader.add(part_of(6, 0, full), kSpeakingVehicle).empty());
  EXPECT_EQ(words(reader.add(part_of(0, 0, "short"), kSpeakingVehicle)),
            (std::vector<std::string>{full + "...", "short"}));
}

TEST(StatusTextReader, OtherLettersAreReplaced) {
  StatusTextReader reader;
  EXPECT_EQ(words(reader.add(part_of(0, 0,
                                     "a\n\x1b[1m\xff"
                                     "b"),
                             kSpeakingVehicle)),
            (std::vector<std::string>{"a??[1m?b"}));
}

}  // namespace
}  // namespace hm
