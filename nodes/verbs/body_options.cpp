#include "nodes/verbs/body_options.hpp"

#include <functional>
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

/// "odom=robot/odom"; false if it is no such thing.
bool readFrame(const std::string& text, replay::TrackFrames& frames) {
  const std::map<std::string, std::string*> known = {
      {"map", &frames.map}, {"odom", &frames.odometry}, {"base", &frames.base}};
  const std::size_t equals = text.find('=');
  const auto found = known.find(text.substr(0, equals));
  if (equals == std::string::npos || equals + 1 == text.size() || found == known.end()) {
    return false;
  }
  *found->second = text.substr(equals + 1);
  return true;
}

/// "position=0.01". False if it is no such thing.
bool readNoise(const std::string& text, replay::LocalizationNoise& noise) {
  const std::size_t equals = text.find('=');
  const std::string name = text.substr(0, equals);
  double* value = name == "position" ? &noise.position : name == "yaw" ? &noise.yaw : nullptr;
  return value && equals != std::string::npos &&
         CLI::detail::lexical_cast(text.substr(equals + 1), *value) && *value > 0;
}

void readEach(const std::vector<std::string>& texts,
              const std::function<bool(const std::string&)>& read) {
  for (const std::string& text : texts) {
    if (!read(text)) throw CLI::ValidationError("'" + text + "' is not understood; see --help");
  }
}

void addDriveOptions(CLI::App& verb, BodyOptions& body) {
  verb.add_flag("--open-loop", body.base.is_open_loop,
                "Send the base's velocities as they were recorded; default: it is driven along its "
                "recorded poses");
  verb.add_option("--base-topic", body.base.topic,
                  "Which of several velocity topics is the base's");
  verb.add_option_function<std::vector<std::string>>(
      "--base-frame",
      [&body](const std::vector<std::string>& texts) {
        readEach(texts, [&](const std::string& text) { return readFrame(text, body.base.frames); });
      },
      "Frames as they were recorded: map=FRAME odom=FRAME base=FRAME; default map odom base_link");
  verb.add_option_function<std::vector<std::string>>(
      "--localization-noise",
      [&body](const std::vector<std::string>& texts) {
        readEach(texts, [&](const std::string& text) { return readNoise(text, body.base.noise); });
      },
      "How exactly localization knows the base, standard deviations: position=M yaw=RAD; default "
      "0.03 0.0175");
}

void addStartOptions(CLI::App& verb, BodyOptions& body) {
  using Start = BodyOptions::Start;
  auto* there = verb.add_flag_callback(
      "--to-start", [&body] { body.start = Start::MoveThere; },
      "Move slowly to the start, first: the base, if it is less than a metre away, then arm, torso "
      "and gripper");
  verb.add_flag_callback(
          "--any-start", [&body] { body.start = Start::Anywhere; },
          "Begin wherever the robot stands; default: only where it stood")
      ->excludes(there);
  verb.add_option_function<std::vector<std::string>>(
      "--start-tolerance",
      [&body](const std::vector<std::string>& texts) {
        readEach(texts,
                 [&](const std::string& text) { return readTolerance(text, body.tolerances); });
      },
      "How far it may stand from there: turning=RAD sliding=M gripper=M base=M base_turn=RAD; "
      "default 0.05 0.02 0.01 0.05 0.0524");
}

}  // namespace

void addBodyOptions(CLI::App& verb, BodyOptions& body) {
  addStartOptions(verb, body);
  addDriveOptions(verb, body);
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
