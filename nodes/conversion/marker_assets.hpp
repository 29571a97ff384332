/// \file
/// Letters and meshes for markers.
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

/// Opens the font with the first text. One thread at a time, except for meshes().
class MarkerAssets {
 public:
  static constexpr std::size_t kMostLetters = 4096;  ///< limit of one text; more is refused

  /// `mesh_roots`: as MeshLibrary's.
  explicit MarkerAssets(std::vector<std::string> mesh_roots = {})
      : meshes_(std::move(mesh_roots)) {}

  /// UTF-8; other bytes become replacement characters. Refused: more than kMostLetters, and any
  /// text on a machine without a font. Equal texts share their letters while they are shown.
  /// Remark: characters that no font has, and the package that has most of them.
  Converted<render::SharedBody> text(const std::string& text, double capital_height);
  MeshLibrary& meshes() { return meshes_; }

 private:
  void forgetUnseen();

  std::unique_ptr<render::Typeface> typeface_;
  struct Known {
    std::weak_ptr<const render::Body> letters;
    std::string remark;
  };
  std::map<std::pair<std::string, double>, Known> texts_;
  std::size_t sweep_at_ = 64;  ///< number of texts at which those not shown any more are forgotten
  MeshLibrary meshes_;
};

}  // namespace afterglow::nodes
