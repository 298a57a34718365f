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

/// Connection of a bag: a topic, its message type, and the MD5 sum of the type's definition.
struct BagConnection {
  std::uint32_t id = 0;
  std::string topic, type, md5sum;
};

/// Serialised message of a bag; valid only during the callback.
struct BagMessage {
  const BagConnection& connection;
  Time received;  ///< time at which the recorder received it
  std::span<const std::uint8_t> data;
};

/// Outcome of reading a bag.
struct BagSummary {
  bool indexed = false;      ///< the recorder closed the file properly
  std::size_t messages = 0;  ///< of all topics
  std::size_t chunks = 0;
  std::size_t lost_messages = 0;      ///< messages of an undescribed connection
  std::vector<std::string> problems;  ///< damage with its location
};

/// Reads a bag (version 2.0) sequentially and calls `use` with every message in file order. The index is not
/// needed, so bags that were never closed or are truncated are read up to the last complete message. Errors:
/// not found, unreadable, not a bag, another version, encrypted.
Result<BagSummary> read_bag(const std::filesystem::path& path,
                            const std::function<void(const BagMessage&)>& use);

}  // namespace hm::detail
