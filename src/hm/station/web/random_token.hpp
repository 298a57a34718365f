#pragma once
#include <string>

namespace hm {

/// Random number of 128 bits from the operating system, in hexadecimal digits: nobody can guess it.
std::string random_token();

}  // namespace hm
