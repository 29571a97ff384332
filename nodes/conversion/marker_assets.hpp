/// \file
/// What markers need besides their message: letters and meshes.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "nodes/conversion/mesh_library.hpp"
#include "render/scene/typeface.hpp"

namespace afterglow::nodes {

/// The font is opened when the first text comes. One thread at a time, but for meshes().
class MarkerAssets {
 public:
  static constexpr std::size_t kMostLetters = 4096;  ///< in one text; more is refused

  /// As MeshLibrary takes it.
  explicit MarkerAssets(std::vector<std::string> mesh_roots = {})
      : meshes_(std::move(mesh_roots)) {}

  /// UTF-8; bytes that are none become replacement characters. Refused: more than kMostLetters, and
  /// a machine without a font.
  Converted<render::SharedBody> text(const std::string& text, double capital_height);
  MeshLibrary& meshes() { return meshes_; }

 private:
  std::unique_ptr<render::Typeface> typeface_;
  MeshLibrary meshes_;
};

}  // namespace afterglow::nodes
