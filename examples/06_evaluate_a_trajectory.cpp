// How good is a trajectory? Absolute and relative error against the truth (ATE, RPE).
#include <cstdio>

#include "hm/evaluation/trajectory_error.hpp"
#include "hm/io/pose/trajectory_file.hpp"

int main(int argc, char** argv) {
  const char* truth_path = argc > 1 ? argv[1] : "recording/groundtruth.txt";
  const char* estimate_path = argc > 2 ? argv[2] : "odometry.tum";
  const auto truth = hm::read_trajectory(truth_path), estimate = hm::read_trajectory(estimate_path);
  if (!truth || !estimate) {
    std::printf("%s\n", hm::to_string((truth ? estimate : truth).error()).c_str());
    return 1;
  }
  const auto error = hm::evaluate_trajectory(*truth, *estimate);  // fitted by a rigid motion first
  if (!error) {
    std::printf("%s\n", hm::to_string(error.error()).c_str());
    return 1;
  }
  std::printf("%zu poses over %.2f m of path\n", error->pairs, error->truth_path_m);
  std::printf("absolute: %.1f mm root mean square, %.1f mm at most\n", 1e3 * error->position_m.rmse,
              1e3 * error->position_m.max);
  std::printf("from frame to frame: %.1f mm and %.2f degrees root mean square\n",
              1e3 * error->per_frame.translation_m.rmse, 57.29578 * error->per_frame.rotation_rad.rmse);
  return error->position_m.rmse < 0.1 * error->truth_path_m ? 0 : 1;
}
