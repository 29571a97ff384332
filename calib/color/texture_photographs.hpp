/// \file
/// A surface's texture from the photographs of colors that readColorPhotographs takes.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <string>
#include <vector>

#include "calib/color/color.hpp"
#include "calib/color/texture.hpp"
#include "calib/frames.hpp"
#include "calib/lens.hpp"

namespace afterglow::calib {

/// The lenses, and where they were while the colors were photographed.
struct TextureView {
  Lens camera, projector;
  Rigid<Camera, Surface> T_camera_surface;
  Rigid<Projector, Surface> T_projector_surface;
};

struct TextureOptions {
  std::string surface;                   ///< its name
  std::vector<Eigen::Vector2d> polygon;  ///< its outline, meters; empty: unbounded
  double cell = 0;  ///< m; 0: one and a half of the projector's pixels, or the camera's if larger
  /// A photograph, by the same lens and aperture, of something plain that is evenly lit: how much
  /// less light the camera sees toward its corners. Empty: it is taken for even.
  std::string flat;
};

struct TextureFit {
  SurfaceTexture texture;
  ColorFit color;          ///< ColorFit of the mean
  double known_share = 0;  ///< share of the light on the surface that fell on known cells
  /// CIEDE2000, white being the even one, between what cells should look like and what was seen, of
  /// mixed colors that the cells were not fitted to; NaN without any.
  double check_median = std::numeric_limits<double>::quiet_NaN(), check_p95 = check_median;
  int checks = 0;            ///< colors
  double white = 0;          ///< even white from where the projector was; camera's light
  double median_gray = 0;    ///< brightest gray that half of the cells reach
  double share_reached = 0;  ///< share of sRGB's cube, over all cells
};

/// Throws std::runtime_error as readColorPhotographs does, and naming what does not fit: pictures
/// of another size than the camera's, no cell that is seen and lit, more cells than a texture may
/// have; ColorRefused as fitColor does.
TextureFit fitTexture(const std::string& folder, const TextureView& view,
                      const TextureOptions& options);

}  // namespace afterglow::calib
