/// \file
/// The calibrator's pictures in a window, if it has one.
#pragma once

#include "nodes/calibrator/calibrator_node.hpp"

namespace afterglow::nodes {

/// Shows the node's picture, mirrored if the options say so, until a stop is requested; then stops
/// the node: the window's last picture is black. Main thread only. Throws std::runtime_error if a
/// window is demanded and there can be none.
void showUntilStopped(CalibratorNode& node, const CalibratorOptions& options);

}  // namespace afterglow::nodes
