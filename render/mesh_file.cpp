#include "render/mesh_file.hpp"

#include <assimp/DefaultIOSystem.h>
#include <assimp/config.h>
#include <assimp/material.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <cctype>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <new>
#include <stdexcept>
#include <vector>

#include "render/scene/closed_body.hpp"

namespace afterglow::render {
namespace {

namespace fs = std::filesystem;

constexpr float kFarthest = 1e6f;            // meters
constexpr std::size_t kMostNodes = 100'000;  // of a file's tree

std::string inMebibytes(std::uintmax_t bytes) { return std::to_string(bytes >> 20) + " MiB"; }

/// Returns why a file may not be opened, or empty.
std::string fileFault(const fs::path& path, const fs::path& root, std::uintmax_t most_bytes) {
  std::error_code error;
  const fs::path real = fs::weakly_canonical(path, error), real_root = fs::canonical(root, error);
  if (error) return "no such file";
  const auto ends = std::mismatch(real_root.begin(), real_root.end(), real.begin(), real.end());
  if (ends.first != real_root.end()) return "outside the folders meshes may come from";
  if (!fs::is_regular_file(real, error)) return "no such file";
  if (fs::file_size(real, error) > most_bytes) return "larger than " + inMebibytes(most_bytes);
  return {};
}

/// Files a mesh names are as untrusted as the mesh.
class RootedFiles : public Assimp::DefaultIOSystem {
 public:
  RootedFiles(fs::path root, std::uintmax_t most_bytes)
      : root_(std::move(root)), most_bytes_(most_bytes) {}
  bool Exists(const char* file) const override { return isAllowed(file); }
  Assimp::IOStream* Open(const char* file, const char* mode) override {
    if (std::strchr(mode, 'w') != nullptr || !isAllowed(file)) return nullptr;
    return DefaultIOSystem::Open(file, mode);
  }

 private:
  bool isAllowed(const char* file) const { return fileFault(file, root_, most_bytes_).empty(); }
  fs::path root_;
  std::uintmax_t most_bytes_;
};

std::string extensionOf(const fs::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

/// assimp takes a binary STL's word for how many triangles follow; short ones are refused here.
void requireWholeStl(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  char head[84] = {};
  if (!file.read(head, sizeof head)) return;  // text, or assimp's to refuse
  if (std::strncmp(head, "solid", 5) == 0) return;
  std::uint32_t count = 0;
  std::memcpy(&count, head + 80, sizeof count);  // little-endian, as this machine
  const std::uintmax_t needed = 84 + std::uintmax_t{50} * count;
  if (fs::file_size(path) < needed) {
    throw std::runtime_error("malformed: shorter than its number of triangles says");
  }
}

/// assimp 5.2 reads a Collada index list for ever that holds anything but numbers.
void requireIndexLists(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  const std::string text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  for (const std::string name : {"p", "v", "h", "vcount"}) {
    const std::string opening = "<" + name;
    for (std::size_t at = text.find(opening); at != std::string::npos;
         at = text.find(opening, at + 1)) {
      const char next = at + opening.size() < text.size() ? text[at + opening.size()] : '>';
      if (next != '>' && std::isspace(static_cast<unsigned char>(next)) == 0) continue;
      const std::size_t begin = text.find('>', at);
      if (begin == std::string::npos) throw std::runtime_error("malformed: an open tag");
      const std::size_t end = std::min(text.find('<', begin), text.size());
      if (text.find_first_not_of("0123456789 \t\r\n", begin + 1) < end) {
        throw std::runtime_error("malformed: an index list holds more than numbers");
      }
    }
  }
}

std::string oneLine(std::string text) {
  text = text.substr(0, std::min<std::size_t>(text.find('\n'), 120));
  for (char& c : text) {
    if (std::isprint(static_cast<unsigned char>(c)) == 0) c = '?';
  }
  return text;
}

Color colorOf(const aiMaterial& material) {
  aiColor4D diffuse(1, 1, 1, 1);
  float opacity = 1;
  aiGetMaterialColor(&material, AI_MATKEY_COLOR_DIFFUSE, &diffuse);
  const bool has_opacity = material.Get(AI_MATKEY_OPACITY, opacity) == aiReturn_SUCCESS;
  const auto clamp = [](float c) { return std::isfinite(c) ? std::clamp(c, 0.f, 1.f) : 1.f; };
  return {clamp(diffuse.r), clamp(diffuse.g), clamp(diffuse.b),
          clamp(has_opacity ? opacity : diffuse.a)};
}

/// The tree's meshes, each moved to its place.
class BodyBuilder {
 public:
  BodyBuilder(const aiScene& scene, std::size_t most_triangles)
      : scene_(scene), most_triangles_(most_triangles) {}

  Body build() {
    struct Pending {
      const aiNode* node;
      aiMatrix4x4 T_file_parent;
    };
    std::vector<Pending> pending = {{scene_.mRootNode, aiMatrix4x4()}};
    for (std::size_t nodes = 0; !pending.empty(); ++nodes) {
      if (nodes > kMostNodes) throw std::runtime_error("more parts than are read");
      const Pending next = pending.back();
      pending.pop_back();
      const aiMatrix4x4 T = next.T_file_parent * next.node->mTransformation;
      for (unsigned i = 0; i < next.node->mNumMeshes; ++i) {
        addMesh(*scene_.mMeshes[next.node->mMeshes[i]], T);
      }
      for (unsigned i = 0; i < next.node->mNumChildren; ++i) {
        pending.push_back({next.node->mChildren[i], T});
      }
    }
    if (body_.triangles.empty()) throw std::runtime_error("no triangles");
    findWhetherClosed(body_);
    return std::move(body_);
  }

 private:
  void addMesh(const aiMesh& mesh, const aiMatrix4x4& T) {
    if (body_.triangles.size() + mesh.mNumFaces > most_triangles_) {
      throw std::runtime_error("more than " + std::to_string(most_triangles_) + " triangles");
    }
    const auto first = static_cast<std::uint32_t>(body_.points.size());
    const Color color = mesh.mMaterialIndex < scene_.mNumMaterials
                            ? colorOf(*scene_.mMaterials[mesh.mMaterialIndex])
                            : Color{};
    for (unsigned i = 0; i < mesh.mNumVertices; ++i) {
      const aiVector3D p = T * mesh.mVertices[i];
      const Eigen::Vector3f point(p.x, p.y, p.z);
      if (!(point.array().abs() <= kFarthest).all()) {  // NaN, too
        throw std::runtime_error("a point is not finite or absurdly far");
      }
      body_.points.push_back(point);
      body_.colors.push_back(color);
    }
    for (unsigned i = 0; i < mesh.mNumFaces; ++i) {
      const aiFace& face = mesh.mFaces[i];
      if (face.mNumIndices != 3) continue;
      body_.triangles.push_back(
          {first + face.mIndices[0], first + face.mIndices[1], first + face.mIndices[2]});
    }
  }

  const aiScene& scene_;
  std::size_t most_triangles_;
  Body body_;
};

}  // namespace

Body loadMeshFile(const std::string& path, const std::string& root, const MeshFileLimits& limits) {
  const std::string extension = extensionOf(path);
  const char* const known[] = {".stl", ".dae", ".obj", ".gltf", ".glb"};
  if (std::find(std::begin(known), std::end(known), extension) == std::end(known)) {
    throw std::runtime_error("not one of .stl, .dae, .obj, .gltf, .glb");
  }
  const std::string fault = fileFault(path, root, limits.bytes);
  if (!fault.empty()) throw std::runtime_error(fault);
  if (extension == ".stl") requireWholeStl(path);
  if (extension == ".dae") requireIndexLists(path);

  Assimp::Importer importer;
  importer.SetIOHandler(new RootedFiles(root, limits.bytes));  // the importer's from here on
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, true);
  importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE,
                              aiPrimitiveType_POINT | aiPrimitiveType_LINE);
  // Without what flat color does not need, corners in one place become one.
  importer.SetPropertyInteger(AI_CONFIG_PP_RVC_FLAGS,
                              aiComponent_NORMALS | aiComponent_TANGENTS_AND_BITANGENTS |
                                  aiComponent_COLORS | aiComponent_TEXCOORDS |
                                  aiComponent_BONEWEIGHTS | aiComponent_ANIMATIONS |
                                  aiComponent_TEXTURES | aiComponent_LIGHTS | aiComponent_CAMERAS);
  const aiScene* scene = importer.ReadFile(
      path, aiProcess_RemoveComponent | aiProcess_Triangulate | aiProcess_SortByPType |
                aiProcess_JoinIdenticalVertices | aiProcess_ValidateDataStructure);
  if (scene == nullptr || scene->mRootNode == nullptr) {
    // assimp makes a text of it.
    const std::string error = importer.GetErrorString();
    if (error.find("bad_alloc") != std::string::npos) throw std::bad_alloc();
    throw std::runtime_error("malformed: " + oneLine(importer.GetErrorString()));
  }
  return BodyBuilder(*scene, limits.triangles).build();
}

}  // namespace afterglow::render
