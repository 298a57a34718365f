#include "verbs/calibration/calibrate.hpp"

#include "hm/pipeline/calibrate/calibration_extrinsics.hpp"
#include "hm/pipeline/calibrate/calibration_intrinsics.hpp"
#include "version.hpp"

hm::Result<hm::CalibrateParameters> parameters_of(const CalibrateFlags& flags, const Session& session) {
  hm::CalibrateParameters parameters;
  if (const auto board = flags.board.apply(flags.input, parameters.board); !board)
    return hm::forward_error(board);
  auto list = hm::list_calibration(parameters);
  if (const auto applied = session.apply(list); !applied) return hm::forward_error(applied);
  return parameters;
}

hm::ResultFolderRequest result_folder_of(const CalibrateFlags& flags, const std::string& word) {
  return {flags.output.folder_given, flags.output.existing(), "calibrate " + word, flags.input, kVersion};
}

void add_calibrate_output(Command command, const std::shared_ptr<CalibrateFlags>& flags, const char* name,
                          CalibrationStart start) {
  flags->output.add_to(command, name);
  command.when_parsed([flags, name] {
    if (flags->output.folder_given.empty()) flags->output.folder_given = name;
  });
  if (start == CalibrationStart::kNone) return;
  command
      .add_option("--calibration", flags->start, "calibration.toml (or its folder) to extend with the result")
      .required(start == CalibrationStart::kRequired);
}

namespace {

hm::Result<Outcome> run_intrinsics(const CalibrateFlags& flags, Session& session) {
  const auto parameters = parameters_of(flags, session);
  if (!parameters) return hm::forward_error(parameters);
  hm::IntrinsicsOptions options{
      flags.input, flags.start, {}, hm::CalibratedCamera::kColor, parameters->board, parameters->camera_fit,
      {}};
  if (flags.camera == "depth") options.camera = hm::CalibratedCamera::kDepth;
  options.run = session.interruptible_context(kCalibrationStopped);
  return run_into_folder(result_folder_of(flags, "intrinsics"), [&](const std::filesystem::path& folder) {
    options.output = folder;
    return hm::calibrate_intrinsics(options);
  });
}

hm::Result<Outcome> run_extrinsics(const CalibrateFlags& flags, Session& session) {
  const auto parameters = parameters_of(flags, session);
  if (!parameters) return hm::forward_error(parameters);
  hm::ExtrinsicsOptions options{flags.input,
                                flags.second_input,
                                flags.start,
                                {},
                                parameters->board,
                                parameters->stereo_fit,
                                session.interruptible_context(kCalibrationStopped)};
  return run_into_folder(result_folder_of(flags, "extrinsics"), [&](const std::filesystem::path& folder) {
    options.output = folder;
    return hm::calibrate_extrinsics(options);
  });
}

void add_calibrate(Program& program) {
  program.add(
      {"calibrate",
       "Calibrate cameras from images of a board: intrinsics, extrinsics, depth correction, depth noise.",
       "  hm calibrate intrinsics set/color -o color\n"
       "  hm calibrate noise set/depth -o noise",
       {}});
  auto flags = std::make_shared<CalibrateFlags>();
  Command intrinsics = program.add(
      {"calibrate intrinsics", "Estimate focal lengths, principal point and lens distortion of one camera.",
       "  hm calibrate intrinsics set/color -o color\n"
       "  hm calibrate intrinsics set/ir -o both --camera depth --calibration color",
       [flags](Session& session) { return run_intrinsics(*flags, session); }});
  intrinsics.add_option("pictures", flags->input, "folder of images of a board (.png, .jpg)").required();
  add_calibrate_output(intrinsics, flags, "calibration", CalibrationStart::kOptional);
  intrinsics
      .add_option("--camera", flags->camera,
                  "camera that took the images: color (default) or depth (infrared)")
      .one_of({"color", "depth"});
  flags->board.add_to(intrinsics);

  Command extrinsics = program.add(
      {"calibrate extrinsics", "Estimate the transformation from the depth camera to the colour camera.",
       "  hm calibrate extrinsics set/stereo/ir set/stereo/color --calibration both -o rig",
       [flags](Session& session) { return run_extrinsics(*flags, session); }});
  extrinsics.add_option("depth_images", flags->input, "folder of infrared images of the board").required();
  extrinsics.add_option("color_images", flags->second_input, "folder of colour images with the same names")
      .required();
  add_calibrate_output(extrinsics, flags, "calibration", CalibrationStart::kRequired);
  flags->board.add_to(extrinsics);
  add_calibrate_depth(program, flags);
  program.add_parameters([] { return hm::make_parameter_part(hm::list_calibration); });
}

const VerbRegistration kCalibrate(80, add_calibrate);

}  // namespace
