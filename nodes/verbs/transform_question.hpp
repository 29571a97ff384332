/// \file
/// Transforms, asked of a running robot by a program that is no node otherwise.
#pragma once

#include <Eigen/Geometry>
#include <string>
#include <utility>
#include <vector>

namespace afterglow::nodes {

/// The newest T_target_source that tf knows, waiting for it at most so long. Throws
/// std::runtime_error, one line: no master, or which frames tf has no transform between.
Eigen::Isometry3d askTransform(const std::string& target, const std::string& source,
                               double patience_s);

/// The same of several (target, source); the robot should stand still.
std::vector<Eigen::Isometry3d> askTransforms(
    const std::vector<std::pair<std::string, std::string>>& questions, double patience_s);

}  // namespace afterglow::nodes
