#pragma once
#include <filesystem>

#include "hm/io/bytes/stamped_list.hpp"

namespace hm::detail {

/// True for a folder with images in depth/ named by stamps or numbers, and without a list of them.
bool has_named_images(const std::filesystem::path& folder);

/// Images of a recording without lists, and a description of how their names were interpreted.
struct NamedImages {
  AssociationList lists;
  bool has_stamps = true;  ///< false: names are frame numbers
  std::string note;
};
/// Lists depth/ and one of rgb/, color/, colour/, image/, images/ by file names: seconds
/// ("1305031102.175304"), integer nano-, micro- or milliseconds (19, 16 or 13 digits), else frame numbers at
/// this rate. Other names are counted as malformed. Error: no usable name in depth/.
Result<NamedImages> list_named_images(const std::filesystem::path& folder, double rate_hz);

}  // namespace hm::detail
