/// \file
/// What projector_node says: its picture, lens and state as ROS messages.
#pragma once

#include <diagnostic_msgs/DiagnosticArray.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>

#include <string>
#include <vector>

#include "calib/lens.hpp"
#include "nodes/projector/layer_state.hpp"
#include "render/scene/image.hpp"

namespace afterglow::nodes {

/// rgb8, without padding; the header is the caller's.
sensor_msgs::Image toImage(render::Image image);

/// plumb_bob, or rational_polynomial where the lens needs its eight; R is the identity and P has K.
sensor_msgs::CameraInfo toCameraInfo(const calib::Lens& lens);

/// What there is to say about one projector.
struct OutputState {
  std::string name;                   ///< among several; empty: the only one
  std::string renderer;               ///< OpenGL version and device, and who draws
  std::vector<std::string> problems;  ///< of the last picture
};

/// What there is to say about the node and its projectors.
struct ProjectorState {
  std::string name;     ///< of the node
  double drawn_hz = 0;  ///< pictures in the last second
  double wanted_hz = 0;
  std::uint64_t late = 0;  ///< pictures that took longer than their time, ever
  std::vector<OutputState> outputs;
  std::vector<LayerStatus> layers;
};

/// One status a projector (error while it is dark for want of something, warning while a
/// layer lacks something) and one a layer (warning once something was dropped), with all counts.
diagnostic_msgs::DiagnosticArray toDiagnostics(const ProjectorState& state);

}  // namespace afterglow::nodes
