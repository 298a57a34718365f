#pragma once
#include <fmt/format.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

#include "hm/geometry/triangle_mesh.hpp"

/// Small scene files written by hand from the formats' specifications: all of them are one tetrahedron.
namespace hm::test {

struct SceneFile {
  std::string name;
  std::string bytes;
};

inline TriangleMesh tetrahedron() {
  TriangleMesh mesh;
  mesh.vertices = {{1, 2, 3}, {2, 2, 3}, {1, 4, 3}, {1, 2, 6}};
  mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  return mesh;
}

inline SceneFile off_tetrahedron() {
  return {"a.off", "OFF\n4 4 0\n1 2 3\n2 2 3\n1 4 3\n1 2 6\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n"};
}

inline SceneFile stl_text_tetrahedron() {
  const TriangleMesh mesh = tetrahedron();
  std::string text = "solid a\n";
  for (const auto& triangle : mesh.triangles) {
    text += "facet normal 0 0 1\nouter loop\n";
    for (const std::uint32_t i : triangle)
      text +=
          fmt::format("vertex {} {} {}\n", mesh.vertices[i].x(), mesh.vertices[i].y(), mesh.vertices[i].z());
    text += "endloop\nendfacet\n";
  }
  return {"text.stl", text + "endsolid a\n"};
}

inline SceneFile stl_binary_tetrahedron() {
  const TriangleMesh mesh = tetrahedron();
  std::string bytes(80, '\0');
  const auto put = [&bytes](const auto& value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  put(static_cast<std::uint32_t>(mesh.triangles.size()));
  for (const auto& triangle : mesh.triangles) {
    put(std::array{0.F, 0.F, 1.F});
    for (const std::uint32_t i : triangle)
      put(std::array{mesh.vertices[i].x(), mesh.vertices[i].y(), mesh.vertices[i].z()});
    put(std::uint16_t{0});
  }
  return {"binary.stl", bytes};
}

/// In decimetres, below a node that translates; `up` is COLLADA's word for the axis.
inline SceneFile collada_tetrahedron(std::string_view up) {
  const bool y_up = up == "Y_UP";
  return {fmt::format("{}.dae", up),
          fmt::format(
              R"(<?xml version="1.0" encoding="utf-8"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="decimetre" meter="0.1"/><up_axis>{}</up_axis></asset>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="pa" count="12">{}</float_array><technique_common>
<accessor source="#pa" count="4" stride="3"><param name="X" type="float"/><param name="Y" type="float"/>
<param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="4"><input semantic="VERTEX" source="#v" offset="0"/><p>0 2 1 0 1 3 0 3 2 1 2 3</p></triangles>
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node id="n"><translate>{}</translate>
<instance_geometry url="#g"/></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>
)",
              up, y_up ? "0 0 0  10 0 0  0 0 -20  0 30 0" : "0 0 0  10 0 0  0 20 0  0 0 30",
              y_up ? "10 30 -20" : "10 20 30")};
}

/// In metres (100 cm) and z up.
inline std::string fbx_tetrahedron() {
  return R"(; FBX 7.3.0 project file
FBXHeaderExtension:  {
	FBXHeaderVersion: 1003
	FBXVersion: 7300
}
GlobalSettings:  {
	Version: 1000
	Properties70:  {
		P: "UpAxis", "int", "Integer", "",2
		P: "UpAxisSign", "int", "Integer", "",1
		P: "UnitScaleFactor", "double", "Number", "",100
	}
}
Objects:  {
	Geometry: 1000, "Geometry::a", "Mesh" {
		Vertices: *12 {
			a: 0,0,0,1,0,0,0,2,0,0,0,3
		}
		PolygonVertexIndex: *12 {
			a: 0,2,-2,0,1,-4,0,3,-3,1,2,-4
		}
	}
	Model: 2000, "Model::a", "Mesh" {
		Version: 232
		Properties70:  {
			P: "Lcl Translation", "Lcl Translation", "", "A",1,2,3
		}
	}
}
Connections:  {
	C: "OO",2000,0
	C: "OO",1000,2000
}
)";
}

inline std::string base64(const std::string& bytes) {
  constexpr std::string_view kLetters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t word = 0;
    for (std::size_t k = 0; k < 3; ++k)
      word = word << 8U | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0U);
    for (std::size_t k = 0; k < 4; ++k)
      text += i + k > bytes.size() ? '=' : kLetters[word >> (18 - 6 * k) & 63U];
  }
  return text;
}

template <class T>
std::string raw(const T& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof values[0]};
}

constexpr std::string_view kGltfViews =
    R"("scene":0,"scenes":[{"nodes":[0]}],"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],
"accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","min":[-1,0,-2],"max":[0,3,0]},
{"bufferView":1,"componentType":5123,"count":12,"type":"SCALAR"}],
"bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":24}])";

/// Positions (y up, mirrored in x) and indices of the tetrahedron.
inline std::string gltf_buffer() {
  const std::array<float, 12> positions{0, 0, 0, -1, 0, 0, 0, 0, -2, 0, 3, 0};
  const std::array<std::uint16_t, 12> indices{0, 1, 2, 0, 3, 1, 0, 2, 3, 1, 3, 2};
  return raw(positions) + raw(indices);
}

constexpr std::string_view kGltfNode = R"({"mesh":0,"translation":[1,3,-2],"scale":[-1,1,1]})";

inline SceneFile gltf_tetrahedron() {
  return {"a.gltf", fmt::format(R"({{"asset":{{"version":"2.0"}},{},"nodes":[{}],"buffers":[{{"byteLength":72,
"uri":"data:application/octet-stream;base64,{}"}}]}})",
                                kGltfViews, kGltfNode, base64(gltf_buffer()))};
}

/// A node with a transform, as most programs write it.
inline SceneFile glb_with_transform() {
  std::string json =
      fmt::format(R"({{"asset":{{"version":"2.0"}},{},"nodes":[{}],"buffers":[{{"byteLength":72}}]}})",
                  kGltfViews, kGltfNode);
  json.resize((json.size() + 3) / 4 * 4, ' ');
  const std::string binary = gltf_buffer();
  const auto word = [](std::size_t value) { return raw(std::array{static_cast<std::uint32_t>(value)}); };
  return {"transform.glb", "glTF" + word(2) + word(12 + 8 + json.size() + 8 + binary.size()) +
                               word(json.size()) + "JSON" + json + word(binary.size()) +
                               std::string("BIN\0", 4) + binary};
}

/// One triangle with normals (+y) and linear colours, below a node that scales y.
inline SceneFile gltf_with_attributes() {
  const std::array<float, 9> positions{0, 0, 0, 1, 0, 0, 0, 0, -1}, normals{0, 1, 0, 0, 1, 0, 0, 1, 0},
      colors{1, 0.2158F, 0, 1, 0.2158F, 0, 1, 0.2158F, 0};
  return {"attributes.gltf",
          fmt::format(R"({{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],
"nodes":[{{"mesh":0,"scale":[1,5,1]}}],
"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"NORMAL":1,"COLOR_0":2}}}}]}}],
"accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,-1],"max":[1,0,0]}},
{{"bufferView":1,"componentType":5126,"count":3,"type":"VEC3"}},
{{"bufferView":2,"componentType":5126,"count":3,"type":"VEC3"}}],
"bufferViews":[{{"buffer":0,"byteOffset":0,"byteLength":36}},{{"buffer":0,"byteOffset":36,"byteLength":36}},
{{"buffer":0,"byteOffset":72,"byteLength":36}}],
"buffers":[{{"byteLength":108,"uri":"data:application/octet-stream;base64,{}"}}]}})",
                      base64(raw(positions) + raw(normals) + raw(colors)))};
}

inline std::vector<SceneFile> scene_files() {
  return {off_tetrahedron(),           stl_text_tetrahedron(),      stl_binary_tetrahedron(),
          collada_tetrahedron("Z_UP"), collada_tetrahedron("Y_UP"), {"a.fbx", fbx_tetrahedron()},
          gltf_tetrahedron(),          glb_with_transform()};
}

}  // namespace hm::test
