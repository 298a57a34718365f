#include "hm/io/map/map_record.hpp"

#include <fmt/format.h>

#include <bit>
#include <charconv>
#include <cmath>
#include <limits>

#include "hm/core/hash.hpp"
#include "hm/io/bytes/json.hpp"

namespace hm {
namespace {

std::int64_t integer_at(const JsonValue& json, std::string_view key) {
  const JsonValue* value = json.find(key);
  const std::int64_t* integer = value ? value->as_integer() : nullptr;
  return integer ? *integer : -1;
}

double number_at(const JsonValue& json, std::string_view key) {
  const JsonValue* value = json.find(key);
  return value ? value->number_or(0) : 0;
}

/// Voxels and their units of distance are micrometres to kilometres, in any map.
bool is_map_length(double length_m) { return length_m >= 1e-9 && length_m <= 1e4; }

std::string text_at(const JsonValue& json, std::string_view key) {
  const JsonValue* value = json.find(key);
  const std::string* text = value ? value->as_string() : nullptr;
  return text ? *text : std::string();
}

}  // namespace

std::string to_text(const MapRecord& record) {
  const MapHeader& header = record.header;
  JsonValue json;
  json["format"] = "housemartin map";
  json["version"] = header.format_version;
  json["voxel_size_m"] = header.voxel_size_m;
  json["sdf_unit_m"] = header.sdf_unit_m;
  json["program_version"] = header.program_version;
  json["created_unix_ms"] = header.created_unix_ms;
  json["updated_unix_ms"] = header.updated_unix_ms;
  json["pages"] = record.summary.pages;
  json["blocks"] = record.summary.blocks;
  json["last_row"] = record.summary.last_row;
  json["directory_digest"] = fmt::format("{:016x}", record.summary.digest);
  json["parameters_toml"] = header.parameters_toml;
  json["state_json"] = header.state_json;
  return to_json_text(json, JsonStyle::kPretty);
}

Result<MapRecord> parse_record(std::string_view text, const std::string& where) {
  const auto json = parse_json(text, where + " (header)");
  if (!json) return forward_error(json);
  MapRecord record;
  MapHeader& header = record.header;
  header.format_version = static_cast<int>(integer_at(*json, "version"));
  header.voxel_size_m = number_at(*json, "voxel_size_m");
  header.sdf_unit_m = number_at(*json, "sdf_unit_m");
  header.program_version = text_at(*json, "program_version");
  header.created_unix_ms = integer_at(*json, "created_unix_ms");
  header.updated_unix_ms = integer_at(*json, "updated_unix_ms");
  header.parameters_toml = text_at(*json, "parameters_toml");
  header.state_json = text_at(*json, "state_json");
  record.summary.pages = static_cast<std::uint64_t>(integer_at(*json, "pages"));
  record.summary.blocks = static_cast<std::uint64_t>(integer_at(*json, "blocks"));
  record.summary.last_row = integer_at(*json, "last_row");
  const std::string digest = text_at(*json, "directory_digest");
  const auto [end, error] =
      std::from_chars(digest.data(), digest.data() + digest.size(), record.summary.digest, 16);
  const bool has_digest = error == std::errc{} && end == digest.data() + digest.size() && !digest.empty();
  if (text_at(*json, "format") != "housemartin map" || !has_digest || record.summary.last_row < 0)
    return fail(ErrorCode::kCorrupted, where, "the header lacks what a map's header must hold");
  if (!is_map_length(header.voxel_size_m) || !is_map_length(header.sdf_unit_m))
    return fail(ErrorCode::kCorrupted, where,
                "the header's voxel size of {} m and distance unit of {} m cannot be right",
                header.voxel_size_m, header.sdf_unit_m);
  return record;
}

std::int64_t record_checksum(std::string_view text) { return std::bit_cast<std::int64_t>(fnv1a(text)); }

}  // namespace hm
