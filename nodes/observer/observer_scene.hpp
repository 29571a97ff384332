/// \file
/// The room at one moment, from messages and transforms: what is to be drawn for a bystander. No
/// ROS master is involved.
#pragma once

#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <std_msgs/Header.h>
#include <tf2/buffer_core.h>
#include <visualization_msgs/MarkerArray.h>

#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "nodes/fetch/robot_model.hpp"
#include "nodes/observer/room_view.hpp"
#include "nodes/projector/projector_scene.hpp"
#include "render/light_output.hpp"

namespace afterglow::nodes {

/// Feeds on messages in the order of their arrival; `now` is ROS time. Bad messages are counted
/// (status()), never thrown. The buffer must outlive this; one thread at a time.
class ObserverScene {
 public:
  ObserverScene(RoomView room, const tf2::BufferCore& buffer);

  void addSolids(const visualization_msgs::MarkerArray& solids, ros::Time now);
  void setRobot(RobotModel robot) { robot_ = std::move(robot); }
  bool hasRobot() const { return robot_.has_value(); }
  void setLens(const sensor_msgs::CameraInfo& info);
  /// The projector's image, rgb8.
  void addImage(const sensor_msgs::Image& image);

  /// Something stands in the room besides floor and walls.
  bool isFurnished();
  /// Floor, walls, solids, and the robot's links where tf has them now.
  std::vector<render::Drawable> solids(ros::Time now);
  /// The newest image that tf has the projector's pose for, thrown from there; nullptr: no light,
  /// as after two seconds without a image. Valid until the next call of anything here.
  const render::ProjectedLight* light(ros::Time now);
  /// The projector's newest image, light or not; nullptr: none yet.
  const render::Image* projectorImage() const { return newest_image_.get(); }

  /// Of the solids; its `dropped` also tells of bad images and lenses.
  LayerStatus status() const;

 private:
  struct ProjectedImage {
    std_msgs::Header header;
    std::shared_ptr<const render::Image> image;
  };

  void throwLight(const ProjectedImage& projected, const Eigen::Isometry3d& T_world_projector);
  void drop(const std::string& reason) { solids_.drop(0, reason); }

  RoomView room_;
  FrameLookup frames_;
  ProjectorScene solids_;
  std::optional<RobotModel> robot_;
  std::optional<calib::Lens> lens_;
  render::LightOutput mirror_{{}};  ///< that the projector is seen by
  std::deque<ProjectedImage> waiting_;  ///< for the projector's pose, oldest first
  std::shared_ptr<const render::Image> newest_image_;
  render::ProjectedLight light_;
  std::int64_t light_ns_ = 0;  ///< the image's stamp; 0: none
};

}  // namespace afterglow::nodes
