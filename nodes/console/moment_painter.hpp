/// \file
/// A behavior's moments as JPEG pictures.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "calib/lens.hpp"
#include "nodes/console/picture_source.hpp"
#include "nodes/projector/projector_config.hpp"
#include "nodes/projector/recorded_scene.hpp"
#include "nodes/verbs/observed_pictures.hpp"
#include "render/compose/light_census.hpp"
#include "render/gl/gl_context.hpp"
#include "render/projector_renderer.hpp"
#include "replay/store/store.hpp"

namespace afterglow::nodes {

/// What is projected where, and from where a bystander looks.
struct PictureSettings {
  ProjectorConfig config;  ///< of one projector
  calib::Lens lens;        ///< of its camera_info
  ObserverOptions observer;
};

struct MomentPicture {
  render::Image image;
  std::vector<std::string> dark;  ///< what is not lit, and why (RecordedScene::whyDark)
};

/// The same lens as if its picture was so many pixels wide.
calib::Lens lensOfWidth(const calib::Lens& lens, int width);

/// As a file holds it.
std::string jpegOf(const render::Image& image);

/// Draws one behavior in one view and one width. A moment after the last one is reached by going
/// on, one before it by beginning again. The store has to outlive it; the thread of `context`.
class MomentPainter {
 public:
  /// Throws replay::StoreError, and std::runtime_error where it cannot be drawn.
  MomentPainter(render::GlContext& context, const replay::Store& store,
                const replay::Behavior& behavior, const PictureSettings& settings,
                PictureView view, int width);

  /// At that many seconds, or at the behavior's begin or end where it has no such moment.
  MomentPicture at(double t);

  const replay::Behavior& behavior() const { return behavior_; }

 private:
  void restart();

  const replay::Store& store_;
  const replay::Behavior behavior_;
  const PictureSettings settings_;
  const int width_;
  const calib::Lens lens_;
  const replay::Stamp end_;
  const render::LightOutput light_;
  render::ProjectorRenderer renderer_;
  render::LightCensus census_;  ///< by the lens itself, however small the picture
  std::optional<RecordedScene> scene_;
  std::optional<ObservedPictures> observed_;
  replay::Stamp last_;
};

}  // namespace afterglow::nodes
