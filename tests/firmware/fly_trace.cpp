// Flies the course of the flight tests with the host's core and writes its core.trace: fly_trace FILE [planted-bug]
// With a planted bug the host's core has one gain that is wrong in its last bit.
#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string_view>

#include "hm/flight/testing/flight_course.hpp"
#include "hm/flight/trace/core_recorder.hpp"

int main(int count, char** words) {
  const bool bug = count == 3 && std::string_view(words[2]) == "planted-bug";
  if (count != (bug ? 3 : 2)) {
    fmt::print(stderr, "fly_trace FILE [planted-bug]\n");
    return 2;
  }
  hm::AutopilotParams params;
  float& gain = params.cascade.position.velocity_xy_per_s;
  if (bug) gain = std::nextafter(gain, 100.0F);
  std::ofstream file(words[1], std::ios::binary);
  hm::FlightRig rig(params);
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
