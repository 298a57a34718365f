#include "hm/pipeline/simulate/simulation_folder.hpp"

#include <array>

#include "hm/io/bytes/file_bytes.hpp"
#include "hm/io/bytes/output_file.hpp"

namespace hm {
namespace {

namespace fs = std::filesystem;

constexpr const char* kUnfinishedMark = "simulation.unfinished.toml";

/// All that simulations may write; the marks last, so that a removal that is cut short can be repeated.
constexpr std::array kOwnFiles{"depth",
                               "rgb",
                               "depth.txt",
                               "rgb.txt",
                               "associations.txt",
                               "camera.txt",
                               "groundtruth.txt",
                               "poses.txt",
                               "imu.csv",
                               "imu.toml",
                               "truth_mesh.ply",
                               "truth_visible.ply",
                               "truth_scene.json",
                               "recording.bag",
                               "recording.bag.partial",
                               "rig.toml",
                               "truth_floor.txt",
                               kFlawsFile,
                               kSimulationFile,
                               kUnfinishedMark};

void remove_files(const fs::path& folder) {
  std::error_code ignored;
  for (const char* name : kOwnFiles) fs::remove_all(folder / name, ignored);
}

}  // namespace

Result<SimulationFolder> SimulationFolder::acquire(fs::path path) {
  auto lock = FolderLock::acquire(path);
  if (!lock) return forward_error(lock);
  std::error_code code;
  if (fs::exists(path / kUnfinishedMark, code)) remove_files(path);
  return SimulationFolder(std::move(path), std::move(*lock));
}

Result<void> SimulationFolder::mark(const std::string& parameters_toml) const {
  return as_run_failure(write_file_text(path_ / kUnfinishedMark, parameters_toml));
}

Result<void> SimulationFolder::rename_mark() const {
  std::error_code code;
  fs::rename(path_ / kUnfinishedMark, path_ / kSimulationFile, code);
  if (!code) return {};
  return fail(ErrorCode::kInternal, (path_ / kUnfinishedMark).string(), "cannot be renamed: {}",
              code.message());
}

void SimulationFolder::remove() const {
  remove_files(path_);
  std::error_code ignored;
  fs::remove(path_, ignored);  // fails when something else is in it, as it should
}

Result<void> check_not_stopped(const std::stop_token& stop, const std::string& where) {
  if (!stop.stop_requested()) return {};
  return fail(ErrorCode::kCancelled, {}, "the simulation was stopped {}; nothing of it was kept", where);
}

Result<void> make_simulation_folder(const fs::path& folder) {
  std::error_code code;
  for (const char* name : {"recording.bag", "depth.txt", "groundtruth.txt", kSimulationFile})
    if (fs::exists(folder / name, code))
      return fail(ErrorCode::kUsage, folder.string(),
                  "there is a recording already ({}); choose another folder", name);
  return make_folder(folder);
}

Result<void> remove_simulation(const fs::path& folder) {
  std::error_code code;
  if (!fs::exists(folder / kSimulationFile, code) && !fs::exists(folder / kUnfinishedMark, code)) return {};
  const auto simulation = SimulationFolder::acquire(folder);
  if (!simulation) return forward_error(simulation);
  simulation->remove();
  return {};
}

}  // namespace hm
