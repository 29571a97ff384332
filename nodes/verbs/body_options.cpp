#include "nodes/verbs/body_options.hpp"

#include <map>
#include <string>
#include <vector>

namespace afterglow::nodes {
namespace {

std::map<std::string, double*> tolerancesByName(replay::StartTolerances& tolerances) {
  return {{"turning", &tolerances.turning},
          {"sliding", &tolerances.sliding},
          {"gripper", &tolerances.gripper},
          {"base", &tolerances.base},
          {"base_turn", &tolerances.base_turn}};
}

/// "base=0.1"; false if it is no such thing.
bool readTolerance(const std::string& text, replay::StartTolerances& tolerances) {
  const auto known = tolerancesByName(tolerances);
  const std::size_t equals = text.find('=');
  const auto found = known.find(text.substr(0, equals));
  return equals != std::string::npos && found != known.end() &&
         CLI::detail::lexical_cast(text.substr(equals + 1), *found->second) && *found->second >= 0;
}

void addStartOptions(CLI::App& verb, BodyOptions& body) {
  using Start = BodyOptions::Start;
  auto* there = verb.add_flag_callback(
      "--to-start", [&body] { body.start = Start::MoveThere; },
      "Move arm, torso and gripper slowly to where they were at the start, first");
  verb.add_flag_callback(
          "--any-start", [&body] { body.start = Start::Anywhere; },
          "Begin wherever the robot stands; default: only where it stood")
      ->excludes(there);
  verb.add_option_function<std::vector<std::string>>(
      "--start-tolerance",
      [&body](const std::vector<std::string>& texts) {
        for (const std::string& text : texts) {
          if (!readTolerance(text, body.tolerances)) throw CLI::ValidationError(text);
        }
      },
      "How far it may stand from there: turning=RAD sliding=M gripper=M base=M base_turn=RAD; "
      "default 0.05 0.02 0.01 0.05 0.0524");
}

}  // namespace

void addBodyOptions(CLI::App& verb, BodyOptions& body) {
  addStartOptions(verb, body);
  verb.add_option("--longest-stall", body.longest_stall_s,
                  "Seconds the player may hang in motion before the watchdog stops the robot; "
                  "default 0.06")
      ->check(CLI::Range(0.04, 10.0));
  verb.add_option("--estop-topic", body.emergency_stop.topic,
                  "An emergency stop to obey, std_msgs/Bool: true stops the robot");
  verb.add_option("--estop-longest-silence", body.emergency_stop.longest_silence_s,
                  "It has to be repeated within so many seconds; default: it need not be there")
      ->check(CLI::Range(0.01, 60.0));
}

}  // namespace afterglow::nodes
