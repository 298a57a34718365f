#pragma once
#include <memory>
#include <string>

#include "hm/core/result.hpp"
#include "hm/link/transport/transport.hpp"

namespace hm {

/// Opens the way that a text names:
///
///     udp:ADDRESS:PORT     sends to ADDRESS:PORT from any free port (a ground station listens there)
///     udp:listen:PORT      listens on PORT of this machine, and answers whoever sends
///     serial:DEVICE:BAUD   a serial port, e.g. serial:/dev/ttyACM0:921600
///
/// Errors: kUsage for a text that names none of them; those of UdpSocket and SerialPort.
Result<std::unique_ptr<Transport>> open_transport(const std::string& text);

}  // namespace hm
