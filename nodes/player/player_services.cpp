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

/// A node's name without the numbers that make an anonymous one unique: each `rosservice call` is a
/// node of its own, "/rosservice_4711_1700000000".
std::string withoutNumbers(std::string node) {
  for (;;) {
    const std::size_t end = node.find_last_not_of("0123456789");
    if (end == std::string::npos || end + 1 == node.size() || node[end] != '_') return node;
    node.resize(end);
  }
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
void PlayerServices::serve(const std::string& name, Command<Service> command) {
  using Event = ros::ServiceEvent<typename Service::Request, typename Service::Response>;
  const auto serveOne = [this, command = std::move(command)](Event& event) {
    return answer(event.getResponse(), [&] {
      const Session session = player_.session();
      if (!session) throw std::runtime_error("nothing is being replayed");
      return command(session, event.getRequest(), withoutNumbers(event.getCallerName()));
    });
  };
  servers_.push_back(
      node_.advertiseService<Event>(name, boost::function<bool(Event&)>(serveOne)));
}

std::string PlayerServices::setPaused(const Session& session, bool pauses,
                                      const std::string& caller) {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::set<std::string>& pausers = pausersOf(session);
  if (pauses) {
    pausers.insert(caller);
  } else {
    pausers.erase(caller);
    needNoOthersPause(session, caller);
  }
  session->pause(pauses);
  return pauses ? "paused" : "resumed";
}

/// Needs the lock held.
std::set<std::string>& PlayerServices::pausersOf(const Session& session) {
  if (paused_.lock() != session || !session->isPaused()) pausers_.clear();
  paused_ = session;
  return pausers_;
}

/// Throws std::runtime_error where somebody else has paused it. With the lock held.
void PlayerServices::needNoOthersPause(const Session& session, const std::string& caller) {
  for (const std::string& pauser : pausersOf(session)) {
    if (pauser == caller) continue;
    throw std::runtime_error("it was paused by " + pauser +
                             ": it goes on only when that resumes it; ~stop ends it");
  }
}

PlayerServices::PlayerServices(const ros::NodeHandle& private_node, const std::string& action,
                               Player player)
    : node_(private_node), player_(std::move(player)) {
  goals_ = ros::NodeHandle().advertise<ReplayActionGoal>(action + "/goal", 1);
  using std_srvs::Trigger;
  serve<Trigger>("stop", [](const Session& session, const auto&, const auto&) {
    session->stop("stopped");
    return "stopped";
  });
  serve<Trigger>("pause", [this](const Session& session, const auto&, const auto& caller) {
    return setPaused(session, true, caller);
  });
  serve<Trigger>("resume", [this](const Session& session, const auto&, const auto& caller) {
    return setPaused(session, false, caller);
  });
  serve<Trigger>("toggle_paused", [this](const Session& session, const auto&, const auto& caller) {
    return setPaused(session, !session->isPaused(), caller);
  });
  serve<std_srvs::SetBool>("pause_playback", [this](const Session& session, const auto& request,
                                                    const auto& caller) {
    return setPaused(session, request.data, caller);
  });
  const auto playNext = [this](const Session& session, std::uint64_t count, const auto& caller) {
    const std::lock_guard<std::mutex> lock(mutex_);
    needNoOthersPause(session, caller);
    session->tell([&](replay::Player& playing) { playing.playNext(count); });
  };
  serve<Trigger>("play_next", [playNext](const Session& session, const auto&, const auto& caller) {
    playNext(session, 1, caller);
    return "played the next message";
  });
  serve<Burst>("burst", [playNext](const Session& session, const auto& request,
                                   const auto& caller) {
    constexpr std::uint64_t kAll = std::numeric_limits<std::uint32_t>::max();
    playNext(session, request.num_messages == 0 ? kAll : request.num_messages, caller);
    return "played at once";
  });
  serve<SetRate>("set_rate", [](const Session& session, const auto& request, const auto&) {
    session->setRate(request.rate);
    return "set";
  });
  serve<Seek>("seek", [](const Session& session, const auto& request, const auto&) {
    const replay::PlaybackTime to{static_cast<std::int64_t>(request.position * 1e9)};
    session->tell([&](replay::Player& playing) { playing.seek(to); });
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
  ros::NodeHandle slow(node_);
  slow.setCallbackQueue(&slow_requests_);
  servers_.push_back(slow.advertiseService<Rehearse::Request, Rehearse::Response>(
      "rehearse", [this](Rehearse::Request& request, Rehearse::Response& response) {
        player_.rehearse(request, response);
        return true;
      }));
  servers_.push_back(slow.advertiseService<LastReport::Request, LastReport::Response>(
      "last_report", [this](LastReport::Request&, LastReport::Response& response) {
        player_.last_report(response);
        return true;
      }));
  slow_thread_.start();
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
