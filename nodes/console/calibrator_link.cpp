#include "nodes/console/calibrator_link.hpp"

#include <std_srvs/Trigger.h>

#include <set>
#include <utility>

#include "nodes/console/http_message.hpp"

namespace afterglow::nodes {

CalibratorLink::CalibratorLink(const std::string& calibrator)
    : calibrator_(ros::names::resolve(calibrator)) {
  statuses_ = node_.subscribe<std_msgs::String>(calibrator_ + "/status", 10,
                                                [this](const auto& status) { onStatus(*status); });
  guidance_ = node_.subscribe<std_msgs::String>(
      calibrator_ + "/guidance", 20, [this](const auto& guidance) { onGuidance(*guidance); });
}

nlohmann::ordered_json CalibratorLink::state() const {
  if (statuses_.getNumPublishers() == 0) return nullptr;
  const std::lock_guard<std::mutex> lock(mutex_);
  nlohmann::ordered_json state = status_;
  if (!state.is_null()) state["said"] = said_;
  return state;
}

bool CalibratorLink::isCommand(const std::string& name) {
  static const std::set<std::string> commands{"start", "stop", "take", "solve", "discard_last"};
  return commands.count(name) > 0;
}

std::string CalibratorLink::trigger(const std::string& command) const {
  std_srvs::Trigger service;
  if (!ros::service::call(calibrator_ + "/" + command, service)) {
    throw HttpError(503, calibrator_ + " does not answer");
  }
  if (!service.response.success) throw HttpError(409, service.response.message);
  return service.response.message;
}

void CalibratorLink::onStatus(const std_msgs::String& status) {
  auto told = nlohmann::ordered_json::parse(status.data, nullptr, false);
  if (!told.is_object()) return;  // of another node of this name
  const std::lock_guard<std::mutex> lock(mutex_);
  status_ = std::move(told);
}

void CalibratorLink::onGuidance(const std_msgs::String& guidance) {
  const std::lock_guard<std::mutex> lock(mutex_);
  said_.push_front(guidance.data);
  if (said_.size() > kMostSaid) said_.pop_back();
}

}  // namespace afterglow::nodes
