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

/// Voxels and their units of distance are micrometres to kilometres, in any map.
bool is_map_length(double length_m) { return length_m >= 1e-9 && length_m <= 1e4; }

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
  header.format_version = static_cast<int>(json->integer_at("version", -1));
  header.voxel_size_m = json->number_at("voxel_size_m", 0);
  header.sdf_unit_m = json->number_at("sdf_unit_m", 0);
  header.program_version = json->text_at("program_version");
  header.created_unix_ms = json->integer_at("created_unix_ms", -1);
  header.updated_unix_ms = json->integer_at("updated_unix_ms", -1);
  header.parameters_toml = json->text_at("parameters_toml");
  header.state_json = json->text_at("state_json");
  record.summary.pages = static_cast<std::uint64_t>(json->integer_at("pages", -1));
  record.summary.blocks = static_cast<std::uint64_t>(json->integer_at("blocks", -1));
  record.summary.last_row = json->integer_at("last_row", -1);
  const std::string digest = json->text_at("directory_digest");
  const auto [end, error] =
      std::from_chars(digest.data(), digest.data() + digest.size(), record.summary.digest, 16);
  const bool has_digest = error == std::errc{} && end == digest.data() + digest.size() && !digest.empty();
  if (json->text_at("format") != "housemartin map" || !has_digest || record.summary.last_row < 0)
    return fail(ErrorCode::kCorrupted, where, "the header lacks what a map's header must hold");
  if (!is_map_length(header.voxel_size_m) || !is_map_length(header.sdf_unit_m))
    return fail(ErrorCode::kCorrupted, where,
                "the header's voxel size of {} m and distance unit of {} m cannot be right",
                header.voxel_size_m, header.sdf_unit_m);
  return record;
}

std::int64_t record_checksum(std::string_view text) { return std::bit_cast<std::int64_t>(fnv1a(text)); }

}  // namespace hm
