/// \file
/// Notices that somebody else drives the base in a replay: by another input of its multiplexer,
/// behind that, or by hand.
#pragma once

#include <nav_msgs/Odometry.h>

#include <functional>
#include <map>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include "nodes/tools/callback_thread.hpp"
#include "nodes/tools/ros_graph.hpp"
#include "replay/motion/base/base_obedience.hpp"
#include "replay/motion/stops/take_over_detector.hpp"
#include "replay/plan/play_plan.hpp"
#include "replay/plan/robot_profile.hpp"
#include "replay/play/outbox.hpp"

namespace afterglow::nodes {

/// A node that hears velocities on one topic and sends them on another.
struct VelocityRoute {
  std::string node;
  std::string output;               ///< empty: not advertised yet, as topic_tools' mux does late
  std::vector<std::string> inputs;  ///< others'
  std::string selected;             ///< std_msgs/String, the input that it passes on; or empty
};

/// The nodes that pass on what is sent on `topic`: those that hear it and publish one velocity
/// topic alone, or say which input they have selected, as topic_tools' mux does.
std::vector<VelocityRoute> velocityRoutes(const RosGraph& graph,
                                          const std::map<std::string, std::string>& types,
                                          const std::string& topic);

/// Stands between the guards of the player and the sink that publishes, which must outlive it: it
/// has to know what the base is told. What the robot's profile does not name is looked up on the
/// graph.
class TakeOver : public replay::MessageSink {
 public:
  /// `base_topic`: where the base's velocities are published; empty: the replay does not drive it.
  TakeOver(std::string base_topic, const replay::RobotProfile::Base& base,
           replay::MessageSink& sink);

  /// Notices from now on: `on_taken` is called once, with the reason, in a thread of its own.
  /// Throws std::runtime_error, one line, if somebody else drives already.
  void begin(std::function<void(const std::string& reason)> on_taken);
  /// Ends the calls of on_taken.
  void end() { thread_.end(); }

  bool publish(const replay::Channel& channel, const replay::Bytes& bytes) override;

 private:
  void scout();
  template <typename Heard>
  void listen(const std::string& topic, std::function<std::string(const Heard&)> look);
  using Look = std::function<std::string(const std::string& sender, const replay::Velocity&)>;
  void listenToVelocities(const std::string& topic, Look look);
  void listenToOdometry(const std::map<std::string, std::string>& types);
  void follow(const VelocityRoute& route);
  void listenToInput(const std::string& topic);
  void listenToOutput(const std::string& topic, const std::string& multiplexer);

  const std::string topic_;
  const replay::RobotProfile::Base base_;
  replay::MessageSink& sink_;
  std::function<void(const std::string&)> on_taken_;
  std::mutex mutex_;
  replay::TakeOverDetector watch_;
  replay::BaseObedience obedience_;
  std::string reason_;  ///< the reason why it is taken over; empty: it is not
  MasterLink master_;  ///< scout()'s
  std::set<std::string> heard_;  ///< topics; scout()'s
  CallbackThread thread_{2};     ///< threads; one of them asks the master now and then
};

}  // namespace afterglow::nodes
