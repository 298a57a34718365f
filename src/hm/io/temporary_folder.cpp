#include "hm/io/temporary_folder.hpp"

#include <cstdlib>
#include <string>

#include "hm/core/check.hpp"

namespace hm {

TemporaryFolder::TemporaryFolder() {
  std::string pattern = (std::filesystem::temp_directory_path() / "housemartin-XXXXXX").string();
  HM_CHECK(mkdtemp(pattern.data()) != nullptr, "cannot make {}", pattern);
  path_ = pattern;
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

}  // namespace hm
