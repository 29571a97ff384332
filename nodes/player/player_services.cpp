#include "nodes/player/player_services.hpp"

#include <afterglow/Burst.h>
#include <afterglow/GetRate.h>
#include <afterglow/IsPaused.h>
#include <afterglow/ReplayActionGoal.h>
#include <afterglow/Seek.h>
#include <afterglow/SetRate.h>
#include <fmt/format.h>
#include <std_srvs/SetBool.h>
#include <std_srvs/Trigger.h>

#include <cstdint>
#include <limits>
#include <stdexcept>
#include <utility>

namespace afterglow::nodes {
namespace {

std::string setPaused(ReplaySession& session, bool pauses) {
  session.pause(pauses);
  return pauses ? "paused" : "resumed";
}

template <typename Response, typename Act>
bool answer(Response& response, const Act& act) {
  try {
    response.message = act();
    response.success = true;
  } catch (const std::exception& error) {
    response.message = error.what();
    response.success = false;
  }
  return true;
}

/// As the service has it: an empty field, and 0, is not given.
ReplayGoal goalOf(const PlayBehavior::Request& request) {
  ReplayGoal goal;
  goal.behavior = request.name.empty() ? request.selector : request.name;
  if (request.behavior_id != 0) goal.behavior = std::to_string(request.behavior_id);
  if (!request.only.empty()) goal.options.push_back("only=" + request.only);
  if (request.rate != 0) goal.options.push_back(fmt::format("rate={}", request.rate));
  if (request.start != 0) goal.options.push_back(fmt::format("start={}", request.start));
  if (request.paused) goal.options.push_back("pause");
  for (const std::string& topic : request.also) goal.options.push_back("also=" + topic);
  return goal;
}

}  // namespace

template <typename Service>
void PlayerServices::serve(
    const std::string& name,
    std::function<std::string(ReplaySession&, const typename Service::Request&)> action) {
  servers_.push_back(node_.advertiseService<typename Service::Request, typename Service::Response>(
      name, [this, action = std::move(action)](auto& request, auto& response) {
        return answer(response, [&] {
          const std::shared_ptr<ReplaySession> session = player_.session();
          if (!session) throw std::runtime_error("nothing is being replayed");
          return action(*session, request);
        });
      }));
}

void PlayerServices::serveTrigger(const std::string& name, const Command& action) {
  serve<std_srvs::Trigger>(
      name, [action](ReplaySession& session, const auto&) { return action(session); });
}

PlayerServices::PlayerServices(const ros::NodeHandle& private_node, const std::string& action,
                               Player player)
    : node_(private_node), player_(std::move(player)) {
  goals_ = ros::NodeHandle().advertise<ReplayActionGoal>(action + "/goal", 1);
  serveTrigger("stop", [](ReplaySession& session) {
    session.stop("stopped");
    return "stopped";
  });
  serveTrigger("pause", [](ReplaySession& session) { return setPaused(session, true); });
  serveTrigger("resume", [](ReplaySession& session) { return setPaused(session, false); });
  serveTrigger("toggle_paused",
               [](ReplaySession& session) { return setPaused(session, !session.isPaused()); });
  serveTrigger("play_next", [](ReplaySession& session) {
    session.playNext(1);
    return "played the next message";
  });
  serve<std_srvs::SetBool>("pause_playback", [](ReplaySession& session, const auto& request) {
    return setPaused(session, request.data);
  });
  serve<Burst>("burst", [](ReplaySession& session, const auto& request) {
    constexpr std::uint64_t kAll = std::numeric_limits<std::uint32_t>::max();
    session.playNext(request.num_messages == 0 ? kAll : request.num_messages);
    return "played at once";
  });
  serve<SetRate>("set_rate", [](ReplaySession& session, const auto& request) {
    session.setRate(request.rate);
    return "set";
  });
  serve<Seek>("seek", [](ReplaySession& session, const auto& request) {
    session.seek(request.position);
    return "moved";
  });
  servers_.push_back(node_.advertiseService<IsPaused::Request, IsPaused::Response>(
      "is_paused", [this](IsPaused::Request&, IsPaused::Response& response) {
        const auto session = player_.session();
        response.paused = session && session->isPaused();
        return true;
      }));
  servers_.push_back(node_.advertiseService<GetRate::Request, GetRate::Response>(
      "get_rate", [this](GetRate::Request&, GetRate::Response& response) {
        const auto session = player_.session();
        response.rate = session ? session->progress().rate : 1.0;
        return true;
      }));
  servers_.push_back(node_.advertiseService("play", &PlayerServices::play, this));
}

PlayerServices::~PlayerServices() {
  for (ros::ServiceServer& server : servers_) server.shutdown();
}

bool PlayerServices::play(PlayBehavior::Request& request, PlayBehavior::Response& response) {
  return answer(response, [&] {
    ReplayActionGoal message;  // without an id: the server gives it one
    message.goal = goalOf(request);
    player_.check(message.goal);
    if (goals_.getNumSubscribers() == 0) throw std::runtime_error("the player is not up yet");
    goals_.publish(message);
    return "begun";
  });
}

}  // namespace afterglow::nodes
