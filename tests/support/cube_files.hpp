/// \file
/// A cube of side 1 around the origin, written by hand in every mesh format that is read.
#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/temp_folder.hpp"

namespace afterglow::test {

inline std::vector<std::array<float, 3>> cubeCorners() {
  std::vector<std::array<float, 3>> corners;
  for (int i = 0; i < 8; ++i) {
    corners.push_back({i & 1 ? 0.5f : -0.5f, i & 2 ? 0.5f : -0.5f, i & 4 ? 0.5f : -0.5f});
  }
  return corners;
}

inline std::vector<std::array<int, 3>> cubeTriangles() {
  return {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
          {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
}

inline std::string cubeStl() {
  std::ostringstream out;
  out << "solid cube\n";
  for (const auto& t : cubeTriangles()) {
    out << "facet normal 0 0 0\nouter loop\n";
    for (const int i : t) {
      const auto p = cubeCorners()[static_cast<std::size_t>(i)];
      out << "vertex " << p[0] << ' ' << p[1] << ' ' << p[2] << '\n';
    }
    out << "endloop\nendfacet\n";
  }
  out << "endsolid cube\n";
  return out.str();
}

template <typename T>
void appendBytes(std::string& out, T value) {
  char bytes[sizeof(T)];
  std::memcpy(bytes, &value, sizeof(T));
  out.append(bytes, sizeof(T));
}

/// `claimed` triangles in the head, 12 in the body.
inline std::string cubeBinaryStl(std::uint32_t claimed = 12) {
  std::string out(80, ' ');
  appendBytes(out, claimed);
  for (const auto& t : cubeTriangles()) {
    for (int i = 0; i < 3; ++i) appendBytes(out, 0.0f);
    for (const int i : t) {
      const auto p = cubeCorners()[static_cast<std::size_t>(i)];
      for (const float x : p) appendBytes(out, x);
    }
    appendBytes(out, std::uint16_t{0});
  }
  return out;
}

inline std::string cubeObj(const std::string& materials = {}) {
  std::ostringstream out;
  if (!materials.empty()) out << "mtllib " << materials << "\n";
  for (const auto& p : cubeCorners()) out << "v " << p[0] << ' ' << p[1] << ' ' << p[2] << '\n';
  if (!materials.empty()) out << "usemtl paint\n";
  for (const auto& t : cubeTriangles()) {
    out << "f " << t[0] + 1 << ' ' << t[1] + 1 << ' ' << t[2] + 1 << '\n';
  }
  return out.str();
}

/// Of side 1 in meters, whatever the unit; the up axis is said to be y.
inline std::string cubeDae(double unit_m = 1) {
  std::ostringstream points, indices;
  for (const auto& p : cubeCorners()) {
    points << p[0] / unit_m << ' ' << p[1] / unit_m << ' ' << p[2] / unit_m << ' ';
  }
  for (const auto& t : cubeTriangles()) indices << t[0] << ' ' << t[1] << ' ' << t[2] << ' ';
  std::ostringstream out;
  out << R"(<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="u" meter=")"
      << unit_m << R"("/><up_axis>Y_UP</up_axis></asset>
<library_effects><effect id="e"><profile_COMMON><technique sid="t"><lambert>
<diffuse><color>1 0 0 1</color></diffuse></lambert></technique></profile_COMMON></effect>
</library_effects>
<library_materials><material id="m"><instance_effect url="#e"/></material></library_materials>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="pa" count="24">)"
      << points.str() << R"(</float_array>
<technique_common><accessor source="#pa" count="8" stride="3"><param name="X" type="float"/>
<param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="12" material="s"><input semantic="VERTEX" source="#v" offset="0"/><p>)"
      << indices.str() << R"(</p></triangles></mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s1"><node><instance_geometry url="#g"><bind_material>
<technique_common><instance_material symbol="s" target="#m"/></technique_common></bind_material>
</instance_geometry></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s1"/></scene></COLLADA>)";
  return out.str();
}

/// Its buffer lies in a file of its own.
inline std::string cubeGltf(const std::string& buffer) {
  return R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
"meshes":[{"primitives":[{"attributes":{"POSITION":1},"indices":0,"material":0}]}],
"materials":[{"pbrMetallicRoughness":{"baseColorFactor":[0,0,1,0.5]},"alphaMode":"BLEND"}],
"buffers":[{"uri":")" +
         buffer + R"(","byteLength":168}],
"bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":72},
{"buffer":0,"byteOffset":72,"byteLength":96}],
"accessors":[{"bufferView":0,"componentType":5123,"count":36,"type":"SCALAR"},
{"bufferView":1,"componentType":5126,"count":8,"type":"VEC3","min":[-0.5,-0.5,-0.5],
"max":[0.5,0.5,0.5]}]})";
}

inline std::string cubeGltfBuffer() {
  std::string out;
  for (const auto& t : cubeTriangles()) {
    for (const int i : t) appendBytes(out, static_cast<std::uint16_t>(i));
  }
  for (const auto& p : cubeCorners()) {
    for (const float x : p) appendBytes(out, x);
  }
  return out;
}

}  // namespace afterglow::test
