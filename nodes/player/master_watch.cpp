#include "nodes/player/master_watch.hpp"

#include <ros/master.h>

#include <chrono>
#include <utility>

#include "nodes/tools/ros_graph.hpp"

namespace afterglow::nodes {
namespace {

constexpr std::chrono::milliseconds kPeriod(250);
constexpr double kMasterAnswers = 1.0;  // s
constexpr int kMostMissed = 1;

}  // namespace

MasterWatch::MasterWatch(std::function<void(const std::string&)> on_lost)
    : on_lost_(std::move(on_lost)), thread_([this] { run(); }) {}

MasterWatch::~MasterWatch() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    is_over_ = true;
  }
  over_.notify_all();
  thread_.join();
}

void MasterWatch::run() {
  MasterLink master;
  std::unique_lock<std::mutex> lock(mutex_);
  int missed = 0;
  while (missed <= kMostMissed) {
    if (over_.wait_for(lock, kPeriod, [this] { return is_over_; })) return;
    lock.unlock();
    missed = master.isThere(deadlineIn(kMasterAnswers)) ? 0 : missed + 1;
    lock.lock();
  }
  lock.unlock();
  on_lost_("the ROS master is gone (" + ros::master::getURI() + ")");
}

}  // namespace afterglow::nodes
