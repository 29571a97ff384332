/// \file
/// The projector's picture that makes tags of light fall on given places.
///
/// Printed tags and tags of light on a floor or table, as a photograph shows them.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calib/detection/observe.hpp"
#include "calib/frames.hpp"
#include "calib/landing.hpp"
#include "calib/lens.hpp"
#include "calib/picture.hpp"
#include "calib/solver/calibration.hpp"
#include "calib/verify/tag_layout.hpp"

namespace afterglow::calib {

struct SurfacePose {
  Rigid<Camera, Surface> T_camera_surface;
  std::vector<SeenTag> tags;  ///< the printed ones it was found from
  double rms_px = 0;          ///< error of their corners
};

/// Locates the surface by the printed tags. Throws std::runtime_error saying what to do if fewer
/// than two are seen, if they contradict the layout by more than 2 px (naming the worst),
/// std::invalid_argument if the picture is not of the camera's size.
SurfacePose locateSurface(const Picture& photograph, const TagLayout& layout, const Lens& camera);

struct TargetCheck {
  int id = 0;
  bool is_seen = false;
  std::vector<LandingError> errors;             ///< errors of its four corners
  Eigen::Vector2d offset_mm{0, 0};              ///< offset of its middle, x and y
  std::array<Eigen::Vector2d, 4> wanted_px{};   ///< corners in the photograph
  std::array<Eigen::Vector2d, 4> corners_px{};  ///< corners as seen
};

struct ThrowCheck {
  SurfacePose surface;
  std::vector<TargetCheck> targets;

  std::vector<LandingError> errors() const;  ///< errors of all targets that are seen
};

/// `thrown`: the photograph with the targets' light; `plain`: the same from the same place without
/// (or with plain) light, so that a patterned floor does not disturb. Throws as locateSurface does,
/// and if the camera has moved between the two.
ThrowCheck checkThrow(const Picture& thrown, const std::optional<Picture>& plain,
                      const TagLayout& layout, const Lens& camera);

/// White, with the layout's targets in it; a pixel on an edge is as gray as its share of the tag in
/// linear light (gamma 2.2). Throws std::runtime_error naming the target that does not fall wholly
/// into the projector's picture, or whose cells would be too small in it.
Picture drawThrow(const TagLayout& layout, const Lens& projector,
                  const Rigid<Projector, Surface>& T_projector_surface);

/// Throws std::runtime_error naming a target that the camera would not see wholly, or too small to
/// be read.
void requireVisible(const TagLayout& layout, const Lens& camera,
                    const Rigid<Camera, Surface>& T_camera_surface);

/// A PNG: the photograph with each target where it should be (green) and where it is (red), and an
/// arrow from one to the other, ten times as long. Throws std::runtime_error naming the file if it
/// cannot be written.
void saveErrorPicture(const std::string& path, const Picture& photograph, const ThrowCheck& check);

}  // namespace afterglow::calib
