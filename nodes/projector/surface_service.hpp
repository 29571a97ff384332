/// \file
/// projector_node's ~find_surfaces (std_srvs/Trigger): finds the configured surfaces in the next
/// clouds and keeps them until it is called again.
#pragma once

#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <std_srvs/Trigger.h>
#include <tf2/buffer_core.h>

#include <functional>
#include <vector>

#include "nodes/projector/found_surfaces.hpp"

namespace afterglow::nodes {

/// Waits and searches in a thread of its own, which calls `take` with the finding of each surface.
/// Subscribes to clouds only while it searches. Buffer and configuration must outlive this.
class SurfaceService {
 public:
  using Take = std::function<void(std::size_t surface, const Finding& finding)>;

  SurfaceService(const std::vector<SurfaceConfig>& surfaces, const tf2::BufferCore& buffer,
                 Take take);
  ~SurfaceService();

 private:
  bool find(std_srvs::Trigger::Request& request, std_srvs::Trigger::Response& response);
  /// Takes the next cloud of each topic whose transform is known. Waits some seconds at most.
  void collect(SurfaceFinder& finder);

  const std::vector<SurfaceConfig>& surfaces_;
  const tf2::BufferCore& buffer_;
  Take take_;
  ros::CallbackQueue queue_;
  ros::NodeHandle own_{"~"};
  ros::ServiceServer server_;
  ros::AsyncSpinner spinner_{1, &queue_};
};

}  // namespace afterglow::nodes
