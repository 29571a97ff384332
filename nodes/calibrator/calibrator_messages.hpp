/// \file
/// What calibrator_node says about itself and its result, as messages.
#pragma once

#include <diagnostic_msgs/DiagnosticArray.h>
#include <geometry_msgs/TransformStamped.h>
#include <sensor_msgs/CameraInfo.h>

#include <optional>
#include <string>

#include "calib/frames.hpp"
#include "calib/lens.hpp"

namespace afterglow::nodes {

struct CalibratorState {
  std::string phase;    ///< waiting (for camera or camera_info), or calib::phaseName
  std::string problem;  ///< of the camera; empty: none
  std::string doing;    ///< while solving
  int views = 0, views_wanted = 0, discarded = 0;
  double coverage = 0;  ///< 0 to 1
  std::optional<double> held_out_mm, check_mm;
};

/// Keys as the members; held_out_mm and check_mm only when known.
std::string toJson(const CalibratorState& state);

/// One status: a warning while the camera has a problem.
diagnostic_msgs::DiagnosticArray toDiagnostics(const CalibratorState& state,
                                               const std::string& node);

/// Stamped now.
geometry_msgs::TransformStamped toTransform(const Rigid<Camera, Projector>& T_camera_projector,
                                            const std::string& camera_frame,
                                            const std::string& projector_frame);

}  // namespace afterglow::nodes
