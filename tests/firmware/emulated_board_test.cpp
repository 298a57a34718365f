#include "hm/pipeline/flight/emulated_board.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>

#include "hm/flight/testing/flight_course.hpp"

namespace hm {
namespace {

namespace fs = std::filesystem;

/// What the test firmware.image has built.
fs::path image() {
  const char* folder = std::getenv("HM_FIRMWARE");
  return fs::path(folder ? folder : "build/firmware") / "flight.elf";
}

class EmulatedBoardTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(image())) GTEST_SKIP() << image() << " is not built: package gcc-arm-none-eabi";
    auto started = EmulatedBoard::start({image()});
    if (!started && started.error().code == ErrorCode::kNotFound) GTEST_SKIP() << to_string(started.error());
    ASSERT_TRUE(started) << to_string(started.error());
    board = std::move(*started);
  }
  std::unique_ptr<EmulatedBoard> board;
};

/// The vehicle flies by what the board commands; the host's core sees the same inputs.
TEST_F(EmulatedBoardTest, FliesInClosedLoopWithTheBitsOfTheHost) {
  FlightRig rig;
  CoreRecorder recorder;
  int steps = 0, different = 0;
  rig.drive = [&](const AutopilotInputs& inputs) {
    const AutopilotOutputs outputs = board->step(inputs);
    CoreTraceRecord host, emulated;
    note_core_outputs(rig.autopilot->outputs(), rig.autopilot->estimate(), host);
    note_core_outputs(outputs, board->estimate(), emulated);
    if (find_core_difference(host, emulated)) ++different;
    ++steps;
    return outputs;
  };
  rig.run_ms(800);
  EXPECT_EQ(rig.send(CommandKind::kToggleEngage), Refusal::kNone);
  rig.run_ms(350);
  EXPECT_EQ(rig.send(CommandKind::kTakeOff), Refusal::kNone);
  rig.run_ms(2500);
  ASSERT_FALSE(board->failure()) << to_string(*board->failure());
  EXPECT_EQ(steps, 3652);
  EXPECT_EQ(different, 0);
  EXPECT_GT(rig.body.position.z(), FlightRig::kFeet_m + 0.5);  // it did fly
}

TEST_F(EmulatedBoardTest, ABoardThatDiesIsReportedAndItsMotorsAreOff) {
  AutopilotInputs inputs;
  inputs.now = Time{1'000'000};
  EXPECT_EQ(board->step(inputs).state, AutopilotState::kOff);
  board->stop();
  inputs.now = Time{2'000'000};
  EXPECT_EQ(board->step(inputs).state, AutopilotState::kError);
  ASSERT_TRUE(board->failure());
  EXPECT_NE(board->failure()->message.find("after 1 steps"), std::string::npos) << board->failure()->message;
  EXPECT_EQ(board->step(inputs).motors, MotorDemand::kOff);
}

TEST(EmulatedBoard, MissingProgramsAndImagesAreNamedWithTheirPackage) {
  const auto missing = EmulatedBoard::start({"/nowhere/flight.elf"});
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::kNotFound);
  EXPECT_NE(missing.error().message.find("gcc-arm-none-eabi"), std::string::npos);

  const fs::path file = fs::temp_directory_path() / "hm_no_firmware.elf";
  std::ofstream(file) << "no image";
  EmulatedBoardSetup setup{file, "hm-no-such-emulator"};
  const auto no_emulator = EmulatedBoard::start(setup);
  ASSERT_FALSE(no_emulator);
  EXPECT_EQ(no_emulator.error().code, ErrorCode::kNotFound);
  EXPECT_NE(no_emulator.error().message.find("install the package qemu-system-arm"), std::string::npos);
  fs::remove(file);
}

}  // namespace
}  // namespace hm
