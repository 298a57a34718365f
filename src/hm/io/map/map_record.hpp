#pragma once
#include <cstdint>
#include <string>
#include <string_view>

#include "hm/core/result.hpp"
#include "hm/io/map/map_directory.hpp"
#include "hm/io/map/map_file.hpp"

namespace hm {

/// Stored header: the public metadata, and the totals for checking the directory.
struct MapRecord {
  MapHeader header;
  MapDirectorySummary summary;
};

/// Converts the record to JSON text and back. `where` names the file in errors.
std::string to_text(const MapRecord& record);
Result<MapRecord> parse_record(std::string_view text, const std::string& where);

/// FNV-1a hash (64 bits) of the record's text, to detect damage.
std::int64_t record_checksum(std::string_view text);

}  // namespace hm
