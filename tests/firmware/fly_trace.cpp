// Flies the course of the flight tests with the host's core and writes its core.trace: fly_trace FILE
#include <fmt/format.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>

#include "hm/flight/testing/flight_course.hpp"
#include "hm/flight/trace/core_recorder.hpp"

int main(int count, char** words) {
  if (count != 2) {
    fmt::print(stderr, "fly_trace FILE\n");
    return 2;
  }
  std::ofstream file(words[1], std::ios::binary);
  hm::FlightRig rig;
  hm::CoreRecorder recorder;
  rig.after_step = [&](const hm::FlightRig& now) {
    for (const hm::CoreTraceRecord& record :
         recorder.step(now.inputs, now.autopilot->outputs(), now.autopilot->estimate())) {
      const auto bytes = encode(record);
      file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    }
  };
  fly_course(rig);
  if (!file.flush()) {
    fmt::print(stderr, "fly_trace: {} could not be written\n", words[1]);
    return 1;
  }
  fmt::print("bytes: {}\n", static_cast<long>(file.tellp()));
  return 0;
}
