#include "nodes/guard/guard_node.hpp"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <exception>
#include <iterator>
#include <system_error>
#include <utility>
#include <vector>

#include "nodes/tools/stop_signal.hpp"

namespace afterglow {
namespace nodes {
namespace {

constexpr std::uint32_t kQueue = 100;
/// More are a mistake, or an attack; they get no answer, and no player moves without one.
constexpr std::size_t kMostPlayers = 32;
constexpr std::int64_t kRosLook = 200000000;      // ns; whether ROS still runs
constexpr std::int64_t kLongestEnd = 2000000000;  // ns; of players that move on and on
constexpr double kForgetPeriod = 1.0;             // s

}  // namespace

GuardNode::GuardNode(MakeWays make_ways)
    : make_ways_(std::move(make_ways)),
      waker_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)),
      beats_node_("~"),
      outputs_node_("~"),
      beats_spinner_(1, &beats_queue_),
      outputs_spinner_(1, &outputs_queue_) {
  if (waker_ < 0) throw std::system_error(errno, std::generic_category(), "no event to wait for");
  beats_node_.setCallbackQueue(&beats_queue_);
  outputs_node_.setCallbackQueue(&outputs_queue_);
  answers_ = beats_node_.advertise<GuardAnswer>("answers", kQueue);
  const ros::TransportHints at_once = ros::TransportHints().tcpNoDelay();
  outputs_ =
      outputs_node_.subscribe("outputs", kQueue, &GuardNode::onOutputs, this, at_once);
  if (!make_ways_) beats_ = beats_node_.subscribe("beats", kQueue, &GuardNode::hear, this, at_once);
  timer_ = outputs_node_.createWallTimer(ros::WallDuration(kForgetPeriod), &GuardNode::onTimer,
                                         this);
  outputs_spinner_.start();
  beats_spinner_.start();
}

GuardNode::~GuardNode() {
  beats_.shutdown();
  outputs_.shutdown();
  timer_.stop();
  beats_spinner_.stop();
  outputs_spinner_.stop();
  ::close(waker_);
}

void GuardNode::run() {
  watch();
  letMessagesLeave();
}

void GuardNode::watch() {
  replay::SteadyTime end = replay::SteadyTime::forever();
  while (ros::ok()) {
    const bool is_ending = isStopRequested();
    if (is_ending) {
      end = std::min(end, replay::sinceBoot().after(kLongestEnd));
      if (!stopAll("the guard on the robot was ended by " + stopRequest())) return;
      if (end <= replay::sinceBoot()) return;
    }
    waitUntil(step(), is_ending);
  }
}

/// False: nothing is in motion any more.
bool GuardNode::stopAll(const std::string& reason) {
  const std::lock_guard<std::mutex> lock(mutex_);
  bool is_braking = false;
  for (auto& player : players_) {
    player.second.stop(replay::sinceBoot(), reason);
    is_braking = is_braking || player.second.isBraking();
  }
  return is_braking;
}

/// Returns when there is something to do again.
replay::SteadyTime GuardNode::step() {
  std::vector<std::pair<std::string, GuardAnswer>> begun;
  replay::SteadyTime next = replay::SteadyTime::forever();
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    for (auto& player : players_) {
      if (player.second.step(replay::sinceBoot())) {
        begun.push_back({player.second.name() + ": " + player.second.account(),
                         player.second.answer()});
      }
      next = std::min(next, player.second.deadline());
    }
  }
  for (const auto& stop : begun) {
    answers_.publish(stop.second);  // a player that comes to life again must not drive on
    ROS_ERROR_STREAM(stop.first);
  }
  return next;
}

void GuardNode::waitUntil(replay::SteadyTime deadline, bool is_ending) const {
  const std::int64_t now_ns = replay::sinceBoot().ns;
  const std::int64_t wait_ns = std::min(deadline.ns, now_ns + kRosLook) - now_ns;
  const auto wait_ms = static_cast<int>(std::max<std::int64_t>(0, (wait_ns + 999999) / 1000000));
  // A request that has been seen is no news.
  pollfd polled[2] = {{waker_, POLLIN, 0}, {is_ending ? -1 : stopRequestFd(), POLLIN, 0}};
  ::poll(polled, 2, wait_ms);
  std::uint64_t count = 0;
  if (::read(waker_, &count, sizeof count) < 0) return;  // it was woken by something else
}

void GuardNode::wake() const {
  const std::uint64_t one = 1;
  if (::write(waker_, &one, sizeof one) < 0) return;  // it is awake already
}

void GuardNode::hear(const GuardBeat& beat) {
  GuardAnswer answer;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (players_.count(beat.player) == 0 && players_.size() >= kMostPlayers) return;
    GuardedPlayer& player = players_[beat.player];
    player.hear(beat, replay::sinceBoot());
    answer = player.answer();
  }
  wake();
  answers_.publish(answer);
}

void GuardNode::onOutputs(const GuardOutputs& outputs) {
  try {
    know(outputs);
  } catch (const std::exception& error) {  // a topic's name that is none
    ROS_ERROR_STREAM(outputs.name << " cannot be guarded: " << error.what());
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto player = players_.find(outputs.player);
    if (player != players_.end()) player->second.stop(replay::sinceBoot(), error.what());
  }
}

void GuardNode::know(const GuardOutputs& outputs) {
  GuardedPlayer::Ways known;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto player = players_.find(outputs.player);
    if (player != players_.end() && player->second.version() == outputs.version) return;
    if (player == players_.end() && players_.size() >= kMostPlayers) return;
    if (player != players_.end()) known = player->second.ways();
  }
  const GuardedPlayer::Ways ways = make_ways_
                                       ? make_ways_(outputs, known)
                                       : GuardedPlayer::advertise(outputs_node_, outputs, known);
  const std::lock_guard<std::mutex> lock(mutex_);
  players_[outputs.player].know(outputs, ways, replay::sinceBoot());
}

/// Players that are gone are forgotten in this thread, without the lock: the master is told.
void GuardNode::onTimer(const ros::WallTimerEvent&) {
  std::vector<GuardedPlayer> gone;
  const std::lock_guard<std::mutex> lock(mutex_);
  for (auto player = players_.begin(); player != players_.end();) {
    const bool is_gone = player->second.isGone(replay::sinceBoot());
    if (is_gone) gone.push_back(std::move(player->second));
    player = is_gone ? players_.erase(player) : std::next(player);
  }
}

}  // namespace nodes
}  // namespace afterglow
