#include "output.hpp"

#include <cstdio>

#include "hm/io/bytes/json.hpp"
#include "hm/core/process_memory.hpp"
#include "version.hpp"

namespace {

enum ExitCode { kDone = 0, kRunFailed = 1, kUsageError = 2, kInputError = 3 };

int exit_code_of(hm::ErrorCode code) {
  switch (code) {
    case hm::ErrorCode::kUsage:
      return kUsageError;
    case hm::ErrorCode::kNotFound:
    case hm::ErrorCode::kUnreadable:
    case hm::ErrorCode::kTruncated:
    case hm::ErrorCode::kCorrupted:
    case hm::ErrorCode::kUnsupported:
    case hm::ErrorCode::kInvalidValue:
      return kInputError;
    case hm::ErrorCode::kOutOfMemory:
    case hm::ErrorCode::kCancelled:
    case hm::ErrorCode::kInternal:
      return kRunFailed;
  }
  return kRunFailed;
}

hm::JsonValue json_head(const std::string& verb, bool ok) {
  // "evaluate mesh" is the verb evaluate, applied to a mesh.
  const std::size_t space = verb.find(' ');
  auto head = hm::JsonValue::object({{"verb", verb.substr(0, space)}});
  if (space != std::string::npos) head["what"] = verb.substr(space + 1);
  head["ok"] = ok;
  head["version"] = kVersion;
  return head;
}

hm::JsonValue json_error(const hm::Error& error) {
  auto json = hm::JsonValue::object({{"code", hm::to_string(error.code)}, {"message", error.message}});
  if (!error.where.empty()) json["where"] = error.where;
  return json;
}

}  // namespace

int print_result(const RunFacts& run, const hm::Result<Outcome>& result) {
  auto document = json_head(run.verb, result.has_value());
  auto warnings = hm::JsonValue::array(), outputs = hm::JsonValue::array();
  if (result) {
    if (const auto* members = result->json.as_object())
      for (const auto& [key, value] : *members) document[key] = value;
    for (const std::string& warning : result->warnings) {
      warnings.push_back(warning);
      fmt::print(stderr, "warning: {}\n", warning);
    }
    for (const auto& path : result->outputs) outputs.push_back(path.string());
    if (!run.json) fmt::print("{}", result->text);
  } else {
    const hm::Error& error = result.error();
    fmt::print(stderr, "hm: {}\n", hm::to_string(error));
    document["error"] = json_error(error);
  }
  document["wall_s"] = run.wall_s;
  document["peak_rss_bytes"] = hm::peak_resident_bytes();
  document["warnings"] = std::move(warnings);
  document["outputs"] = std::move(outputs);
  if (run.json) fmt::print("{}\n", hm::to_json_text(document));
  if (std::fflush(stdout) != 0 || std::ferror(stdout)) return kRunFailed;
  return result ? kDone : exit_code_of(result.error().code);
}
