#include "nodes/player/master_watch.hpp"

#include <ros/master.h>

#include <utility>

namespace afterglow::nodes {
namespace {

constexpr double kPeriod = 0.25;        // s
constexpr double kMasterAnswers = 1.0;  // s
constexpr int kMostMissed = 1;

}  // namespace

MasterWatch::MasterWatch(std::function<void(const std::string&)> on_lost)
    : on_lost_(std::move(on_lost)) {
  thread_.every(kPeriod, [this] { look(); });
  thread_.begin();
}

void MasterWatch::look() {
  if (missed_ > kMostMissed) return;
  missed_ = master_.isThere(deadlineIn(kMasterAnswers)) ? 0 : missed_ + 1;
  if (missed_ > kMostMissed) on_lost_("the ROS master is gone (" + ros::master::getURI() + ")");
}

}  // namespace afterglow::nodes
