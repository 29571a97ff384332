/// \file
/// A verb as a ROS node: under a name that no other node takes, and without a log topic.
#pragma once

#include <Eigen/Geometry>
#include <string>
#include <utility>
#include <vector>

namespace afterglow::nodes {

/// Names this process as a node, which asks the master nothing yet. Without ROS_MASTER_URI the
/// master is http://localhost:11311. Throws std::runtime_error, one line, if that is no URI:
/// roscpp would end the process.
void nameVerbNode(const std::string& name);

/// The same, and throws if no master answers, for which roscpp would wait forever.
void startVerbNode(const std::string& name);

/// Prints roscpp's own words only from the level of warnings on from now on.
void printWarningsOnly();

/// The newest T_target_source that tf knows, waiting for it at most so long. Throws
/// std::runtime_error, one line: no master, or which frames tf has no transform between.
Eigen::Isometry3d askTransform(const std::string& target, const std::string& source,
                               double patience_s);

/// The same of several (target, source); the robot should stand still.
std::vector<Eigen::Isometry3d> askTransforms(
    const std::vector<std::pair<std::string, std::string>>& questions, double patience_s);

}  // namespace afterglow::nodes
