#include <fmt/compile.h>
#include <fmt/format.h>

#include <iterator>
#include <string>

#include "hm/io/mesh/mesh_formats.hpp"

namespace hm {
void write_obj(OutputFile& file, const TriangleMesh& mesh, const MeshWriteOptions& options) {
  file.write(fmt::format("# made by {}\n# frame {}, right-handed\n# up {}\n# units metres\n",
                         one_line(options.program), one_line(options.frame), to_string(options.up)));
  fmt::memory_buffer line;
  const auto out = std::back_inserter(line);
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    line.clear();
    const Eigen::Vector3f& v = mesh.vertices[i];
    fmt::format_to(out, FMT_COMPILE("v {} {} {}"), v.x(), v.y(), v.z());
    if (mesh.has_colors()) {
      const Rgb8& color = mesh.colors[i];
      fmt::format_to(out, FMT_COMPILE(" {:.4f} {:.4f} {:.4f}"), color.r / 255.0, color.g / 255.0,
                     color.b / 255.0);
    }
    line.push_back('\n');
    file.write(line.data(), line.size());
  }
  for (const Eigen::Vector3f& normal : mesh.normals) {
    line.clear();
    fmt::format_to(out, FMT_COMPILE("vn {} {} {}\n"), normal.x(), normal.y(), normal.z());
    file.write(line.data(), line.size());
  }
  for (const auto& t : mesh.triangles) {
    line.clear();
    const std::uint32_t a = t[0] + 1, b = t[1] + 1, c = t[2] + 1;
    if (mesh.has_normals())
      fmt::format_to(out, FMT_COMPILE("f {}//{} {}//{} {}//{}\n"), a, a, b, b, c, c);
    else
      fmt::format_to(out, FMT_COMPILE("f {} {} {}\n"), a, b, c);
    file.write(line.data(), line.size());
  }
}

}  // namespace hm
