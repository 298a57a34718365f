#include "hm/core/process_memory.hpp"
#include "program.hpp"

int main(int argc, char** argv) {
  hm::return_large_blocks();
  Program program;
  add_demo(program);
  add_info(program);
  add_simulate(program);
  add_reconstruct(program);
  add_odometry(program);
  add_slam(program);
  add_laser(program);
  add_calibrate(program);
  add_evaluate(program);
  add_convert(program);
  add_params(program);
  return program.run(argc, argv);
}
