/// \file
/// The looks of a projector's colors on a surface that is not even, cell by cell, in the surface's
/// own frame: where the projector goes, they stay.
///
/// Sources: Grossberg, Peri, Nayar, Belhumeur, "Making one object look like another: controlling
/// appearance using a projector-camera system", CVPR 2004 (3 x 3 color mixing, ambient light);
/// Fujii, Grossberg, Nayar, "A projector-camera system with real-time photometric adaptation for
/// dynamic environments", CVPR 2005 (reflectance apart from the projector's light).
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <vector>

#include "calib/color/color.hpp"
#include "calib/lens.hpp"

namespace afterglow::calib {

/// seen = dark + density / (the texture's density) * M_seen_light * (response of red, green, blue)
struct TextureCell {
  Eigen::Matrix3f M_seen_light = Eigen::Matrix3f::Zero();  ///< zero: the cell was not photographed
  Eigen::Vector3f dark = Eigen::Vector3f::Zero();          ///< the room's light

  bool isKnown() const { return M_seen_light.cwiseAbs().maxCoeff() > 0; }
};

struct SurfaceTexture {
  std::string surface;  ///< its name in the projector's configuration
  /// The projector's curves, and the mean of what was photographed.
  ColorResponse color;
  Eigen::Vector2d origin{0, 0};    ///< corner of least x and y, meters, in the surface's frame
  double cell = 0;                 ///< side of a cell, meters
  int columns = 0, rows = 0;       ///< cells along x and y
  double density = 0;              ///< the light of M_seen_light: lightDensity(), 1 / m^2
  std::vector<TextureCell> cells;  ///< row by row from the least y

  const TextureCell& at(int column, int row) const {
    return cells[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
                 static_cast<std::size_t>(column)];
  }
  /// Returns a cell that looks as all known ones do in the mean.
  TextureCell mean() const;
};

/// More cells are a mistake, or memory that is not there.
constexpr int kMostTextureCells = 4'000'000, kMostTextureSide = 16'384;

/// Returns the share of the light of an evenly white picture that a square meter of a surface gets:
/// every pixel sends as much, so this is the inverse of the area that the picture's pixels light,
/// and has the inverse square of the distance and the angle of the ray in it. 1 / m^2; 0 behind the
/// lens. Point and unit normal of the surface in the projector's optical frame.
double lightDensity(const Lens& projector, const Eigen::Vector3d& p_optical,
                    const Eigen::Vector3d& n_optical);

/// A picture's white is the same all over the surface: so bright that all but this share of what
/// the projector lights can show it.
constexpr double kTooDark = 0.02;
/// Returns that white, from the brightest grays of places that are spread over the light; 0 for
/// none.
double evenWhite(std::vector<double> brightest_grays);

/// Writes FOLDER/SURFACE_texture.yaml and the picture that it names, SURFACE_texture.png, of 16
/// bits: dark, red, green and blue from top to bottom, each as the surface is seen from above, x to
/// the right and y up. Returns the path of the former. Throws std::runtime_error naming what cannot
/// be written, std::invalid_argument for a surface whose name is no file's.
std::string saveTexture(const std::string& folder, const SurfaceTexture& texture);
/// Throws std::runtime_error "FILE:LINE: what is wrong", or naming the picture.
SurfaceTexture loadTexture(const std::string& path);

}  // namespace afterglow::calib
