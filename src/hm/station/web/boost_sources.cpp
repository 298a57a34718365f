// hm: compiled alone (Boost's headers): the functions of Asio and Beast that are no templates, for
// web_server.cpp.
#include <utility>
// Beast 1.74 uses std::exchange without including it.
#include <boost/asio/impl/src.hpp>
#include <boost/beast/src.hpp>
