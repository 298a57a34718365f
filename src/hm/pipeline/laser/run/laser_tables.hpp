#pragma once
#include <filesystem>
#include <optional>

#include "hm/core/result.hpp"
#include "hm/io/bytes/output_file.hpp"
#include "hm/pipeline/laser/laser_pipeline.hpp"

namespace hm {

inline constexpr const char* kHeightTable = "height.csv";
inline constexpr const char* kStateTable = "states.csv";

/// Tables with a line for every scan, written while the run goes on: height.csv of the scans with a mirror
/// reading, states.csv (the fused state) of those with IMU readings. A table without a line is not written.
class LaserTables {
 public:
  explicit LaserTables(std::filesystem::path folder) : folder_(std::move(folder)) {}
  void add(const LaserStep& step);
  /// Error: one could not be written, as far as it is known by now (OutputFile::written()).
  [[nodiscard]] Result<void> written() const;
  /// Gives the tables their names. Error: one could not be written.
  Result<void> finish();

 private:
  std::filesystem::path folder_;
  std::optional<OutputFile> heights_, states_;
};

}  // namespace hm
