#pragma once
#include <cstdint>
#include <string>
#include <string_view>

#include "hm/core/result.hpp"
#include "hm/io/map/map_directory.hpp"
#include "hm/io/map/map_file.hpp"

namespace hm {

/// The header as it is stored: what the user sees, and what the directory must add up to.
struct MapRecord {
  MapHeader header;
  MapDirectorySummary summary;
};

/// The record as JSON text, and back. `where` names the file in errors.
std::string to_text(const MapRecord& record);
Result<MapRecord> parse_record(std::string_view text, const std::string& where);

/// FNV-1a, 64 bits: notices any damage to the record's text.
std::int64_t record_checksum(std::string_view text);

}  // namespace hm
