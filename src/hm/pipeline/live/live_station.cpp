#include "hm/pipeline/live/live_station.hpp"

#include <fmt/format.h>

#include <charconv>
#include <chrono>
#include <cstring>
#include <optional>
#include <system_error>

#include "hm/io/bytes/file_bytes.hpp"
#include "hm/io/mesh/mesh_file.hpp"
#include "hm/report/floor_plan_svg.hpp"
#include "hm/station/page_files.hpp"
#include "hm/station/web/qr_text.hpp"

namespace hm {
namespace {

struct Address {
  std::string host = "127.0.0.1";
  std::uint16_t port = 0;
  bool port_given = false;
};

bool read_port(std::string_view text, Address& address) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), address.port);
  address.port_given = error == std::errc() && end == text.data() + text.size();
  return address.port_given;
}

/// "", "8710", "0.0.0.0", "0.0.0.0:8710", "[::1]:8710".
Result<Address> parse_address(const std::string& text) {
  Address address;
  const bool is_number = !text.empty() && text.find_first_not_of("0123456789") == std::string::npos;
  if (text.empty() || (is_number && read_port(text, address))) return address;
  const std::size_t colon = text.rfind(':');
  const bool has_port = colon != std::string::npos && (text.front() != '[' || text[colon - 1] == ']');
  address.host = text.substr(0, has_port ? colon : std::string::npos);
  if (address.host.size() > 2 && address.host.front() == '[' && address.host.back() == ']')
    address.host = address.host.substr(1, address.host.size() - 2);
  if (is_number || address.host.empty() || (has_port && !read_port(text.substr(colon + 1), address)))
    return fail(ErrorCode::kUsage, "--serve " + text, "give PORT, ADDRESS or ADDRESS:PORT");
  return address;
}

std::vector<std::byte> bytes_of(std::string_view text) {
  std::vector<std::byte> bytes(text.size());
  std::memcpy(bytes.data(), text.data(), text.size());
  return bytes;
}

/// A mesh as a file of this extension.
Result<std::vector<std::byte>> mesh_file(const TriangleMesh& mesh, const std::string& extension,
                                         const std::string& program) {
  if (mesh.triangles.empty()) return fail(ErrorCode::kNotFound, "mesh" + extension, "there is no mesh yet");
  std::error_code code;
  std::string name = (std::filesystem::temp_directory_path(code) / "hm-export-XXXXXX").string();
  if (!mkdtemp(name.data()))
    return fail(ErrorCode::kInternal, name, "cannot make a folder: {}", std::strerror(errno));
  const std::filesystem::path folder = name, path = folder / ("mesh" + extension);
  MeshWriteOptions options;
  options.frame = "map";
  options.program = "housemartin " + program;
  Result<std::vector<std::uint8_t>> file;
  const auto written = write_mesh(path, mesh, options);
  file = written ? read_file_bytes(path) : forward_error(written);
  std::filesystem::remove_all(folder, code);
  if (!file) return forward_error(file);
  return bytes_of({reinterpret_cast<const char*>(file->data()), file->size()});
}

Result<std::vector<std::byte>> plan_file(const TriangleMesh& mesh) {
  if (mesh.triangles.empty()) return fail(ErrorCode::kNotFound, "plan.svg", "there is no mesh yet");
  const SceneExtent extent = scene_extent(mesh);
  return bytes_of(floor_plan_svg(mesh, extent, scene_size(mesh, extent), nullptr));
}

Result<std::vector<std::byte>> report_file(const std::filesystem::path& path) {
  const auto file = read_file_bytes(path);
  if (!file) return forward_error(file);
  return bytes_of({reinterpret_cast<const char*>(file->data()), file->size()});
}

}  // namespace

std::vector<StationExport> LiveStation::exports(const LiveStationOptions& options) {
  using Bytes = Result<std::vector<std::byte>>;
  const auto of_mesh = [this](auto make) {
    return [this, make]() -> Bytes {
      const std::lock_guard lock(export_mutex_);
      if (ended_) return fail(ErrorCode::kCancelled, "export", "the station is ending");
      return make(view_->pages().whole_mesh());
    };
  };
  const std::string program = options.program_version;
  std::vector<StationExport> files;
  files.push_back({"mesh.ply", "application/octet-stream", of_mesh([program](const TriangleMesh& mesh) {
                     return mesh_file(mesh, ".ply", program);
                   })});
  files.push_back({"mesh.glb", "model/gltf-binary", of_mesh([program](const TriangleMesh& mesh) {
                     return mesh_file(mesh, ".glb", program);
                   })});
  files.push_back({"plan.svg", "image/svg+xml", of_mesh(plan_file)});
  if (!options.report.empty())
    files.push_back(
        {"report", "text/html; charset=utf-8", [path = options.report] { return report_file(path); }});
  if (!options.report_to_come.empty())
    files.push_back({"report", "text/html; charset=utf-8", [this] { return report_of_run(); }});
  return files;
}

Result<std::vector<std::byte>> LiveStation::report_of_run() const {
  if (is_report_written_) return report_file(report_to_come_);
  return fail(ErrorCode::kNotFound, report_to_come_.filename().string(), "the run has written no report yet");
}

/// An older report lies in the folder of a run that failed before it wrote one.
void LiveStation::offer_report() {
  // File times are those of the last tick of the system's clock.
  constexpr auto kFileTimeStep = std::chrono::milliseconds(20);
  std::error_code code;
  const auto written_at = std::filesystem::last_write_time(report_to_come_, code);
  is_report_written_ = !code && written_at + kFileTimeStep >= opened_at_;
}

LiveStation::~LiveStation() {
  const std::lock_guard lock(export_mutex_);
  ended_ = true;
}

Result<std::unique_ptr<LiveStation>> LiveStation::open(const LiveStationOptions& options) {
  const auto address = parse_address(options.listen);
  if (!address) return forward_error(address);
  std::unique_ptr<LiveStation> session(new LiveStation);
  StationOptions station;
  station.address = address->host;
  station.port = address->port;
  station.port_given = address->port_given;
  station.source = JsonValue::object({{"verb", options.verb}, {"name", options.name}});
  station.program_version = options.program_version;
  session->report_to_come_ = options.report_to_come;
  station.exports = session->exports(options);
  station.pilot = options.pilot;
  station.replay = options.replay;
  auto started = Station::start(std::move(station));
  if (!started) return forward_error(started);
  session->station_ = std::move(*started);
  session->view_ = std::make_unique<StationView>(session->station_->store());
  return session;
}

std::string live_announcement(const std::string& url, bool is_public, bool has_page) {
  // The address last: what a caller adds stands behind it.
  const std::optional<std::string> code = is_public ? qr_text(url) : std::nullopt;
  const std::string no_page = has_page
                                  ? ""
                                  : "the page was not built: install nodejs and npm, then call ./hm serve; "
                                    "until then the address shows only /api, /live and /foxglove\n";
  return no_page + (code ? "\n" + *code : "") + "live view: " + url;
}

std::string LiveStation::announcement() const {
  return live_announcement(station_->url(), station_->is_public(), !page_files().empty());
}

}  // namespace hm
