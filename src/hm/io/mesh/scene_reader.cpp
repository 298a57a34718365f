#include "hm/io/mesh/scene_reader.hpp"

#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <assimp/Importer.hpp>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "hm/io/bytes/file_name.hpp"
#include "hm/io/bytes/input_file.hpp"
#include "hm/io/image/srgb.hpp"
#include "hm/io/mesh/isolated_call.hpp"

namespace hm {
namespace {

using Matrix4f = Eigen::Matrix<float, 4, 4, Eigen::RowMajor>;  ///< as assimp stores it

/// The meshes of a scene, one behind the other: what the process that ran assimp sends.
struct Soup {
  std::vector<Eigen::Vector3f> vertices, normals, colors;  ///< the latter two empty or as long
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

template <class T>
void put(std::string& out, const std::vector<T>& values) {
  const std::uint64_t count = values.size();
  out.append(reinterpret_cast<const char*>(&count), sizeof count);
  if (count > 0) out.append(reinterpret_cast<const char*>(values.data()), count * sizeof(T));
}

template <class T>
bool take(const std::string& bytes, std::size_t& at, std::vector<T>& values) {
  std::uint64_t count = 0;
  if (bytes.size() - at < sizeof count) return false;
  std::memcpy(&count, bytes.data() + at, sizeof count);
  at += sizeof count;
  if (count > (bytes.size() - at) / sizeof(T)) return false;
  values.resize(count);
  // memcpy and append take no null pointer, which is where an empty vector may be.
  if (count > 0) std::memcpy(static_cast<void*>(values.data()), bytes.data() + at, count * sizeof(T));
  at += count * sizeof(T);
  return true;
}

/// The rotation to z up, and the scale to metres, of a format; nothing where it is neither.
Result<Matrix4f> to_map_axes(const aiScene& scene, const std::string& extension) {
  Matrix4f y_up = Matrix4f::Zero();
  y_up(0, 0) = 1, y_up(1, 2) = -1, y_up(2, 1) = 1, y_up(3, 3) = 1;
  // By the specification for glTF; assimp turns COLLADA so and scales it.
  if (extension == ".gltf" || extension == ".glb" || extension == ".dae") return y_up;
  if (extension != ".fbx" || scene.mMetaData == nullptr) return Matrix4f(Matrix4f::Identity());
  int up_axis = 1, sign = 1;
  float centimetres = 1;
  scene.mMetaData->Get("UpAxis", up_axis);
  scene.mMetaData->Get("UpAxisSign", sign);
  scene.mMetaData->Get("UnitScaleFactor", centimetres);
  if ((up_axis != 1 && up_axis != 2) || sign != 1)
    return fail(ErrorCode::kUnsupported, {}, "neither y nor z is up");
  Matrix4f result = up_axis == 1 ? y_up : Matrix4f(Matrix4f::Identity());
  result.topRows<3>() *= 0.01F * centimetres;
  return result;
}

Eigen::Vector3f vector_of(const aiVector3D& v) { return {v.x, v.y, v.z}; }

void append(Soup& soup, const aiMesh& mesh, const Matrix4f& T_map_mesh) {
  const auto first = static_cast<std::uint32_t>(soup.vertices.size());
  const Eigen::Matrix3f linear = T_map_mesh.topLeftCorner<3, 3>();
  const bool mirrors = linear.determinant() < 0;
  const Eigen::Matrix3f of_normals = linear.inverse().transpose() * (mirrors ? -1.F : 1.F);
  for (unsigned i = 0; i < mesh.mNumVertices; ++i) {
    soup.vertices.emplace_back(linear * vector_of(mesh.mVertices[i]) + T_map_mesh.topRightCorner<3, 1>());
    if (mesh.HasNormals()) soup.normals.emplace_back((of_normals * vector_of(mesh.mNormals[i])).normalized());
    if (!mesh.HasVertexColors(0)) continue;
    const aiColor4D& color = mesh.mColors[0][i];
    soup.colors.emplace_back(color.r, color.g, color.b);
  }
  for (unsigned i = 0; i < mesh.mNumFaces; ++i) {
    const aiFace& face = mesh.mFaces[i];
    if (face.mNumIndices != 3) continue;  // a point or a line
    std::array<std::uint32_t, 3> triangle{};
    for (std::size_t c = 0; c < 3; ++c) triangle[c] = first + face.mIndices[mirrors ? 2 - c : c];
    soup.triangles.push_back(triangle);
  }
}

/// Scenes are trees; a file that makes a graph of one, or a very deep one, ends at the process's limits.
void append(Soup& soup, const aiScene& scene, const aiNode& node, const Matrix4f& T_map_parent) {
  const Matrix4f T_map_node = T_map_parent * Eigen::Map<const Matrix4f>(&node.mTransformation.a1);
  for (unsigned i = 0; i < node.mNumMeshes; ++i)
    if (node.mMeshes[i] < scene.mNumMeshes) append(soup, *scene.mMeshes[node.mMeshes[i]], T_map_node);
  for (unsigned i = 0; i < node.mNumChildren; ++i) append(soup, scene, *node.mChildren[i], T_map_node);
}

/// Reads the scene; runs in the isolated process.
Result<std::string> import_scene(const std::filesystem::path& path) {
  Assimp::Importer importer;
  const aiScene* scene = importer.ReadFile(path.string(), aiProcess_Triangulate);
  if (scene == nullptr || scene->mRootNode == nullptr)
    return fail(ErrorCode::kCorrupted, {}, "assimp: {}", importer.GetErrorString());
  const auto T_map_scene = to_map_axes(*scene, lower_extension(path));
  if (!T_map_scene) return forward_error(T_map_scene);
  Soup soup;
  append(soup, *scene, *scene->mRootNode, *T_map_scene);
  // Attributes of a part of the meshes are none. Those of STL are of its faces.
  if (soup.normals.size() != soup.vertices.size() || lower_extension(path) == ".stl") soup.normals.clear();
  if (soup.colors.size() != soup.vertices.size()) soup.colors.clear();
  std::string bytes;
  put(bytes, soup.vertices);
  put(bytes, soup.normals);
  put(bytes, soup.colors);
  put(bytes, soup.triangles);
  return bytes;
}

Result<Soup> soup_of(const std::string& bytes, const std::string& where) {
  Soup soup;
  std::size_t at = 0;
  if (!take(bytes, at, soup.vertices) || !take(bytes, at, soup.normals) || !take(bytes, at, soup.colors) ||
      !take(bytes, at, soup.triangles) || at != bytes.size())
    return fail(ErrorCode::kInternal, where, "its reader gave half an answer");
  if (soup.triangles.empty()) return fail(ErrorCode::kCorrupted, where, "no triangle in it");
  if (soup.vertices.size() > static_cast<std::size_t>(std::numeric_limits<std::int32_t>::max()))
    return fail(ErrorCode::kUnsupported, where, "too many vertices");
  for (std::size_t i = 0; i < soup.vertices.size(); ++i)
    if (!soup.vertices[i].allFinite())
      return fail(ErrorCode::kCorrupted, where, "vertex {} is not finite", i);
  for (const auto& triangle : soup.triangles)
    for (const std::uint32_t index : triangle)
      if (index >= soup.vertices.size())
        return fail(ErrorCode::kCorrupted, where, "a triangle names vertex {} of {}", index,
                    soup.vertices.size());
  return soup;
}

/// First vertex with the same position, for every vertex.
std::vector<std::uint32_t> first_of_position(const std::vector<Eigen::Vector3f>& vertices) {
  std::vector<std::uint32_t> order(vertices.size());
  std::iota(order.begin(), order.end(), 0U);
  const auto key = [&vertices](std::uint32_t i) {
    return std::array{vertices[i].x(), vertices[i].y(), vertices[i].z()};
  };
  std::sort(order.begin(), order.end(), [&key](std::uint32_t a, std::uint32_t b) {
    const auto of_a = key(a), of_b = key(b);
    return of_a != of_b ? of_a < of_b : a < b;
  });
  std::vector<std::uint32_t> first(vertices.size());
  for (std::size_t i = 0; i < order.size(); ++i)
    first[order[i]] = i > 0 && key(order[i]) == key(order[i - 1]) ? first[order[i - 1]] : order[i];
  return first;
}

Rgb8 color_of(const Eigen::Vector3f& color, bool is_linear) {
  std::array<std::uint8_t, 3> rgb{};
  for (std::size_t c = 0; c < 3; ++c) {
    const double value = color[static_cast<Eigen::Index>(c)];
    const double inside = value > 0 ? std::min(value, 1.0) : 0.0;
    rgb[c] = static_cast<std::uint8_t>(std::lround(255.0 * (is_linear ? linear_to_srgb(inside) : inside)));
  }
  return {rgb[0], rgb[1], rgb[2]};
}

/// One vertex a position, numbered as the first of each come.
TriangleMesh welded(const Soup& soup, bool has_linear_colors) {
  const std::vector<std::uint32_t> first = first_of_position(soup.vertices);
  std::vector<std::uint32_t> number(first.size());
  TriangleMesh mesh;
  for (std::size_t i = 0; i < first.size(); ++i) {
    if (first[i] == i) {
      number[i] = static_cast<std::uint32_t>(mesh.vertices.size());
      mesh.vertices.push_back(soup.vertices[i]);
      if (!soup.normals.empty()) mesh.normals.emplace_back(Eigen::Vector3f::Zero());
      if (!soup.colors.empty()) mesh.colors.push_back(color_of(soup.colors[i], has_linear_colors));
    }
    number[i] = number[first[i]];
    if (!soup.normals.empty() && soup.normals[i].allFinite()) mesh.normals[number[i]] += soup.normals[i];
  }
  for (Eigen::Vector3f& normal : mesh.normals) normal.normalize();  // of a zero vector: zero
  mesh.triangles.reserve(soup.triangles.size());
  for (const auto& triangle : soup.triangles)
    mesh.triangles.push_back({number[triangle[0]], number[triangle[1]], number[triangle[2]]});
  return mesh;
}

}  // namespace

Result<TriangleMesh> read_scene(const std::filesystem::path& path) {
  const auto file = InputFile::open(path);  // with the errors of every reader
  if (!file) return forward_error(file);
  constexpr std::uint64_t kLeastBytes = std::uint64_t{1} << 30U, kBytesPerByte = 64;
  constexpr std::uint64_t kBytesPerSecond = 1'000'000;
  constexpr int kLeastSeconds = 10;
  const IsolationLimits limits{kLeastBytes + kBytesPerByte * file->size(),
                               kLeastSeconds + static_cast<int>(file->size() / kBytesPerSecond)};
  const auto bytes = call_isolated(path.string(), limits, [&path] { return import_scene(path); });
  if (!bytes) return forward_error(bytes);
  const auto soup = soup_of(*bytes, path.string());
  if (!soup) return forward_error(soup);
  const std::string extension = lower_extension(path);
  return welded(*soup, extension == ".gltf" || extension == ".glb");
}

}  // namespace hm
