/// \file
/// Mesh files (STL, DAE, OBJ, glTF, GLB; assimp) as the scene's triangles.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "render/scene/scene.hpp"

namespace afterglow::render {

struct MeshFileLimits {
  std::uintmax_t bytes = std::uintmax_t{64} << 20;  ///< limit of each file
  std::size_t triangles = 1'000'000;                ///< once every part is in its place
};

/// All parts in their places, in the file's axes, as RViz has it: a Collada file's unit is applied
/// and its up axis is not. Colors: each part's diffuse (base) color and opacity; no textures, no
/// vertex colors, no shading.
///
/// `root` is an existing folder: the file and every file that it names (materials, buffers) lie in
/// it, links followed. Throws std::runtime_error with one line of why, without the path: a kind
/// that is not read, no such file, outside the root, too large, malformed, no triangles. Safe from
/// several threads.
Body loadMeshFile(const std::string& path, const std::string& root,
                  const MeshFileLimits& limits = {});

}  // namespace afterglow::render
