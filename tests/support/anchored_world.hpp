/// \file
/// Light that was recorded on a robot which has moved since, and is replayed today, anchored in the
/// world.
#pragma once

#include <gtest/gtest.h>
#include <visualization_msgs/Marker.h>

#include <memory>
#include <string>

#include "nodes/conversion/geometry_conversion.hpp"
#include "nodes/conversion/typed_message.hpp"
#include "nodes/player/world_anchor.hpp"
#include "nodes/projector/transform_listener.hpp"
#include "tests/support/player_world.hpp"
#include "tests/support/ros_bytes.hpp"

namespace afterglow::test {

/// A drive was recorded, with a laser and markers on the robot; it is replayed today.
struct AnchoredWorld : PlayerWorld {
  using Marker = visualization_msgs::Marker;

  static Eigen::Isometry3d planar(double x, double y, double degrees, double z = 0) {
    Eigen::Isometry3d T(Eigen::AngleAxisd(degrees / kDegreesPerRadian, Eigen::Vector3d::UnitZ()));
    T.translation() = Eigen::Vector3d(x, y, z);
    return T;
  }

  static geometry_msgs::TransformStamped stamped(const std::string& parent,
                                                 const std::string& child,
                                                 const Eigen::Isometry3d& T, Stamp stamp) {
    geometry_msgs::TransformStamped transform;
    transform.header.frame_id = parent;
    transform.header.stamp = nodes::toTime(stamp);
    transform.child_frame_id = child;
    transform.transform = nodes::toTransform(T);
    return transform;
  }

  static Stamp recordedAt(double ms) { return {kBegin + static_cast<std::int64_t>(ms * kMs)}; }

  /// Then: 1 m/s along a bent way.
  static Eigen::Isometry3d T_map_base(double ms) {
    return planar(1 + ms * 1e-3, 2 - ms * 2e-4, 30 + ms * 0.02);
  }

  void recordDrive(int from_ms = 0, int to_ms = 3000, const std::string& top = "map") {
    tf2_msgs::TFMessage fixed;
    fixed.transforms = {
        stamped("base_link", "laser", planar(0.2, 0, 5, 0.3), Stamp::fromParts(1, 0))};
    record(rosChannel<tf2_msgs::TFMessage>("/tf_static"), from_ms, rosBytes(fixed));
    for (int ms = from_ms; ms <= to_ms; ms += 20) {
      tf2_msgs::TFMessage moving;
      moving.transforms = {stamped(top, "odom", planar(0.5, 0, 10), recordedAt(ms)),
                           stamped("odom", "base_link",
                                   planar(0.5, 0, 10).inverse() * T_map_base(ms), recordedAt(ms))};
      record(rosChannel<tf2_msgs::TFMessage>("/tf"), ms, rosBytes(moving));
    }
    topics.clear();  // tf is the recording's, not the behavior's
  }

  static Marker disk(const std::string& frame, double x, double y, Stamp stamp) {
    Marker marker;
    marker.header.frame_id = frame;
    if (stamp.ns != 0) marker.header.stamp = nodes::toTime(stamp);
    marker.type = Marker::CYLINDER;
    marker.pose.position.x = x;
    marker.pose.position.y = y;
    marker.pose.orientation.w = 1;
    marker.scale.x = marker.scale.y = 0.06;
    marker.color.r = marker.color.g = marker.color.b = marker.color.a = 1;
    return marker;
  }
  void recordMarker(int ms, const Marker& marker) {
    record(rosChannel<Marker>("/marker"), ms, rosBytes(marker));
  }

  /// Plays; what is said of today's frames goes into `today`.
  PlayReport playAnchored(int length_ms, const AnchorSettings& settings = {}) {
    options.clear_projection = false;
    return play(length_ms, "", [&] {
      is_needed = nodes::WorldAnchor::refuseUnplaced(*store, plan, settings);
      anchor = std::make_unique<nodes::WorldAnchor>(
          *store, plan, settings, [this](const tf2_msgs::TFMessage& transforms) {
            for (const auto& transform : transforms.transforms) {
              EXPECT_TRUE(
                  nodes::storeTransform(today, transform, "player", false, ros::Time()).is_stored);
            }
          });
      options.anchor = anchor.get();
    });
  }

  template <typename MessageType>
  MessageType sent(const std::string& topic, std::size_t index = 0) {
    return *nodes::toMessage<MessageType>(sink.on(topic).at(index).bytes);
  }
  /// Where a header's frame is today, by the transforms of the player.
  Eigen::Isometry3d placed(const std_msgs::Header& header) {
    return nodes::toIsometry(today.lookupTransform("map", header.frame_id, header.stamp).transform);
  }
  static double distance(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
    return (a.matrix() - b.matrix()).cwiseAbs().maxCoeff();
  }

  tf2::BufferCore today;
  std::unique_ptr<nodes::WorldAnchor> anchor;
  bool is_needed = false;
};

}  // namespace afterglow::test
