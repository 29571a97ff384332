/// \file
/// Mesh files read by a program of their own (mesh_reader_main.cpp): assimp can be crashed by what
/// it reads, and a projector goes on.
#pragma once

#include <string>

#include "render/mesh_file.hpp"
#include "render/scene/scene.hpp"

namespace afterglow::nodes {

/// As render::loadMeshFile. Starts afterglow_mesh_reader, which lies beside the running program,
/// and waits for it: a minute at most. Throws std::runtime_error also where the file crashes it,
/// takes it too much time or memory, or where it cannot be started. Safe from several threads.
render::Body readMeshFile(const std::string& path, const std::string& root,
                          const render::MeshFileLimits& limits = {});

}  // namespace afterglow::nodes
