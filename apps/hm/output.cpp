#include "output.hpp"

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <new>
#include <system_error>

#include "hm/core/process_memory.hpp"
#include "hm/io/bytes/json.hpp"
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
    case hm::ErrorCode::kNoResult:
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

/// The line that says how to look at the report; empty without one. Of several pages it is the one that lies
/// highest, as that of a comparison lies above those of what it compares.
std::string open_line(const std::vector<std::filesystem::path>& outputs) {
  const std::filesystem::path* page = nullptr;
  const auto depth = [](const std::filesystem::path& path) {
    return std::distance(path.begin(), path.end());
  };
  for (const auto& path : outputs)
    if (path.extension() == ".html" && (!page || depth(path) < depth(*page))) page = &path;
  return page ? "open " + page->string() + "\n" : std::string();
}

/// The text for standard output.
std::string text_of(const RunFacts& run, const hm::Result<Outcome>& result, const hm::JsonValue& document) {
  if (run.json) return hm::to_json_text(document) + "\n";
  return result && !run.quiet ? result->text + open_line(result->outputs) : "";
}

}  // namespace

int print_result(const RunFacts& run, const hm::Result<Outcome>& result) {
  const hm::Error* error = result ? nullptr : &result.error();
  if (result && result->failure) error = &*result->failure;
  auto document = json_head(run.verb, error == nullptr);
  auto warnings = hm::JsonValue::array(), outputs = hm::JsonValue::array();
  if (result) {
    if (const auto* members = result->json.as_object())
      for (const auto& [key, value] : *members) document[key] = value;
    for (const std::string& warning : result->warnings) {
      warnings.push_back(warning);
      if (!run.quiet && (run.json || !result->warnings_in_text))
        write_message(fmt::format("warning: {}\n", warning));
    }
    for (const auto& path : result->outputs) outputs.push_back(path.string());
  }
  if (error) {
    write_message(fmt::format("hm: {}\n", hm::to_string(*error)));
    document["error"] = json_error(*error);
  }
  document["wall_s"] = run.wall_s;
  document["peak_rss_bytes"] = hm::peak_resident_bytes();
  document["warnings"] = std::move(warnings);
  document["outputs"] = std::move(outputs);
  if (!write_output(text_of(run, result, document))) return kRunFailed;
  return error ? exit_code_of(error->code) : kDone;
}

bool write_output(std::string_view text) {
  errno = 0;
  if (std::fwrite(text.data(), 1, text.size(), stdout) == text.size() && std::fflush(stdout) == 0)
    return true;
  write_message(fmt::format("hm: standard output: cannot be written: {}\n", std::strerror(errno)));
  return false;
}

void write_message(const std::string& text) { std::fputs(text.c_str(), stderr); }

hm::Error error_of(const std::exception_ptr& exception) {
  try {
    if (exception) std::rethrow_exception(exception);
  } catch (const std::bad_alloc&) {
    return {hm::ErrorCode::kOutOfMemory,
            "out of memory; fewer threads (--threads) need less, and so does a map with larger voxels "
            "(--voxel) or "
            "a memory cap (tsdf.max_map_mb)",
            {}};
  } catch (const std::system_error& error) {
    return {hm::ErrorCode::kInternal,
            fmt::format("the system refused memory, a thread or a file: {}", error.what()),
            {}};
  } catch (const std::exception& error) {
    return {hm::ErrorCode::kInternal, error.what(), {}};
  } catch (...) {
  }
  return {hm::ErrorCode::kInternal,
          "a library ended the program without giving a reason; some do so when memory runs out",
          {}};
}

namespace {

struct Uncaught {
  RunFacts run;
  std::unique_ptr<char[]> reserve;  ///< given back when memory is out, so that the report can be made
};
Uncaught& uncaught() {
  static Uncaught facts;
  return facts;
}

[[noreturn]] void report_and_exit() {
  uncaught().reserve.reset();
  try {
    print_result(uncaught().run, tl::make_unexpected(error_of(std::current_exception())));
  } catch (...) {
    std::fputs("hm: out of memory\n", stderr);
  }
  std::_Exit(kRunFailed);
}

}  // namespace

void report_uncaught(const RunFacts& run) {
  constexpr std::size_t kReserveBytes = std::size_t{4} << 20;
  uncaught() = {run, std::make_unique<char[]>(kReserveBytes)};
  std::set_terminate(report_and_exit);
}
