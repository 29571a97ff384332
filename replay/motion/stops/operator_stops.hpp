/// \file
/// A button that has to be held for the robot to move: hold-to-run, as ISO 10218-1 calls it.
///
/// The boolean field, of messages of any type, that says whether the robot has to stop.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "replay/clock/steady_time.hpp"
#include "replay/messages/field_edit.hpp"
#include "replay/messages/message.hpp"
#include "replay/messages/schema.hpp"

namespace afterglow::replay {

/// Held is a button that was pressed anew since this object was made, or since the hold was lost,
/// and of which news has come within 0.3 s. A joystick that falls silent has let go: whoever held
/// it has to press anew. So does a page of the console, whose button is fed by what it posts. Times
/// are sinceBoot(): a hold does not outlive a computer's sleep. One thread.
class HoldToRun {
 public:
  /// The joystick, or the page, says whether the button is pressed.
  void heard(SteadyTime now, bool is_pressed);

  bool isHeld(SteadyTime now) const;
  /// Held for so long that a joystick which only speaks on changes would have fallen silent.
  bool isHeldSteadily(SteadyTime now) const;
  bool hasBeenHeard() const { return state_ != State::Unknown; }
  /// The button was pressed when its joystick fell silent.
  bool hasFallenSilent(SteadyTime now) const;
  /// Returns true if the button is pressed but was so before that counted: it has to be released
  /// first.
  bool hasToBeReleased() const { return state_ == State::Stuck || state_ == State::Silent; }

 private:
  enum class State {
    Unknown,   ///< nothing was heard
    Stuck,     ///< pressed since before this object
    Released,  ///
    Held,      ///< held, as far as is known
    Silent     ///< pressed again after it had fallen silent
  };

  bool isFresh(SteadyTime now) const;

  State state_ = State::Unknown;
  SteadyTime since_, last_;
};

/// Paths of all booleans of a message, "runstopped", "a.b", "flags[]", in the definition's order.
std::vector<std::string> booleanFields(const Schema& schema);

/// Reads the field of one message after the other; one thread.
class StopField {
 public:
  /// `path` as booleanFields() gives it; empty: the type has one boolean alone, as std_msgs/Bool
  /// has. `stops_when`: the value that stops the robot; of an array's elements one is enough.
  StopField(std::string path, bool stops_when)
      : path_(std::move(path)), stops_when_(stops_when) {}

  /// Returns true if the robot has to stop. Throws MessageError, one line for people, if the type
  /// has no such field, the bytes do not fit the type, or an array is empty.
  bool stops(const std::string& type, const std::string& definition, const Bytes& bytes);

 private:
  void prepare(const std::string& type, const std::string& definition);

  const std::string path_;
  const bool stops_when_;
  std::string type_, definition_;  ///< the finder's type and definition
  std::optional<FieldFinder> finder_;
};

}  // namespace afterglow::replay
