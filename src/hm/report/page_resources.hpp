#pragma once
#include <string_view>

namespace hm {

/// The files report.css and model_view.js of this folder, embedded when the program is built (HmRoom.cmake).
std::string_view report_css();
std::string_view model_view_js();

}  // namespace hm
