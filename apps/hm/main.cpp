#include "hm/core/process_memory.hpp"
#include "program.hpp"

int main(int argc, char** argv) {
  hm::keep_freed_memory();
  Program program;
  program.add_registered_verbs();
  return program.run(argc, argv);
}
