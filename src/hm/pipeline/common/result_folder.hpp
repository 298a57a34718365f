#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "hm/core/result.hpp"
#include "hm/io/bytes/folder_lock.hpp"

namespace hm {

/// How a run treats an existing result in its folder.
enum class ExistingResult {
  kRefuse,     ///< fails and names the result
  kOverwrite,  ///< replaces it as soon as the run has something to show
  kResume,     ///< continues it; starts anew where there is none
};

enum class RunState { kRunning, kStopped, kComplete };
std::string_view to_string(RunState state);

struct ResultFolderRequest;

/// Contents of `run.json`, by which a folder of results is recognised.
struct RunRecord {
  std::string verb, recording, program_version;
  RunState state = RunState::kRunning;
  std::vector<std::string> files;  ///< that the run wrote, relative to the folder

  /// True for a run of the same verb on a recording in the same place.
  [[nodiscard]] bool is_of(const ResultFolderRequest& request) const;
};

/// Reads the record of a folder of results; nothing where the folder has none. An error when it is damaged.
Result<std::optional<RunRecord>> read_run_record(const std::filesystem::path& folder);

/// A run that wants to write into a folder.
struct ResultFolderRequest {
  std::filesystem::path folder;
  ExistingResult existing = ExistingResult::kRefuse;
  std::string verb;                 ///< "reconstruct"
  std::filesystem::path recording;  ///< the input that the results are made of; may be empty
  std::string program_version;
};

/// A folder that one run writes its results into. Until it is destroyed no other run can open the folder (a
/// lock of the operating system, which ends with the process). Files are written into staging() and appear
/// in the folder when they are published, so that an earlier result stays whole until there is a new one.
class ResultFolder {
 public:
  /// Makes the folder where it is not there yet, and locks it. Errors (kUsage): it cannot be made, another
  /// run writes into it, or it holds a result that the request does not allow to replace or to continue.
  static Result<ResultFolder> open(const ResultFolderRequest& request);
  /// Removes what was not published, and the folder if it was made by open() and is empty.
  ~ResultFolder();
  ResultFolder(ResultFolder&&) noexcept;
  ResultFolder& operator=(ResultFolder&&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const { return request_.folder; }
  /// A folder inside it for files that are being written.
  [[nodiscard]] const std::filesystem::path& staging() const { return staging_; }
  /// The record of the run that is to be continued; nothing for a run that starts anew.
  [[nodiscard]] const std::optional<RunRecord>& resumed() const { return resumed_; }

  /// Moves files, and folders of files, from staging() to their places, and changes `files` to the new paths;
  /// those that are in place already stay. The first call removes the other files of the result that is
  /// replaced. Errors: a file cannot be moved, the record cannot be written.
  Result<void> publish(std::vector<std::filesystem::path>& files, RunState state);

 private:
  explicit ResultFolder(const ResultFolderRequest& request) : request_(request) {}
  Result<void> make();
  Result<void> check_existing();
  Result<void> write_record(RunState state) const;
  void forget_earlier_files();
  [[nodiscard]] std::filesystem::path name_in_folder(const std::filesystem::path& file) const;
  Result<void> move_file(const std::filesystem::path& name);

  ResultFolderRequest request_;
  std::filesystem::path staging_;
  std::vector<std::filesystem::path> made_;  ///< folders that open() made, the innermost first
  std::optional<FolderLock> lock_;
  std::optional<RunRecord> resumed_;
  std::vector<std::string> files_;          ///< of this run, published; of the one that it continues
  std::vector<std::string> earlier_files_;  ///< of the result that this run replaces
};

}  // namespace hm
