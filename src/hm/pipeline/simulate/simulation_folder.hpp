#pragma once
#include <filesystem>
#include <stop_token>
#include <string>
#include <utility>

#include "hm/core/result.hpp"
#include "hm/core/run_context.hpp"
#include "hm/io/bytes/folder_lock.hpp"

namespace hm {

/// The parameters in effect, beside what was simulated with them; there when all is written.
inline constexpr const char* kSimulationFile = "simulation.toml";

/// The sizes of the flaws of a recording.
inline constexpr const char* kFlawsFile = "flaws.toml";

/// The folder of a simulation while it is written: locked, and marked as unfinished by a file with the
/// parameters in effect, which gets its final name when all is written.
class SimulationFolder {
 public:
  /// Locks the folder, makes it where it is not there yet, and removes what an unfinished simulation left in
  /// it. Errors as those of FolderLock::acquire().
  static Result<SimulationFolder> acquire(std::filesystem::path path);
  /// Marks the folder as unfinished. Error: the file cannot be written.
  Result<void> mark(const std::string& parameters_toml) const;
  /// Ends the simulation: a success makes the folder finished and adds its mark to the outputs, a failure
  /// removes the files that simulations write, and the folder if nothing else is in it.
  template <class Summary>
  Result<Summary> finish(Result<Summary> summary) const {
    if (summary) {
      if (auto renamed = rename_mark(); !renamed) summary = forward_error(renamed);
    }
    if (summary)
      summary->outputs.push_back(path_ / kSimulationFile);
    else
      remove();
    return summary;
  }
  /// As remove_simulation().
  void remove() const;

 private:
  SimulationFolder(std::filesystem::path path, FolderLock lock)
      : path_(std::move(path)), lock_(std::move(lock)) {}
  [[nodiscard]] Result<void> rename_mark() const;

  std::filesystem::path path_;
  FolderLock lock_;
};

/// Error (kCancelled) when the simulation is to stop; `where` it was, as "at scan 3 of 40".
Result<void> check_not_stopped(const std::stop_token& stop, const std::string& where);

/// Makes the folder of a laser simulation if it is not there. Error (kUsage): it holds a recording.
Result<void> make_simulation_folder(const std::filesystem::path& folder);

/// Removes a recording that a simulation wrote, finished or not, and
/// its folder when nothing else is in it. Leaves any other folder alone. Error (kUsage): it is being written.
Result<void> remove_simulation(const std::filesystem::path& folder);

}  // namespace hm
