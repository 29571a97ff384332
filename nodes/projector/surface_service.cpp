#include "nodes/projector/surface_service.hpp"

#include <sensor_msgs/PointCloud2.h>

#include <map>
#include <string>
#include <utility>

namespace afterglow::nodes {
namespace {

const ros::WallDuration kPatience(5), kPause(0.02);

}  // namespace

SurfaceService::SurfaceService(const std::vector<SurfaceConfig>& surfaces,
                               const tf2::BufferCore& buffer, Take take)
    : surfaces_(surfaces), buffer_(buffer), take_(std::move(take)) {
  own_.setCallbackQueue(&queue_);
  server_ = own_.advertiseService("find_surfaces", &SurfaceService::find, this);
  spinner_.start();
}

SurfaceService::~SurfaceService() {
  server_.shutdown();
  spinner_.stop();
}

void SurfaceService::collect(SurfaceFinder& finder) {
  ros::CallbackQueue queue;
  ros::NodeHandle nh;
  nh.setCallbackQueue(&queue);
  std::map<std::string, sensor_msgs::PointCloud2ConstPtr> clouds;
  std::map<std::string, ros::Subscriber> subscribers;
  for (const std::string& topic : finder.topics()) {
    const boost::function<void(const sensor_msgs::PointCloud2ConstPtr&)> keep =
        [&clouds, topic](const sensor_msgs::PointCloud2ConstPtr& cloud) {
          clouds.emplace(topic, cloud);  // the first: its transform will come
        };
    subscribers[topic] = nh.subscribe<sensor_msgs::PointCloud2>(topic, 1, keep);
  }
  const ros::WallTime end = ros::WallTime::now() + kPatience;
  while (!finder.topics().empty() && ros::ok() && ros::WallTime::now() < end) {
    queue.callAvailable(kPause);
    for (const auto& [topic, cloud] : clouds) {
      if (subscribers.count(topic) > 0 && finder.take(topic, *cloud)) subscribers.erase(topic);
    }
  }
}

bool SurfaceService::find(std_srvs::Trigger::Request&, std_srvs::Trigger::Response& response) {
  SurfaceFinder finder(surfaces_, buffer_);
  collect(finder);
  const std::vector<Finding> findings = finder.find();
  response.success = true;
  for (std::size_t i = 0; i < findings.size(); ++i) {
    if (!surfaces_[i].isMeasured()) continue;
    take_(i, findings[i]);
    response.success = response.success && findings[i].surface;
    response.message += (response.message.empty() ? "" : "\n") + findings[i].text;
  }
  if (response.message.empty()) response.message = "no surface of the configuration is to be found";
  return true;
}

}  // namespace afterglow::nodes
