#include "hm/pipeline/inspect/result_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "hm/core/text/counted.hpp"
#include "hm/io/bytes/json.hpp"

namespace hm {
namespace {

/// A number of report.json that the text shows, when the verb gave it.
struct Headline {
  std::array<std::string_view, 2> keys;
  std::string_view label;
  const char* format;  ///< of fmt; empty: a count
};

constexpr std::array kHeadlines{
    Headline{{"frames", "integrated"}, "frames in the map", ""},
    Headline{{"frames", "tracked"}, "frames tracked", ""},
    Headline{{"frames", "lost"}, "frames lost", ""},
    Headline{{"scans", "matched"}, "scans matched", ""},
    Headline{{"path_length_m", ""}, "path", "{:.2f} m"},
    Headline{{"loops", "accepted"}, "loops accepted", ""},
    Headline{{"ate_rmse_m", ""}, "path error (ATE)", "{:.4f} m"},
    Headline{{"surface_error_mm", "mean"}, "surface error, mean", "{:.1f} mm"},
    Headline{{"completeness_ratio", ""}, "completeness", "{:.3f}"},
    Headline{{"triangles", ""}, "triangles", ""},
};

std::optional<double> number_at(const JsonValue& report, const Headline& headline) {
  const JsonValue* at = &report;
  for (const std::string_view key : headline.keys)
    if (at && !key.empty()) at = at->find(key);
  if (!at) return std::nullopt;
  const double number = at->number_or(std::numeric_limits<double>::quiet_NaN());
  return std::isfinite(number) ? std::optional(number) : std::nullopt;
}

std::string text_of(const Headline& headline, double number) {
  if (*headline.format == '\0') return with_thousands(std::llround(number));
  return fmt::format(fmt::runtime(headline.format), number);
}

std::string size_text(std::uint64_t bytes) {
  constexpr std::uint64_t kLargest_kB = 1'000'000;
  if (bytes < kLargest_kB) return fmt::format("{:.1f} kB", static_cast<double>(bytes) * 1e-3);
  return fmt::format("{:.1f} MB", static_cast<double>(bytes) * 1e-6);
}

Result<JsonValue> read_report(const std::filesystem::path& path) {
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored)) return JsonValue();
  return read_json_file(path);
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
    if (code) result.warnings.push_back(fmt::format("{} is missing", name));
  }
  if (result.record.state != RunState::kComplete)
    result.warnings.push_back(fmt::format("the run is not complete ({}): this is what it saved last",
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
  std::string text = fmt::format("{:<22} of `hm {}`{}{}, {} (housemartin {})\n", "result", record.verb,
                                 record.recording.empty() ? "" : " on ", record.recording,
                                 to_string(record.state), record.program_version);
  for (const Headline& headline : kHeadlines)
    if (const auto number = number_at(report.report, headline))
      text += fmt::format("{:<22} {}\n", headline.label, text_of(headline, *number));
  for (const ResultFile& file : report.files)
    if (file.name.find('/') == std::string::npos)
      text += fmt::format("{:<22} {}, {}\n", "file", file.name, size_text(file.bytes));
  return text;
}

}  // namespace hm
