/// \file
/// The projector's picture that makes tags of light fall on given places.
#pragma once

#include <string>

#include "calib/frames.hpp"
#include "calib/lens.hpp"
#include "calib/picture.hpp"
#include "calib/solver/calibration.hpp"
#include "calib/verify/layout_reader.hpp"
#include "calib/verify/tag_layout.hpp"

namespace afterglow::calib {

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
