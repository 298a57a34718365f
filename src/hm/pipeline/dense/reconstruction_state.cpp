#include "hm/pipeline/dense/reconstruction_state.hpp"

#include <fmt/format.h>

#include <map>

namespace hm {

ReconstructionState initial_state(const RecordingInfo& info, std::size_t first_frame) {
  ReconstructionState state;
  state.recording = info.path.string();
  state.kind = info.kind;
  if (!info.stamps.empty()) state.first_stamp = info.stamps.front();
  state.next_frame = first_frame;
  return state;
}

Result<DenseParameters> parameters_of_map(const std::filesystem::path& map) {
  const auto file = MapFile::open(map, MapOpenMode::kRead);
  if (!file) return forward_error(file);
  DenseParameters parameters;
  auto list = list_reconstruction(parameters);
  if (const auto read = list.read_toml(file->header().parameters_toml, map.string() + " (its parameters)");
      !read)
    return forward_error(read);
  return parameters;
}

Result<void> check_resumable(const MapHeader& header, const MapHeader& of_run,
                             const ReconstructionState& state, const RecordingInfo& info,
                             const DenseParameters& parameters, const std::string& map_path) {
  DenseParameters of_map;
  auto list = list_reconstruction(of_map);
  if (const auto read = list.read_toml(header.parameters_toml, map_path + " (its parameters)"); !read)
    return read;
  const auto theirs = map_parameters(of_map), ours = map_parameters(parameters);
  std::vector<std::string> differences;
  for (std::size_t i = 0; i < ours.size(); ++i)
    if (ours[i] != theirs[i])
      differences.push_back(fmt::format("{} (now {})", theirs[i], ours[i].substr(ours[i].find('=') + 2)));
  if (!differences.empty())
    return fail(
        ErrorCode::kUsage, map_path,
        "the map was made with {}; give the same parameters (--params with the parameters.toml beside it) "
        "or start anew without --resume",
        fmt::join(differences, ", "));
  if (header.voxel_size_m != of_run.voxel_size_m || header.sdf_unit_m != of_run.sdf_unit_m)
    return fail(
        ErrorCode::kCorrupted, map_path,
        "its header says voxels of {} m and distances in units of {} m, its parameters {} m and {} m: "
        "the map is damaged or was made by another program; start anew without --resume",
        header.voxel_size_m, header.sdf_unit_m, of_run.voxel_size_m, of_run.sdf_unit_m);
  const bool same_start = !info.stamps.empty() && info.stamps.front() == state.first_stamp;
  if (state.kind != info.kind || !same_start || state.next_frame > info.frame_count)
    return fail(ErrorCode::kUsage, map_path,
                "the map was made from another recording ({}, from {:.3f} s, {} frames done)",
                state.recording, state.first_stamp.seconds(), state.next_frame);
  return {};
}

std::string commonest_reason(const std::vector<SkippedFrame>& skipped) {
  std::map<std::string, std::size_t> frames_of;
  for (const SkippedFrame& frame : skipped) ++frames_of[frame.reason];
  std::string most = "the range of frames is empty";
  std::size_t count = 0;
  for (const auto& [reason, frames] : frames_of)
    if (frames > count) count = frames, most = fmt::format("{} x {}", frames, reason);
  return most;
}

}  // namespace hm
