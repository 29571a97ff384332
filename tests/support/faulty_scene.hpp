/// \file
/// A scene with one layer that gets faults and one that does not: whatever comes in on the first,
/// what else there is goes on being drawn.
#pragma once

#include <gtest/gtest.h>
#include <tf2/buffer_core.h>
#include <visualization_msgs/MarkerArray.h>

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "nodes/projector/projector_diagnostics.hpp"
#include "nodes/projector/projector_scene.hpp"
#include "render/scene/tessellate.hpp"

namespace afterglow::test {

class FaultyScene : public ::testing::Test {
 protected:
  using Marker = visualization_msgs::Marker;
  static constexpr std::size_t kMarkers = 0, kRest = 1;

  static ros::Time at(double seconds) { return ros::Time(1000 + seconds); }

  FaultyScene() { startAgain(); }

  void startAgain() {
    nodes::ProjectorConfig config;
    config.fixed_frame = "map";
    config.layers.resize(2);
    config.layers[kMarkers].topic = "/markers";
    config.layers[kMarkers].type = nodes::LayerType::MarkerArray;
    config.layers[kRest].topic = "/rest";
    config.layers[kRest].type = nodes::LayerType::Marker;
    scene_ = std::make_unique<nodes::ProjectorScene>(config, buffer_);
    scene_->add(kRest, cube(1), at(0));
    log_ = {};
  }

  static Marker marker(int type, int id = 7) {
    Marker m;
    m.header.frame_id = "map";
    m.id = id;
    m.type = type;
    m.pose.orientation.w = 1;
    m.scale.x = m.scale.y = m.scale.z = 0.1;
    m.color.g = m.color.a = 1;
    return m;
  }
  static Marker cube(int id, const std::string& frame = "map") {
    Marker m = marker(Marker::CUBE, id);
    m.header.frame_id = frame;
    return m;
  }
  static Marker withPoints(int type, int count) {
    Marker m = marker(type);
    for (int i = 0; i < count; ++i) {
      m.points.emplace_back();
      m.points.back().x = i;
      m.points.back().y = i * i;
    }
    return m;
  }

  void add(const std::vector<Marker>& markers, ros::Time now) {
    visualization_msgs::MarkerArray array;
    array.markers = markers;
    scene_->add(kMarkers, array, now);
  }

  /// What the faulty layer shows; the other one is checked on the way, and all triangles are.
  std::vector<render::Drawable> drawn(ros::Time now) {
    const nodes::SceneSnapshot snapshot = scene_->snapshot(now);
    EXPECT_EQ(snapshot.scene.layers.at(kRest).drawables.size(), 1u) << "the rest is gone";
    for (const render::Drawable& drawable : snapshot.scene.layers.at(kMarkers).drawables) {
      render::Tessellation shape;
      render::tessellate(drawable, {}, shape);
      for (const auto& p : shape.mesh.points) EXPECT_TRUE(p.allFinite());
    }
    return snapshot.scene.layers.at(kMarkers).drawables;
  }

  std::map<std::string, std::uint64_t> dropped() { return scene_->status().at(kMarkers).dropped; }
  std::map<std::string, std::uint64_t> remarks() { return scene_->status().at(kMarkers).remarks; }
  std::vector<std::string> logged(double seconds) {
    return log_.news({}, scene_->status(), static_cast<std::int64_t>(seconds * 1e9));
  }

  /// It is refused for this reason in the midst of an array: its neighbors are drawn; it is counted
  /// every time and spoken of once.
  void expectRefused(const Marker& bad, const std::string& reason) {
    SCOPED_TRACE(reason);
    startAgain();
    for (int i = 0; i < 3; ++i) add({cube(1), bad, cube(2)}, at(0));
    EXPECT_EQ(drawn(at(0)).size(), 2u);
    EXPECT_EQ(dropped(), (std::map<std::string, std::uint64_t>{{reason, 3}}));
    EXPECT_EQ(logged(0), std::vector<std::string>{"/markers: dropped: " + reason + " (3 times)"});
    add({cube(1), bad, cube(2)}, at(0));
    EXPECT_TRUE(logged(1).empty());
    EXPECT_EQ(logged(31), std::vector<std::string>{"/markers: dropped: " + reason});
  }

  /// It is drawn beside its neighbors; odd: with this remark, or none.
  render::Drawable expectDrawn(const Marker& odd, const std::string& remark = {}) {
    startAgain();
    add({cube(1), odd, cube(9)}, at(0));
    const auto drawables = drawn(at(0));
    EXPECT_EQ(drawables.size(), 3u);
    EXPECT_TRUE(dropped().empty());
    EXPECT_EQ(remarks().size(), remark.empty() ? 0u : 1u);
    EXPECT_TRUE(remark.empty() || remarks().count(remark) == 1) << remark;
    return drawables.size() == 3 ? drawables[1] : render::Drawable{};
  }

  void transform(const std::string& frame, double x, ros::Time stamp, bool is_static = false,
                 const std::string& parent = "map") {
    geometry_msgs::TransformStamped message;
    message.header.frame_id = parent;
    message.child_frame_id = frame;
    message.header.stamp = stamp;
    message.transform.translation.x = x;
    message.transform.rotation.w = 1;
    buffer_.setTransform(message, "test", is_static);
  }

  tf2::BufferCore buffer_;
  std::unique_ptr<nodes::ProjectorScene> scene_;
  nodes::FaultLog log_;
};

}  // namespace afterglow::test
