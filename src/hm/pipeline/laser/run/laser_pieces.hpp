#pragma once
#include <cstddef>
#include <filesystem>
#include <vector>

#include "hm/pipeline/laser/run/laser_rebuild.hpp"

namespace hm {

/// Pieces with fewer scans show next to nothing.
inline constexpr std::size_t kLeastPieceScans = 10;

/// Cuts a run where its poses lean on no confirmed match, and halves every piece whose visits of a place
/// contradict each other, until none does. `T_odom_base`: all poses of the run. `breaks`: stamps of those
/// that no match joins with the one before. `begin`: of the recording. Pieces of fewer than kLeastPieceScans
/// scans are left out; in order of time.
std::vector<LaserPiece> consistent_pieces(const Trajectory& T_odom_base, const std::vector<Time>& breaks,
                                          const ScanVisits& visits, Time begin);

/// Input of write_laser_pieces(); see RebuildInput.
struct LaserPiecesInput {
  const LaserRecording& recording;
  std::vector<LaserRig> rigs;
  MappedScanFile& scans;
  const Trajectory& T_odom_base;  ///< all poses of the run
};

/// Writes folder/pieces/NN.yaml, NN.pgm (an occupancy map for `map_server`) and NN.txt (poses, TUM format) of
/// every piece, all in the frame `odom` as it was within the piece, and notes the maps in `pieces`. A piece
/// whose map is empty is taken out. Error: a file cannot be written, or the scans cannot be read.
Result<void> write_laser_pieces(const LaserPiecesInput& input, const LaserParameters& params,
                                const std::filesystem::path& folder, std::vector<LaserPiece>& pieces);

}  // namespace hm
