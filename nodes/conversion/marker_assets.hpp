/// \file
/// What markers need besides their message: letters and meshes.
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <string>
#include <utility>
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
  /// a machine without a font. Equal texts share their letters while anyone shows them.
  Converted<render::SharedBody> text(const std::string& text, double capital_height);
  MeshLibrary& meshes() { return meshes_; }

 private:
  void forgetUnseen();

  std::unique_ptr<render::Typeface> typeface_;
  std::map<std::pair<std::string, double>, std::weak_ptr<const render::Body>> texts_;
  std::size_t sweep_at_ = 64;  ///< as many texts: those nobody shows are forgotten
  MeshLibrary meshes_;
};

}  // namespace afterglow::nodes
