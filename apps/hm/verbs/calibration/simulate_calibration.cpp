#include "verbs/calibration/simulate_calibration.hpp"

#include "hm/core/text/counted.hpp"
#include "hm/pipeline/calibrate/calibrate_parameter_list.hpp"

namespace {

hm::Result<Outcome> simulate_set(const CalibrationSetFlags& flags, Session& session) {
  hm::CalibrateParameters parameters;
  hm::CalibrationSimulationParams& simulation = parameters.calibration_simulation;
  if (flags.seed >= 0) simulation.seed = flags.seed;
  for (std::size_t i = 0; i < std::size(hm::kCalibrationSensorNames); ++i)
    if (flags.sensor == hm::kCalibrationSensorNames[i])
      simulation.sensor = static_cast<hm::CalibrationSensor>(i);
  if (flags.perfect && simulation.sensor != hm::CalibrationSensor::kXtion)
    return hm::fail(hm::ErrorCode::kUsage, "--perfect", "images of a {} always contain its errors",
                    flags.sensor);
  if (flags.perfect) simulation.noise_quadratic_per_m = simulation.gray_sigma = simulation.warp_at_4m_m = 0;
  auto list = hm::list_calibration(parameters);
  if (const auto applied = session.apply(list); !applied) return hm::forward_error(applied);
  const hm::CalibrationSimulationOptions options{
      simulation, parameters.board, flags.output,
      session.interruptible_context("the unfinished images are removed")};
  const auto summary = hm::simulate_calibration(options);
  if (!summary) return hm::forward_error(summary);
  Outcome outcome;
  outcome.text = fmt::format(
      "{}: {} colour and {} infrared images, {}; {} for training and {} for testing, {} in total\n",
      options.output.string(), summary->color_images, summary->ir_images, hm::counted(summary->pairs, "pair"),
      hm::counted(summary->train_poses, "pose"), summary->test_poses,
      hm::counted(summary->depth_images, "depth image"));
  outcome.json = hm::JsonValue::object({{"color_pictures", summary->color_images},
                                        {"ir_pictures", summary->ir_images},
                                        {"pairs", summary->pairs},
                                        {"train_poses", summary->train_poses},
                                        {"test_poses", summary->test_poses},
                                        {"depth_images", summary->depth_images},
                                        {"seed", simulation.seed}});
  outcome.outputs = summary->outputs;
  return outcome;
}

// Known to the verb before main() begins.
[[maybe_unused]] const bool kIsRegistered = (simulate_calibration_set = simulate_set, true);

}  // namespace
