#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "hm/core/json_value.hpp"
#include "hm/pipeline/common/result_folder.hpp"

namespace hm {

/// A file of a folder of results; `bytes` is 0 where it is missing.
struct ResultFile {
  std::string name;
  std::uint64_t bytes = 0;
};

/// Content of a folder of results, for `hm info`.
struct ResultReport {
  RunRecord record;
  std::vector<ResultFile> files;
  JsonValue report;  ///< the run's report.json; null while there is none
  std::vector<std::string> warnings;
};

/// Reads run.json and report.json of a folder of results. Errors: no run.json, one of them is damaged. A file
/// that is gone is a warning.
Result<ResultReport> inspect_result(const std::filesystem::path& folder);
/// verb, recording, state, files[], report{}.
JsonValue to_json(const ResultReport& report);
std::string to_text(const ResultReport& report);

}  // namespace hm
