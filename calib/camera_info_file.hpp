/// \file
/// Reading camera_info files: the YAML of camera_calibration_parsers (camera_matrix, ...), or of
/// the message itself as `rostopic echo` prints it (K, D, ...).
#pragma once

#include <string>

#include "calib/lens.hpp"

namespace afterglow::calib {

struct CameraInfoFile {
  Lens lens;  ///< the lens by K and D; P, which only rectified images obey, is read for a warning
  std::string name;     ///< camera_name or header.frame_id; may be empty
  std::string warning;  ///< empty, or how K and P disagree
};

/// Distortion models: plumb_bob (4 or 5 numbers), rational_polynomial (8), equidistant (4), more
/// where they are 0 (usedDistortion); or none at all.
/// Throws std::runtime_error naming file, key, value and what was expected (all violations at
/// once).
CameraInfoFile loadCameraInfo(const std::string& path);

}  // namespace afterglow::calib
