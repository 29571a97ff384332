/// \file
/// The robot's outside by its description: points on its links, for light to keep off.
#pragma once

#include <tf2/buffer_core.h>

#include <cstddef>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "nodes/fetch/robot_model.hpp"
#include "render/scene/scene.hpp"
#include "replay/messages/topic_name.hpp"

namespace afterglow::nodes {

/// A value: copy it freely; const members are safe from any thread.
class RobotSurface {
 public:
  /// Points are so dense, meters.
  static constexpr double kSpacing = 0.01;

  /// Links that do not move against each other.
  struct Part {
    std::string frame;            ///< its points' frame in tf, a link's
    std::set<std::string> links;  ///< frames of its links
    render::SharedList<Eigen::Vector3f> points;
  };

  /// Frames are called as `names` has them. A description without visible links has no part. Throws
  /// std::runtime_error naming a link that is not finite or too large.
  RobotSurface(const RobotModel& model, const replay::RobotNames& names);

  const std::vector<Part>& parts() const { return parts_; }
  /// Returns the index of the part that tf hangs a frame on, rigidly as far as the description
  /// tells: the projector's own housing, which no light avoids. Empty: the frame is not on the
  /// robot, or on a part that is not seen.
  std::optional<std::size_t> partOf(const std::string& frame, const tf2::BufferCore& buffer) const;

 private:
  std::vector<Part> parts_;
  std::set<std::string> links_;  ///< frames of all links
};

/// Reads the robot from its description on the parameter server, and its meshes, once; then waits
/// until tf knows its root. The buffer must outlive this; one thread at a time.
class RobotSurfaceReader {
 public:
  /// `description`: a parameter in this process's namespace or above it. `mesh_roots`: as
  /// MeshLibrary has them.
  RobotSurfaceReader(std::string description, std::vector<std::string> mesh_roots,
                     const tf2::BufferCore& buffer);

  /// Empty, with reason(): not now. Meshes may take seconds.
  std::optional<RobotSurface> read();
  const std::string& reason() const { return reason_; }

 private:
  void readModel(const std::string& xml);

  const std::string description_;
  const std::vector<std::string> mesh_roots_;
  const tf2::BufferCore& buffer_;
  std::string xml_;  ///< read last
  std::optional<RobotModel> model_;
  std::string reason_;
};

}  // namespace afterglow::nodes
