/// \file
/// PointCloud2 messages for tests, in a line.
#pragma once

#include <sensor_msgs/PointCloud2.h>

#include <Eigen/Core>
#include <cstring>
#include <string>
#include <vector>

namespace afterglow::test {

/// x, y, z as FLOAT32 at offsets 0, 4, 8; `point_step` - 12 bytes of zeros follow in each point.
inline sensor_msgs::PointCloud2 cloudMessage(const std::string& frame,
                                             const std::vector<Eigen::Vector3f>& points,
                                             std::uint32_t point_step = 12) {
  sensor_msgs::PointCloud2 message;
  message.header.frame_id = frame;
  message.height = 1;
  message.width = static_cast<std::uint32_t>(points.size());
  message.point_step = point_step;
  message.row_step = point_step * message.width;
  message.data.resize(message.row_step);
  for (std::size_t i = 0; i < points.size(); ++i) {
    std::memcpy(message.data.data() + i * point_step, points[i].data(), 12);
  }
  for (const char* name : {"x", "y", "z"}) {
    sensor_msgs::PointField field;
    field.name = name;
    field.offset = static_cast<std::uint32_t>(4 * message.fields.size());
    field.datatype = sensor_msgs::PointField::FLOAT32;
    field.count = 1;
    message.fields.push_back(field);
  }
  return message;
}

}  // namespace afterglow::test
