#include "hm/pipeline/common/result_folder.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <utility>

#include "hm/core/run_context.hpp"
#include "hm/io/bytes/file_bytes.hpp"
#include "hm/io/bytes/json.hpp"
#include "hm/io/bytes/output_file.hpp"

namespace hm {
namespace {

namespace fs = std::filesystem;

constexpr const char* kRecordName = "run.json";
constexpr const char* kStagingName = ".partial";
constexpr std::array<std::string_view, 3> kStateNames{"running", "stopped", "complete"};
/// Files by which a result without a record is recognised.
constexpr std::array<const char*, 3> kResultNames{"report.json", "map.hmap", "calibration.toml"};

/// A name that stays below the folder: a record must not have other files removed.
bool is_inside(const std::string& name) {
  const fs::path path(name);
  return !name.empty() && path.is_relative() &&
         std::none_of(path.begin(), path.end(), [](const fs::path& part) { return part == ".."; });
}

std::string absolute_name(const fs::path& path) {
  if (path.empty()) return {};
  std::error_code code;
  const fs::path name = fs::weakly_canonical(path, code);
  return (code ? path : name).string();
}

Result<RunRecord> record_from_json(const JsonValue& json, const std::string& where) {
  RunRecord record{json.text_at("verb"), json.text_at("recording"), json.text_at("version"), {}, {}};
  const auto state = std::find(kStateNames.begin(), kStateNames.end(), json.text_at("state"));
  if (record.verb.empty() || state == kStateNames.end())
    return fail(ErrorCode::kCorrupted, where, "names no verb or no state of a run");
  record.state = static_cast<RunState>(state - kStateNames.begin());
  for (const JsonValue& file : json.list_at("files"))
    if (const auto* name = file.as_string(); name && is_inside(*name)) record.files.push_back(*name);
  return record;
}

}  // namespace

std::string_view to_string(RunState state) { return kStateNames[static_cast<std::size_t>(state)]; }

bool RunRecord::is_of(const ResultFolderRequest& request) const {
  return verb == request.verb && recording == absolute_name(request.recording);
}

Result<std::optional<RunRecord>> read_run_record(const fs::path& folder) {
  const fs::path path = folder / kRecordName;
  std::error_code code;
  if (!fs::exists(path, code)) return std::nullopt;
  constexpr std::size_t kMostBytes = std::size_t{1} << 20;
  const auto json = read_json_file(path, kMostBytes);
  if (!json) return forward_error(json);
  auto record = record_from_json(*json, path.string());
  if (!record) return forward_error(record);
  return std::optional(std::move(*record));
}

Result<ResultFolder> ResultFolder::open(const ResultFolderRequest& request) {
  ResultFolder folder(request);
  if (const auto made = folder.make(); !made) return forward_error(made);
  auto lock = FolderLock::acquire(request.folder);
  if (!lock) return forward_error(lock);
  folder.lock_.emplace(std::move(*lock));
  if (const auto checked = folder.check_existing(); !checked) return forward_error(checked);
  // Of a run that was killed. A link in its place is removed, not followed.
  const fs::path staging = folder.path() / kStagingName;
  std::error_code code;
  fs::remove_all(staging, code);
  if (!code) fs::create_directory(staging, code);
  if (code)
    return fail(ErrorCode::kUsage, request.folder.string(), "cannot write into this folder: {}",
                code.message());
  folder.staging_ = staging;
  return folder;
}

ResultFolder::ResultFolder(ResultFolder&& other) noexcept
    : request_(std::move(other.request_)),
      staging_(std::exchange(other.staging_, {})),
      made_(std::exchange(other.made_, {})),
      lock_(std::move(other.lock_)),
      resumed_(std::move(other.resumed_)),
      files_(std::move(other.files_)),
      earlier_files_(std::move(other.earlier_files_)) {}

ResultFolder::~ResultFolder() {
  std::error_code ignored;
  if (!staging_.empty()) fs::remove_all(staging_, ignored);
  for (const fs::path& folder : made_)
    if (::rmdir(folder.c_str()) != 0) break;  // only empty ones
}

Result<void> ResultFolder::make() {
  std::error_code code;
  for (fs::path path = fs::absolute(request_.folder, code).lexically_normal();
       !fs::exists(path, code) && path.has_relative_path(); path = path.parent_path())
    if (path.has_filename()) made_.push_back(path);
  return make_folder(request_.folder);
}

Result<void> ResultFolder::check_existing() {
  const auto read = read_run_record(path());
  if (!read && request_.existing != ExistingResult::kOverwrite) return forward_error(read);
  const std::optional<RunRecord> record = read ? *read : std::nullopt;
  std::error_code code;
  const auto unnamed = std::find_if(kResultNames.begin(), kResultNames.end(),
                                    [&](const char* name) { return fs::exists(path() / name, code); });
  if (!record && unnamed == kResultNames.end()) return {};
  const std::string what = record ? fmt::format("the result of `hm {}`{}{}", record->verb,
                                                record->recording.empty() ? "" : " on ", record->recording)
                                  : fmt::format("a result ({})", *unnamed);
  switch (request_.existing) {
    case ExistingResult::kRefuse:
      return fail(ErrorCode::kUsage, path().string(),
                  "this folder holds {}; give another folder with -o, or --overwrite to replace it", what);
    case ExistingResult::kOverwrite:
      if (record) earlier_files_ = record->files;
      return {};
    case ExistingResult::kResume:
      if (record && record->verb != request_.verb)
        return fail(ErrorCode::kUsage, path().string(),
                    "this folder holds {}, which `hm {} --resume` cannot continue", what, request_.verb);
      if (record) files_ = record->files;
      resumed_ = record ? *record : RunRecord{request_.verb, {}, {}, {}, {}};
  }
  return {};
}

Result<void> ResultFolder::write_record(RunState state) const {
  std::vector<std::string> files = files_;
  files.insert(files.end(), earlier_files_.begin(), earlier_files_.end());
  const auto json = JsonValue::object({{"verb", request_.verb},
                                       {"recording", absolute_name(request_.recording)},
                                       {"version", request_.program_version},
                                       {"state", std::string(to_string(state))},
                                       {"files", JsonValue::array_of(files)}});
  return write_file_text(path() / kRecordName, to_json_text(json) + "\n");
}

/// Removes the files of the result that is replaced, but for those that this run writes anew.
void ResultFolder::forget_earlier_files() {
  std::error_code ignored;
  for (const std::string& name : std::exchange(earlier_files_, {})) {
    if (std::find(files_.begin(), files_.end(), name) != files_.end()) continue;
    const fs::path file = path() / name;
    if (fs::is_directory(fs::symlink_status(file, ignored))) continue;
    fs::remove(file, ignored);
    if (file.parent_path() != path()) ::rmdir(file.parent_path().c_str());  // if it is empty
  }
}

fs::path ResultFolder::name_in_folder(const fs::path& file) const {
  const fs::path name = file.lexically_relative(staging_);
  return name.empty() || *name.begin() == ".." ? file.lexically_relative(path()) : name;
}

/// Moves a file out of staging(), unless it was published before. A link in the place of one of its folders
/// is removed, not followed.
Result<void> ResultFolder::move_file(const fs::path& name) {
  const fs::path from = staging_ / name, to = path() / name;
  std::error_code code;
  if (!fs::exists(from, code)) return {};
  fs::path folder = path();
  for (const fs::path& part : name.parent_path()) {
    folder /= part;
    if (fs::is_symlink(fs::symlink_status(folder, code))) fs::remove(folder, code);
  }
  fs::create_directories(to.parent_path(), code);
  if (!code) fs::rename(from, to, code);
  if (code) return fail(ErrorCode::kInternal, to.string(), "cannot be written: {}", code.message());
  return {};
}

Result<void> ResultFolder::publish(std::vector<fs::path>& files, RunState state) {
  std::vector<fs::path> names;
  for (fs::path& file : files) {
    const fs::path name = name_in_folder(file);
    std::error_code code;
    if (!fs::is_directory(staging_ / name, code)) names.push_back(name);
    for (fs::recursive_directory_iterator entry(staging_ / name, code), end; !code && entry != end;
         entry.increment(code))
      if (entry->is_regular_file(code)) names.push_back(entry->path().lexically_relative(staging_));
    file = path() / name;
  }
  for (const fs::path& name : names)
    if (std::find(files_.begin(), files_.end(), name.string()) == files_.end())
      files_.push_back(name.string());
  // The record first: whenever the process ends, it names every file of both runs.
  if (const auto written = as_run_failure(write_record(RunState::kRunning)); !written) return written;
  forget_earlier_files();  // before the new ones come: no file of one result beside those of the other
  for (const fs::path& name : names)
    if (const auto moved = move_file(name); !moved) return moved;
  return as_run_failure(write_record(state));
}

}  // namespace hm
