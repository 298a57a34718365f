// The firmware: one step of the autopilot a millisecond.
#include "board.hpp"

namespace {
hm::Autopilot autopilot;
}

int main() {
  hm::board::start();
  for (;;) {
    const hm::AutopilotOutputs& outputs = autopilot.step(hm::board::wait_step());
    hm::board::drive(outputs, autopilot.estimate());
  }
}
