#include <gtest/gtest.h>
#include <rosbag/bag.h>
#include <tf2_msgs/TFMessage.h>
#include <visualization_msgs/Marker.h>

#include "nodes/conversion/geometry_conversion.hpp"
#include "nodes/projector/recorded_scene.hpp"
#include "replay/bags/bag_file.hpp"
#include "replay/store/open/open_store.hpp"
#include "tests/support/table_cloud.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::nodes::recorded_surface_test {
namespace {

/// A table is found in the first cloud that can be placed, and is there from the beginning.
TEST(RecordedSurface, isFoundInTheRecordingsFirstCloudThatCanBePlaced) {
  const test::TableCloud cloud;
  const test::TempFolder folder;
  const std::string path = folder.path("table.bag");
  {
    rosbag::Bag bag(path, rosbag::bagmode::Write);
    visualization_msgs::Marker marker;
    marker.header.frame_id = "map";
    marker.pose.orientation.w = marker.scale.x = marker.scale.y = marker.scale.z = 1;
    marker.color.a = 1;
    bag.write("/marker", ros::Time(1000), marker);
    const auto stamped = [&](double seconds, double lifted) {
      auto message = cloud.message("camera", lifted);
      message.header.stamp = ros::Time(seconds);
      return message;
    };
    bag.write("/depth", ros::Time(1001), stamped(1001, 0.2));  // before any transform
    for (const double seconds : {1002.0, 1004.0}) {
      tf2_msgs::TFMessage transforms;
      transforms.transforms.resize(1);
      transforms.transforms[0].header.frame_id = "map";
      transforms.transforms[0].header.stamp = ros::Time(seconds);
      transforms.transforms[0].child_frame_id = "camera";
      transforms.transforms[0].transform = toTransform(cloud.T_map_camera);
      bag.write("/tf", ros::Time(seconds), transforms);
      bag.write("/depth", ros::Time(seconds + 0.5), stamped(seconds + 0.5, seconds - 1002));
    }
    bag.close();
  }
  const auto store = replay::openMemoryStore();
  const replay::Behavior behavior = replay::importBag(path, *store).behavior;

  ProjectorConfig config;
  config.fixed_frame = "map";
  SurfaceConfig table;
  table.name = "table";
  table.frame = "map";
  table.search = SurfaceSearch{"/depth", 0.5, 1.0, {}, 0.17};
  config.surfaces = {table};
  config.layers.resize(1);
  config.layers[0].topic = "/marker";
  config.layers[0].placement = render::Placement::Drape;
  config.layers[0].surface = 0;
  RecordedScene scene(*store, behavior, config);
  const SceneSnapshot snapshot = scene.at(replay::Stamp{1'000'500'000'000});
  ASSERT_EQ(snapshot.scene.layers.size(), 1u) << snapshot.problems.front();
  EXPECT_EQ(snapshot.scene.layers[0].drawables.size(), 1u);
  EXPECT_NEAR((snapshot.scene.surfaces[0].T_world_surface * Eigen::Vector3d::Zero()).z(),
              test::TableCloud::kHeight, 0.003);
  // The transforms of the search are forgotten: the camera is unknown until it is due.
  EXPECT_FALSE(scene.transforms().canTransform("map", "camera", ros::Time()));
}

/// As in a film, which looks at every moment on its way.
TEST(RecordedScene, showsInAStillWhatWaitedForATransformLongAgo) {
  const test::TempFolder folder;
  const std::string path = folder.path("long.bag");
  {
    rosbag::Bag bag(path, rosbag::bagmode::Write);
    visualization_msgs::Marker marker;
    marker.header.frame_id = "arm";
    marker.header.stamp = ros::Time(1000);
    marker.pose.orientation.w = marker.scale.x = marker.scale.y = marker.scale.z = 1;
    marker.color.a = 1;
    bag.write("/marker", ros::Time(1000), marker);
    for (int i = 0; i <= 300; ++i) {
      tf2_msgs::TFMessage transforms;
      transforms.transforms.resize(1);
      transforms.transforms[0].header.frame_id = "map";
      transforms.transforms[0].header.stamp = ros::Time(999.95 + 0.05 * i);
      transforms.transforms[0].child_frame_id = "arm";
      transforms.transforms[0].transform.rotation.w = 1;
      bag.write("/tf", ros::Time(1000.01 + 0.05 * i), transforms);
    }
    bag.close();
  }
  const auto store = replay::openMemoryStore();
  const replay::Behavior behavior = replay::importBag(path, *store).behavior;
  ProjectorConfig config;
  config.fixed_frame = "map";
  config.layers.resize(1);
  config.layers[0].topic = "/marker";
  RecordedScene scene(*store, behavior, config);
  const SceneSnapshot snapshot = scene.at(replay::Stamp{1'012'500'000'000});
  ASSERT_EQ(snapshot.scene.layers.size(), 1u);
  EXPECT_EQ(snapshot.scene.layers[0].drawables.size(), 1u);
}

}  // namespace
}  // namespace afterglow::nodes::recorded_surface_test
