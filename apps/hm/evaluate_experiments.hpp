#pragma once
#include "program.hpp"

/// `hm evaluate depth-compensation` and `hm evaluate uncertainty`: the dissertation's experiments.
void add_experiments(Program& program);
