#include "nodes/conversion/map_identity.hpp"

#include <ros/serialization.h>

#include "replay/store/checksum.hpp"

namespace afterglow::nodes {

std::string mapIdentity(const nav_msgs::OccupancyGrid& map) {
  nav_msgs::MapMetaData info = map.info;
  info.map_load_time = ros::Time();
  replay::Bytes bytes(ros::serialization::serializationLength(info));
  ros::serialization::OStream stream(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
  ros::serialization::serialize(stream, info);
  bytes.insert(bytes.end(), map.data.begin(), map.data.end());
  return replay::sha256(bytes);
}

}  // namespace afterglow::nodes
