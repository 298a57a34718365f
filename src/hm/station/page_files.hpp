#pragma once
#include <span>
#include <string_view>

namespace hm {

/// A file of the page, as the program holds it.
struct PageFile {
  std::string_view path;  ///< "/index.html"
  std::string_view content_type, etag;
  std::span<const unsigned char> gzip;  ///< its contents, compressed
};

/// Files of the page that the web build wrote (build/web/page_files.cpp); empty in a program that was built
/// without it.
std::span<const PageFile> page_files();

}  // namespace hm
