#include "program.hpp"

namespace {

// Linked with the verbs that need more than dense reconstruction.
[[maybe_unused]] const bool kIsWhole = (has_all_parts = true);

}  // namespace
