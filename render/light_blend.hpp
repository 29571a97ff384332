/// \file
/// Several projectors that light the same place: the share of the light that each of their pixels
/// gives, by the calibrated geometry. GL-free.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include "calib/frames.hpp"
#include "calib/lens.hpp"
#include "render/light_output.hpp"
#include "render/scene/scene.hpp"

namespace afterglow::render {

/// A projector among several.
struct BlendedProjector {
  calib::Lens lens;
  /// Luminous flux of its full light, lumens, the same from each pixel; 0: unknown.
  double lumens = 0;
  /// Share of its full light that white gets (LightSettings::max_brightness, and its colors).
  double white = 1;
  double black = 0;  ///< share of its full light that leaves the lens where it shows black
};

/// Finds for each pixel the place that it lights on the surfaces, and shares that place's light
/// among the projectors that reach it, by their distances to the edges of their images and to the
/// shadows on the surface, so that the shares add up to one and change smoothly. A pixel that
/// reaches no surface has its full light.
///
/// If all fluxes are known, all places are evened to the light of the darkest place that several
/// projectors reach, or to kLeastEvened of the brightest such place; places that are darker
/// anyway stay so. One thread at a time.
class LightBlend {
 public:
  static constexpr double kLeastEvened = 0.25;
  /// At most so many projectors.
  static constexpr std::size_t kMost = 32;

  /// `evens_black`: where fewer projectors reach a place than elsewhere, black is raised to the
  /// greatest sum of the projectors' blacks that falls on any place. Throws std::logic_error for
  /// more than kMost.
  LightBlend(std::vector<BlendedProjector> projectors, bool evens_black);
  ~LightBlend();

  /// Takes the surfaces and the projectors' poses; a projector without one is dark, and the others
  /// give its light. Nothing is done where nothing has changed.
  void update(const std::vector<SurfacePatch>& surfaces,
              const std::vector<std::optional<Rigid<Projector, World>>>& poses);

  /// Returns the light of a projector's pixels as of the last update().
  const PixelLight& light(std::size_t projector) const;

  struct Summary {
    double shared = 0;  ///< share of its picture that others light, too
    double dimmed = 1;  ///< least factor by which its light is evened
    double raised = 0;  ///< greatest share of its full light that raises black
  };
  Summary summary(std::size_t projector) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace afterglow::render
