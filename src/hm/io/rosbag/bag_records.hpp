#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "hm/core/result.hpp"
#include "hm/core/time.hpp"

namespace hm::detail {

/// Who sends what: a topic, its message type, and the digest of the type's definition.
struct BagConnection {
  std::uint32_t id = 0;
  std::string topic, type, md5sum;
};

/// A message as it lies in a bag; valid during the call that hands it over.
struct BagMessage {
  const BagConnection& connection;
  Time received;  ///< when the recorder got it
  std::span<const std::uint8_t> data;
};

/// How the reading of a bag went.
struct BagSummary {
  bool indexed = false;      ///< the recorder closed the file properly
  std::size_t messages = 0;  ///< of all topics
  std::size_t chunks = 0;
  std::size_t lost_messages = 0;      ///< of a connection that the file does not describe
  std::vector<std::string> problems;  ///< damage, in words, with its place
};

/// Reads a bag (version 2.0) from front to back and hands over every message in the order of the file. The
/// index at its end is not needed, so bags that were never closed or are cut off are read as far as they go:
/// into the last chunk, to the last whole message. Errors: not there, not readable, not a bag, another
/// version, encrypted.
Result<BagSummary> read_bag(const std::filesystem::path& path,
                            const std::function<void(const BagMessage&)>& use);

}  // namespace hm::detail
