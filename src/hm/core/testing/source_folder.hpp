#pragma once
#include <filesystem>

namespace hm::test {

/// Root of the sources that the test was built from. A function, not a macro: were the path part of every
/// compiler call, no unit of a test could come from another clone's compiler cache.
std::filesystem::path source_folder();

}  // namespace hm::test
