// Which map a robot is localized on.
#include "nodes/recorder/world_snapshot.hpp"

#include <gtest/gtest.h>

namespace afterglow::nodes::map_identity_test {
namespace {

nav_msgs::OccupancyGrid room() {
  nav_msgs::OccupancyGrid map;
  map.info.resolution = 0.05F;
  map.info.width = 3;
  map.info.height = 1;
  map.info.origin.orientation.w = 1;
  map.data = {0, 100, -1};
  return map;
}

TEST(MapIdentity, isTheSameWheneverTheMapWasLoadedOrSent) {
  nav_msgs::OccupancyGrid again = room();
  again.header.seq = 7;
  again.header.stamp = ros::Time(5);
  again.info.map_load_time = ros::Time(4);
  EXPECT_EQ(mapIdentity(again), mapIdentity(room()));
}

TEST(MapIdentity, isAnotherOfAnotherRoomOriginOrScale) {
  nav_msgs::OccupancyGrid room_2 = room(), origin = room(), scale = room();
  room_2.data[1] = 0;
  origin.info.origin.position.x = 1;
  scale.info.resolution = 0.1F;
  for (const nav_msgs::OccupancyGrid& map : {room_2, origin, scale}) {
    EXPECT_NE(mapIdentity(map), mapIdentity(room()));
  }
}

}  // namespace
}  // namespace afterglow::nodes::map_identity_test
