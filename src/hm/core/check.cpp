#include "hm/core/check.hpp"

#include <cstdio>
#include <cstdlib>

namespace hm {

void check_failed(const char* file, int line, const char* condition, const std::string& details) {
  std::fprintf(stderr, "%s:%d: broken precondition: %s%s%s\n", file, line, condition,
               details.empty() ? "" : ": ", details.c_str());
  std::abort();
}

}  // namespace hm
