/// \file
/// What a projector's light keeps off: what sensors see standing on the surfaces, and the robot's
/// own links, each where it will be when the light is there. It spares people the light in their
/// eyes; it is no safety function. Needs no ROS master.
#pragma once

#include <ros/time.h>
#include <tf2/buffer_core.h>

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "calib/frames.hpp"
#include "nodes/projector/avoid_config.hpp"
#include "nodes/projector/frame_lookup.hpp"
#include "nodes/projector/layer_state.hpp"
#include "nodes/projector/robot_surface.hpp"
#include "render/paint/dark_mask.hpp"
#include "render/scene/scene.hpp"

namespace afterglow::nodes {

/// Takes messages in the order of their arrival; `source` is the index in the configuration. When
/// ROS time runs backwards, call clear() first. Bad messages are counted and never throw. The
/// buffer must outlive this; one thread at a time.
class LightAvoidance {
 public:
  LightAvoidance(const AvoidConfig& config, const tf2::BufferCore& buffer,
                 const std::string& fixed_frame);

  const AvoidConfig& config() const { return config_; }
  /// Returns true while the configuration names a robot that is not known yet.
  bool needsRobot() const { return config_.robot && !robot_; }
  void setRobot(RobotSurface robot) { robot_ = std::move(robot); }
  /// Tells why the robot is not known.
  void refuseRobot(const std::string& reason) { robot_problem_ = reason; }

  template <typename MessageType>
  void add(std::size_t source, const MessageType& message, ros::Time now) {
    take(sources_[source], message.header, toContent(message, config_.sources[source].layer), now);
  }
  void add(std::size_t source, const sensor_msgs::PointCloud2& message, ros::Time now) {
    take(sources_[source], message.header,
         toContent(message, config_.sources[source].layer, &workers_), now);
  }

  /// Places what has come, over the surfaces as they lie now.
  void update(ros::Time now, const std::vector<render::SurfacePatch>& surfaces);
  /// Returns what the light of a projector in this pose keeps off at `light_ns`, as of the last
  /// update(). What sensors see may have moved since they saw it, any way: its padding grows by the
  /// configured speed; what they see of the robot itself is not counted. Links are moved on as they
  /// moved lately, against the projector. Empty, with a problem that says what to do, while a
  /// sensor, the robot's description or a link's transform is missing or old: nobody knows then
  /// what the light would hit.
  std::optional<std::vector<render::AvoidedPoints>> points(
      const std::string& projector_frame, const Rigid<Projector, World>& T_projector_world,
      std::int64_t light_ns, std::vector<std::string>& problems);

  /// Returns true while a message waits for a transform, which may come at any time.
  bool isWaiting() const;
  /// Forgets all messages, because time has jumped.
  void clear();
  std::vector<LayerStatus> status() const;

 private:
  struct Source {
    LayerState state;
    std::string last_fault;
    std::optional<ros::Time> seen_at;  ///< stamp of the message whose points follow
    render::AvoidedPoints standing;    ///< with the configured padding
    double column = 0;                 ///< AvoidSource::column
  };
  void take(Source& source, const std_msgs::Header& header, Converted<Content> content,
            ros::Time now);
  std::string faultOf(const Source& source, const std_msgs::Header& header,
                      const Converted<Content>& content, ros::Time now) const;
  void place(std::size_t index, bool have_surfaces_changed);
  /// Returns the links where they were at a stamp, of those that tf still knows then.
  std::vector<render::AvoidedPoints> linksAt(ros::Time stamp);
  std::string problemOf(Source& source);
  std::string addLinks(const std::string& projector_frame,
                       const Rigid<World, Projector>& T_world_projector, std::int64_t light_ns,
                       std::vector<render::AvoidedPoints>& points);
  bool isOld(std::int64_t stamp_ns) const { return now_ns_ - stamp_ns > config_.patience_ns; }

  AvoidConfig config_;
  const tf2::BufferCore& buffer_;
  FrameLookup frames_;
  std::vector<Source> sources_;
  std::vector<render::SurfacePatch> surfaces_;
  std::int64_t now_ns_ = 0;
  std::optional<RobotSurface> robot_;
  std::string robot_problem_ = "the robot's description has not been read yet";
  std::map<std::string, FrameLookup> seen_from_;  ///< by the projector's frame
  render::Workers workers_;
};

}  // namespace afterglow::nodes
