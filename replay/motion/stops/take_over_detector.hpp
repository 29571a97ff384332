/// \file
/// The watch for somebody else who drives the base that a replay drives, as the velocities around
/// its multiplexer show.
#pragma once

#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "replay/messages/message.hpp"
#include "replay/motion/planar_pose.hpp"

namespace afterglow::replay {

/// A multiplexer passes on one of its inputs: the replay's, a person's. Each of its `on` methods
/// returns who drives, or holds the base still by zeros that suppress what it is told, one clause;
/// empty: the replay alone. Stamps in ROS time; one thread at a time.
class TakeOverDetector {
 public:
  /// `topic`: where the replay drives the base; empty: it does not. Whatever is sent on
  /// `take_over_topics` is somebody who takes over.
  TakeOverDetector(std::string topic, std::set<std::string> take_over_topics)
      : topic_(std::move(topic)), take_over_topics_(std::move(take_over_topics)) {}

  /// Takes the replay's velocity, before it is sent.
  void told(Stamp now, const Velocity& velocity);

  /// The multiplexer says which input it passes on, as topic_tools' mux does: a topic or "__none".
  std::string onSelected(const std::string& selected) const;
  /// Another input of the multiplexer.
  std::string onInput(Stamp now, const std::string& topic, const Velocity& velocity);
  /// Behind the multiplexer. What passes exactly what it is told may pass nothing else; what ramps
  /// velocities may be slower than told.
  std::string onOutput(Stamp now, const std::string& topic, const Velocity& velocity);

 private:
  struct Sent {
    Stamp at;
    Velocity velocity;
  };

  std::string holderOf(Stamp now) const;
  void forget(Stamp now);
  bool wasTold(const Velocity& velocity) const;
  bool isSlowerThanTold(const Velocity& velocity) const;
  std::string driverOf(Stamp now, const std::string& output, const Velocity* velocity) const;

  const std::string topic_;
  const std::set<std::string> take_over_topics_;
  std::deque<Sent> told_;               ///< recent commands
  std::map<std::string, Sent> inputs_;  ///< the last velocity of each but zero
  std::map<std::string, Stamp> zeros_;  ///< time of each input's last zero
  int exact_ = 0;                       ///< velocities that came out as they went in
  /// Since when what is told moves, and none of it came out; empty: it does not, or did just now.
  std::optional<Stamp> suppressed_since_;
  bool puts_zeros_out_ = false;  ///< since then
};

}  // namespace afterglow::replay
