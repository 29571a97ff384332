#include <afterglow/StartRecording.h>
#include <afterglow/StopRecording.h>
#include <ros/ros.h>

#include <atomic>
#include <chrono>
#include <thread>

#include "afterglow/recorder_client.hpp"

namespace afterglow::nodes {
namespace {

constexpr std::chrono::milliseconds kLookEvery{50};

class RosRecorder : public RecorderClient {
 public:
  explicit RosRecorder(std::string node) : node_(std::move(node)) {}

  std::int64_t start(const RecordingOptions& options) override {
    const std::string service = node_ + "/start_recording";
    await(service, was_absent_ ? 0.0 : options.timeout_s);
    StartRecording call;
    copyRecordingFields(options, call.request);
    ask(service, call);
    if (!call.response.message.empty()) {
      ROS_WARN_STREAM("recording '" << options.name << "': " << call.response.message);
    }
    return call.response.behavior_id;
  }

  void stop(std::int64_t behavior_id, const std::string& outcome) override {
    StopRecording call;
    call.request.behavior_id = behavior_id;
    call.request.outcome = outcome;
    ask(node_ + "/stop_recording", call);
  }

 private:
  void await(const std::string& service, double seconds) {
    if (!ros::isInitialized()) {
      throw RecorderAbsent("no recorder can be asked before ros::init");
    }
    const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
    while (!ros::service::exists(service, false)) {
      if (std::chrono::steady_clock::now() >= end || ros::isShuttingDown()) {
        was_absent_ = true;
        throw RecorderAbsent("there is no recorder at " + service);
      }
      std::this_thread::sleep_for(kLookEvery);
    }
    was_absent_ = false;
  }

  template <typename Call>
  static void ask(const std::string& service, Call& call) {
    if (!ros::service::call(service, call)) {
      throw std::runtime_error(service + " gives no answer");
    }
    if (!call.response.success) {
      throw std::runtime_error(call.response.message);
    }
  }

  const std::string node_;
  std::atomic<bool> was_absent_{false};
};

}  // namespace

std::shared_ptr<RecorderClient> rosRecorder(const std::string& node) {
  static const auto usual = std::make_shared<RosRecorder>("recorder_node");
  return node == "recorder_node" ? usual : std::make_shared<RosRecorder>(node);
}

}  // namespace afterglow::nodes
