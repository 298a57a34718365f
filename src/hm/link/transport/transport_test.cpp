#include "hm/link/transport/transport.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <string>
#include <thread>
#include <vector>

#include "hm/link/testing/plugged_terminal.hpp"
#include "hm/link/transport/serial_port.hpp"
#include "hm/link/transport/transport_url.hpp"
#include "hm/link/transport/udp_socket.hpp"

namespace hm {
namespace {

using Bytes = std::vector<std::uint8_t>;
using link_testing::PluggedTerminal;
constexpr Duration kPatience{2'000'000'000};

Bytes read_from(Transport& transport) {
  transport.wait(kPatience);
  std::array<std::uint8_t, 2048> buffer{};
  const std::size_t count = transport.read(buffer);
  return {buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(count)};
}

/// Every byte, those among them that a terminal would treat (newline, start, stop, end of file, interrupt).
Bytes every_byte() {
  Bytes bytes(256);
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::uint8_t>(i);
  return bytes;
}

TEST(SerialPort, PassesEveryByteBothWays) {
  PluggedTerminal device;
  const auto port = SerialPort::open(device.path(), 460800);
  ASSERT_TRUE(port) << to_string(port.error());
  device.send(every_byte());
  EXPECT_EQ(read_from(**port), every_byte());
  EXPECT_TRUE((*port)->write(every_byte()));
  EXPECT_EQ(device.receive(), every_byte());
}

TEST(SerialPort, ReadingDoesNotWait) {
  PluggedTerminal device;
  const auto port = SerialPort::open(device.path(), 9600);
  ASSERT_TRUE(port);
  std::array<std::uint8_t, 8> buffer{};
  EXPECT_EQ((*port)->read(buffer), 0U);
  EXPECT_FALSE((*port)->wait(Duration{1'000'000}));
  EXPECT_TRUE((*port)->is_open());
}

TEST(SerialPort, AFullLineRefusesWholeFramesAndNeverCutsOne) {
  PluggedTerminal device;
  const auto port = SerialPort::open(device.path(), 115200);
  ASSERT_TRUE(port);
  const Bytes frame(100, 0x55);
  std::size_t accepted = 0, received = 0;
  for (int i = 0; i < 100'000 && (*port)->write(frame); ++i) ++accepted;
  EXPECT_GT(accepted, 0U);
  EXPECT_LT(accepted, 100'000U);
  for (int i = 0; i < 1000; ++i) {
    received += device.receive().size();
    if ((*port)->write({})) received += device.receive().size();
  }
  EXPECT_EQ(received, 100 * accepted);
}

TEST(SerialPort, UnpluggedAndPluggedInAgainItRecovers) {
  PluggedTerminal device;
  const auto port = SerialPort::open(device.path(), 921600);
  ASSERT_TRUE(port);
  std::array<std::uint8_t, 8> buffer{};
  for (int round = 1; round <= 2; ++round) {
    device.unplug();
    EXPECT_EQ((*port)->read(buffer), 0U);
    EXPECT_FALSE((*port)->is_open());
    EXPECT_FALSE((*port)->write({buffer.data(), 1}));
    device.plug_in();
    for (int i = 0; i < 100 && !(*port)->is_open(); ++i) {
      (*port)->wait(Duration{20'000'000});
      (*port)->read(buffer);
    }
    EXPECT_EQ((*port)->reconnections(), round);
    device.send(Bytes{1, 2, 3});
    EXPECT_EQ(read_from(**port), (Bytes{1, 2, 3}));
  }
}

TEST(SerialPort, MistakesAreNamed) {
  PluggedTerminal device;
  const auto baud = SerialPort::open(device.path(), 460801);
  ASSERT_FALSE(baud);
  EXPECT_EQ(baud.error().code, ErrorCode::kUsage);
  EXPECT_THAT(baud.error().message, ::testing::HasSubstr("460800, "));
  EXPECT_EQ(SerialPort::open(device.path() + "_2", 9600).error().code, ErrorCode::kNotFound);
  EXPECT_EQ(SerialPort::open("/dev/null", 9600).error().code, ErrorCode::kUnsupported);
}

TEST(UdpSocket, AnswersWhoeverSentToIt) {
  const auto vehicle = UdpSocket::listen("127.0.0.1", 0);
  const auto station = UdpSocket::listen("127.0.0.1", 0);
  ASSERT_TRUE(vehicle && station);
  EXPECT_FALSE((*vehicle)->write(Bytes{1}));  // nobody is known
  ASSERT_TRUE((*station)->add_peer({"127.0.0.1", (*vehicle)->port()}));
  EXPECT_TRUE((*station)->write(Bytes{1, 2}));
  EXPECT_TRUE((*station)->write(Bytes{3}));
  EXPECT_EQ(read_from(**vehicle), (Bytes{1, 2}));  // a datagram at a time
  EXPECT_EQ(read_from(**vehicle), Bytes{3});
  EXPECT_TRUE((*vehicle)->write(Bytes{4}));
  EXPECT_EQ(read_from(**station), Bytes{4});
  EXPECT_EQ((*vehicle)->peers().size(), 1U);
}

TEST(UdpSocket, OfManySendersThoseHeardLastAreRemembered) {
  const auto vehicle = UdpSocket::listen("127.0.0.1", 0);
  ASSERT_TRUE(vehicle);
  ASSERT_TRUE((*vehicle)->add_peer({"127.0.0.1", 9}));
  std::vector<std::unique_ptr<UdpSocket>> senders;
  for (std::size_t i = 0; i < UdpSocket::kMaxPeers + 3; ++i) {
    senders.push_back(std::move(*UdpSocket::listen("127.0.0.1", 0)));
    ASSERT_TRUE(senders.back()->add_peer({"127.0.0.1", (*vehicle)->port()}));
    EXPECT_TRUE(senders.back()->write(Bytes{1}));
    EXPECT_EQ(read_from(**vehicle), Bytes{1});
  }
  EXPECT_EQ((*vehicle)->peers().size(), 1 + UdpSocket::kMaxPeers);
  EXPECT_EQ((*vehicle)->peers().front().port, 9);
  EXPECT_EQ((*vehicle)->peers().back().port, senders.back()->port());
}

// The station is started later, or was closed: what the kernel reports of it must not stop anything.
TEST(UdpSocket, APeerThatDoesNotListenIsNoError) {
  const auto vehicle = UdpSocket::listen("127.0.0.1", 0);
  auto station = UdpSocket::listen("127.0.0.1", 0);
  ASSERT_TRUE(vehicle && station);
  const std::uint16_t port = (*station)->port();
  ASSERT_TRUE((*vehicle)->add_peer({"127.0.0.1", port}));
  station->reset();
  std::array<std::uint8_t, 8> buffer{};
  for (int i = 0; i < 3; ++i) {
    (*vehicle)->write(Bytes{1});
    EXPECT_EQ((*vehicle)->read(buffer), 0U);
  }
  station = UdpSocket::listen("127.0.0.1", port);
  ASSERT_TRUE(station);
  EXPECT_TRUE((*vehicle)->write(Bytes{2}));
  EXPECT_EQ(read_from(**station), Bytes{2});
}

TEST(UdpSocket, MistakesAreNamed) {
  EXPECT_EQ(UdpSocket::listen("house", 0).error().code, ErrorCode::kUsage);
  const auto first = UdpSocket::listen("127.0.0.1", 0);
  EXPECT_EQ(UdpSocket::listen("127.0.0.1", (*first)->port()).error().code, ErrorCode::kUnreadable);
  EXPECT_EQ((*first)->add_peer({"1.2.3", 5}).error().code, ErrorCode::kUsage);
}

TEST(OpenTransport, OpensWhatATextNames) {
  auto there = UdpSocket::listen("127.0.0.1", 0);
  ASSERT_TRUE(there);
  const auto here = open_transport("udp:127.0.0.1:" + std::to_string((*there)->port()));
  ASSERT_TRUE(here) << here.error().message;
  ASSERT_TRUE((*here)->write(Bytes{1, 2, 3}));
  EXPECT_EQ(read_from(**there), (Bytes{1, 2, 3}));
  ASSERT_TRUE((*there)->write(Bytes{4}));
  EXPECT_EQ(read_from(**here), Bytes{4});
  PluggedTerminal terminal;
  EXPECT_TRUE(open_transport("serial:" + terminal.path() + ":115200"));
}

TEST(OpenTransport, MistakesAreNamed) {
  for (const char* text : {"", "udp", "udp:14550", "tcp:127.0.0.1:1", "udp:127.0.0.1:", "udp:127.0.0.1:x"}) {
    const auto opened = open_transport(text);
    ASSERT_FALSE(opened) << text;
    EXPECT_EQ(opened.error().code, ErrorCode::kUsage) << text;
    EXPECT_THAT(opened.error().message, testing::HasSubstr("udp:ADDRESS:PORT")) << text;
  }
  EXPECT_THAT(open_transport("udp:127.0.0.1:70000").error().message, testing::HasSubstr("70000"));
  EXPECT_THAT(open_transport("udp:nowhere:14550").error().message, testing::HasSubstr("IPv4"));
  EXPECT_EQ(open_transport("serial:/dev/hm_not_there:115200").error().code, ErrorCode::kNotFound);
}

}  // namespace
}  // namespace hm
