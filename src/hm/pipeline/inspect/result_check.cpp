#include "hm/pipeline/inspect/result_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "hm/io/bytes/file_bytes.hpp"
#include "hm/io/bytes/json.hpp"

namespace hm {
namespace {

/// A number of report.json that the text shows, when the verb gave it.
struct Headline {
  std::array<std::string_view, 2> keys;
  std::string_view label;
  const char* format;
};

constexpr std::array kHeadlines{
    Headline{{"frames", "integrated"}, "frames in the map", "{:.0f}"},
    Headline{{"frames", "tracked"}, "frames tracked", "{:.0f}"},
    Headline{{"frames", "lost"}, "frames lost", "{:.0f}"},
    Headline{{"scans", "matched"}, "scans matched", "{:.0f}"},
    Headline{{"path_length_m", ""}, "path", "{:.2f} m"},
    Headline{{"loops", "accepted"}, "loops accepted", "{:.0f}"},
    Headline{{"ate_rmse_m", ""}, "error of the path (ATE)", "{:.4f} m"},
    Headline{{"surface_error_mm", "mean"}, "error of the surface, mean", "{:.1f} mm"},
    Headline{{"completeness_ratio", ""}, "share of the surface that is there", "{:.3f}"},
    Headline{{"triangles", ""}, "triangles", "{:.0f}"},
};

std::optional<double> number_at(const JsonValue& report, const Headline& headline) {
  const JsonValue* at = &report;
  for (const std::string_view key : headline.keys)
    if (at && !key.empty()) at = at->find(key);
  if (!at) return std::nullopt;
  const double number = at->number_or(std::numeric_limits<double>::quiet_NaN());
  return std::isfinite(number) ? std::optional(number) : std::nullopt;
}

Result<JsonValue> read_report(const std::filesystem::path& path) {
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored)) return JsonValue();
  const auto bytes = read_file_bytes(path);
  if (!bytes) return forward_error(bytes);
  return parse_json({reinterpret_cast<const char*>(bytes->data()), bytes->size()}, path.string());
}

}  // namespace

Result<ResultReport> inspect_result(const std::filesystem::path& folder) {
  auto record = read_run_record(folder);
  if (!record) return forward_error(record);
  if (!*record) return fail(ErrorCode::kNotFound, folder.string(), "no run.json: not a folder of results");
  ResultReport result;
  result.record = std::move(**record);
  auto report = read_report(folder / "report.json");
  if (!report) return forward_error(report);
  result.report = std::move(*report);
  for (const std::string& name : result.record.files) {
    std::error_code code;
    const auto bytes = std::filesystem::file_size(folder / name, code);
    result.files.push_back({name, code ? 0 : bytes});
    if (code) result.warnings.push_back(fmt::format("{} is gone", name));
  }
  if (result.record.state != RunState::kComplete)
    result.warnings.push_back(fmt::format("the run is not complete ({}): what it saved last is here",
                                          to_string(result.record.state)));
  return result;
}

JsonValue to_json(const ResultReport& report) {
  auto files = JsonValue::array();
  for (const ResultFile& file : report.files)
    files.push_back(JsonValue::object({{"name", file.name}, {"bytes", file.bytes}}));
  return JsonValue::object({{"result_of", report.record.verb},
                            {"recording", report.record.recording},
                            {"state", std::string(to_string(report.record.state))},
                            {"program_version", report.record.program_version},
                            {"files", std::move(files)},
                            {"report", report.report}});
}

std::string to_text(const ResultReport& report) {
  const RunRecord& record = report.record;
  std::string text = fmt::format("result       of `hm {}`{}{}, {} (housemartin {})\n", record.verb,
                                 record.recording.empty() ? "" : " on ", record.recording,
                                 to_string(record.state), record.program_version);
  for (const Headline& headline : kHeadlines)
    if (const auto number = number_at(report.report, headline))
      text += fmt::format("{:<12} {}\n", headline.label, fmt::format(fmt::runtime(headline.format), *number));
  for (const ResultFile& file : report.files)
    if (file.name.find('/') == std::string::npos)
      text += fmt::format("file         {}, {:.1f} MB\n", file.name, static_cast<double>(file.bytes) * 1e-6);
  return text;
}

}  // namespace hm
