#include <gtest/gtest.h>

#include <bit>
#include <charconv>
#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "hm/core/testing/source_folder.hpp"
#include "hm/link/codec/mavlink_parser.hpp"
#include "hm/link/testing/random_messages.hpp"

/// The frames of another implementation (tests/link/mavlink_vectors.txt, written by node_peer.js) are read to
/// the same fields, and those fields give the same bytes.
namespace hm {
namespace {

using link_testing::parse_all;
using link_testing::wire_bytes;
using Bytes = std::vector<std::uint8_t>;

struct Vector {
  std::string name;
  unsigned sequence = 0, system = 0, component = 0;
  bool is_signed = false;
  Bytes bytes;
  std::map<std::string, std::string> fields;
};

Vector vector_of(const std::string& line) {
  Vector result;
  std::istringstream stream(line);
  std::string hex, field;
  stream >> result.name >> result.sequence >> result.system >> result.component >> result.is_signed >> hex;
  for (std::size_t i = 0; i + 1 < hex.size(); i += 2)
    result.bytes.push_back(static_cast<std::uint8_t>(std::stoi(hex.substr(i, 2), nullptr, 16)));
  while (stream >> field) result.fields[field.substr(0, field.find('='))] = field.substr(field.find('=') + 1);
  return result;
}

std::vector<Vector> vectors() {
  std::ifstream file(test::source_folder() / "tests/link/mavlink_vectors.txt");
  std::vector<Vector> result;
  for (std::string line; std::getline(file, line);)
    if (!line.empty() && line[0] != '#') result.push_back(vector_of(line));
  return result;
}

/// Sets the fields of a message from their texts; the offsets of the layout play no part.
struct FieldTexts {
  const std::map<std::string, std::string>& texts;
  std::set<std::string> used{};

  template <class T>
  static void set(const std::string& text, T& value) {
    if constexpr (std::is_same_v<T, float>)
      value = std::bit_cast<float>(static_cast<std::uint32_t>(std::stoul(text, nullptr, 16)));
    else if constexpr (std::is_same_v<T, std::uint64_t>)
      value = std::stoull(text);
    else
      value = static_cast<T>(std::stoll(text));
  }
  template <class Field>
  void field(std::string_view name, Field& value) {
    const std::string key(name);
    ASSERT_TRUE(texts.contains(key)) << key;
    used.insert(key);
    std::istringstream parts(texts.at(key));
    std::string part;
    if constexpr (WireType<Field>::kCount == 0) {
      set(texts.at(key), value);
    } else {
      for (auto& element : value) {
        ASSERT_TRUE(std::getline(parts, part, ',')) << key;
        set(part, element);
      }
    }
  }
  template <class Field>
  void extension(std::string_view name, Field& value) {
    field(name, value);
  }
};

MavlinkKey vector_key() {
  MavlinkKey key{};
  for (std::size_t i = 0; i < key.size(); ++i) key[i] = static_cast<std::uint8_t>(i);
  return key;
}

template <class Message>
void check(const Vector& vector) {
  SCOPED_TRACE(vector.name + " " + std::to_string(vector.sequence));
  Message expected;
  FieldTexts texts{vector.fields};
  Message::visit(expected, texts);
  EXPECT_EQ(texts.used.size(), vector.fields.size());

  MavlinkVerifier verifier(vector_key());
  MavlinkParser parser(vector.is_signed ? &verifier : nullptr);
  const auto frames = parse_all(parser, vector.bytes);
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_EQ(frames[0].sequence, vector.sequence);
  EXPECT_EQ(frames[0].from.system, vector.system);
  EXPECT_EQ(frames[0].from.component, vector.component);
  ASSERT_TRUE(read_mavlink_message<Message>(frames[0]));

  const MavlinkFrame ours = make_mavlink_frame(
      expected, {static_cast<std::uint8_t>(vector.system), static_cast<std::uint8_t>(vector.component)},
      static_cast<std::uint8_t>(vector.sequence));
  EXPECT_EQ(frames[0].payload, ours.payload);
  if (!vector.is_signed) {
    EXPECT_EQ(wire_bytes(ours), vector.bytes);
    return;
  }
  std::uint64_t ticks = 0;
  const std::size_t stamp_at = vector.bytes.size() - kMavlinkSignatureBytes + 1;
  for (std::size_t i = 0; i < 6; ++i)
    ticks |= static_cast<std::uint64_t>(vector.bytes[stamp_at + i]) << (8 * i);
  MavlinkSigner signer(vector_key(), 7);
  signer.set_ticks(ticks);
  EXPECT_EQ(wire_bytes(ours, &signer), vector.bytes);
}

TEST(MavlinkVectors, FramesOfAnotherImplementationAreReadAndWrittenByteForByte) {
  std::size_t checked = 0;
  for (const Vector& vector : vectors())
    MavlinkMessages::for_each([&]<class Message>() {
      if (Message::kName != vector.name) return;
      check<Message>(vector);
      ++checked;
    });
  EXPECT_EQ(checked, 4 * MavlinkMessages::kCount);
}

}  // namespace
}  // namespace hm
