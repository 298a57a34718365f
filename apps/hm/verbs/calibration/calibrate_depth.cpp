#include "hm/io/camera/camera_file.hpp"
#include "hm/pipeline/calibrate/calibration_depth.hpp"
#include "hm/pipeline/calibrate/calibration_noise.hpp"
#include "verbs/calibration/calibrate.hpp"

namespace {

hm::Result<Outcome> run_depth(const CalibrateFlags& flags, Session& session) {
  const auto parameters = parameters_of(flags, session);
  if (!parameters) return hm::forward_error(parameters);
  if (const auto checked = hm::check_given_depth_scale(flags.depth_units_per_m); !checked)
    return hm::forward_error(checked);
  hm::DepthCalibrationOptions options;
  options.set = flags.input, options.start = flags.start;
  if (flags.is_raw_disparity) options.images = hm::DepthImages::kRawDisparity;
  options.depth_units_per_m = flags.depth_units_per_m;
  options.board = parameters->board;
  options.fit = parameters->depth_fit;
  options.run = session.interruptible_context(kCalibrationStopped);
  return run_into_folder(result_folder_of(flags, "depth"), [&](const std::filesystem::path& folder) {
    options.output = folder;
    return hm::calibrate_depth(options);
  });
}

hm::Result<Outcome> run_noise(const CalibrateFlags& flags, Session& session) {
  const auto parameters = parameters_of(flags, session);
  if (!parameters) return hm::forward_error(parameters);
  const auto recording = flags.of_recording.options();
  if (!recording) return hm::forward_error(recording);
  hm::NoiseCalibrationOptions options;
  options.input = flags.input;
  options.recording_options = *recording;
  options.source = flags.from == "planes" ? hm::NoiseSource::kPlanes : hm::NoiseSource::kStatic;
  if (flags.of_recording.depth_units_per_m > 0)
    options.depth_units_per_m = flags.of_recording.depth_units_per_m;
  if (flags.is_raw_disparity) {
    const auto start = hm::read_start(flags.of_recording.calibration);
    if (!start) return hm::forward_error(start);
    options.disparity = start->disparity.value_or(hm::DisparityModel());
  }
  options.frame_limit = flags.frames;
  options.fit = parameters->noise_fit;
  options.run = session.interruptible_context(kCalibrationStopped);
  return run_into_folder(result_folder_of(flags, "noise"), [&](const std::filesystem::path& folder) {
    options.output = folder;
    return hm::calibrate_noise(options);
  });
}

}  // namespace

void add_calibrate_depth(Program& program, const std::shared_ptr<CalibrateFlags>& flags) {
  Command depth = program.add(
      {"calibrate depth", "Estimate the depth correction from images of a board at many distances.",
       "  hm calibrate depth set/depth --calibration rig -o corrected\n"
       "  hm calibrate depth set/depth --calibration rig -o thesis --set depth_fit.mode=quadratic",
       [flags](Session& session) { return run_depth(*flags, session); }});
  depth
      .add_option("set", flags->input,
                  "folder of poses (color.png, depth*.png each; or files 0007-c1.jpg, 0007-d.pgm), or of "
                  "train/ and test/")
      .required();
  add_calibrate_output(depth, flags, "calibration", CalibrationStart::kRequired);
  depth
      .add_option("--depth-units-per-m", flags->depth_units_per_m,
                  "value in the depth images for one metre (default: 1000)")
      .above_zero();
  depth.add_flag("--raw-disparity", flags->is_raw_disparity,
                 "depth images hold the raw disparity of a Kinect (11 bits): its model is fitted first");
  flags->board.add_to(depth);

  Command noise =
      program.add({"calibrate noise", "Estimate the depth noise as a function of distance, for --params.",
                   "  hm calibrate noise set/depth -o noise\n"
                   "  hm calibrate noise recording --from planes -o noise_of_planes",
                   [flags](Session& session) { return run_noise(*flags, session); }});
  noise.add_option("input", flags->input, "recording, or folder of poses as for `calibrate depth`")
      .required();
  add_calibrate_output(noise, flags, "noise", CalibrationStart::kNone);
  noise
      .add_option("--from", flags->from,
                  "static (default): repeated readings, nothing may move; planes: scatter of readings on "
                  "smooth surfaces")
      .one_of({"static", "planes"});
  noise.add_option("--frames", flags->frames, "maximum number of frames (default: 300)").above_zero();
  noise.add_flag(
      "--raw-disparity", flags->is_raw_disparity,
      "folder of poses with the raw disparity of a Kinect (constants: from --calibration, else published)");
  flags->of_recording.add_to(noise);
}
