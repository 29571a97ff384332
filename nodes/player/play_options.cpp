#include "nodes/player/play_options.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <optional>
#include <set>
#include <stdexcept>
#include <utility>

#include "nodes/player/robot_file.hpp"
#include "replay/clock/timeline.hpp"
#include "replay/messages/ranges.hpp"
#include "replay/messages/text.hpp"
#include "replay/plan/topic_role.hpp"
#include "replay/query/nearest.hpp"

namespace afterglow::nodes {
namespace {

using Request = ReplayRequest;
using Kind = PlayOption::Kind;
using Complaint = std::function<std::string(const std::string&)>;
using Texts = const OptionTexts&;
using Set = std::function<void(Request&, Texts)>;

constexpr const char* kForever = "forever";

// -------------------------------------------------------------------------------- kinds of values

std::optional<double> numberOf(const std::string& text) {
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  const bool is_number = !text.empty() && *end == 0 && std::isfinite(value);
  return is_number ? std::optional<double>(value) : std::nullopt;
}

/// The form of a value, and what is refused.
struct ValueKind {
  Kind kind;
  std::string shown;
  Complaint complaint;
  std::string alone;
};

ValueKind flag() {
  return {Kind::Flag, "",
          [](const std::string& text) {
            const bool is_flag = text == "true" || text == "false";
            return is_flag ? "" : text + " is neither true nor false";
          },
          "true"};
}

ValueKind text(const std::string& shown) { return {Kind::Value, shown, {}, ""}; }
ValueKind list(const std::string& shown) { return {Kind::List, shown, {}, ""}; }

std::string complaintAboutSeconds(const std::string& text) {
  const auto value = numberOf(text);
  return value && *value >= 0 ? "" : text + " is no number of seconds";
}

ValueKind seconds() { return {Kind::Value, "SECONDS", complaintAboutSeconds, ""}; }

ValueKind secondsOrForever() {
  return {Kind::Value, "SECONDS",
          [](const std::string& text) {
            return text == kForever ? "" : complaintAboutSeconds(text);
          },
          kForever};
}

ValueKind aboveZero(const std::string& shown, double least, double most) {
  return {Kind::Value, shown,
          [=](const std::string& text) {
            const auto value = numberOf(text);
            if (value && *value >= least && *value <= most) return std::string();
            return fmt::format("{} is no number of {} to {}", text, least, most);
          },
          ""};
}

ValueKind rateFactor() {
  return aboveZero("FACTOR", replay::kSlowestRate, replay::kFastestRate);
}
ValueKind hertz() { return aboveZero("HZ", 1e-3, 1e3); }
ValueKind secondsAboveZero() { return aboveZero("SECONDS", 1e-3, 1e9); }

ValueKind range(const std::string& shown, double least, double most, bool is_count = false) {
  return {Kind::Value, shown,
          [=](const std::string& text) {
            const auto value = numberOf(text);
            const bool is_fit = value && *value >= least && *value <= most &&
                                (!is_count || *value == std::floor(*value));
            if (is_fit) return std::string();
            return fmt::format("Value {} not in range {:.7g} to {:.7g}", text, least, most);
          },
          ""};
}

ValueKind choice(const std::vector<std::string>& words) {
  return {Kind::Value, fmt::format("{}", fmt::join(words, "|")),
          [words](const std::string& text) {
            const bool is_known = replay::contains(words, text);
            return is_known ? "" : fmt::format("{} not in {{{}}}", text, fmt::join(words, ","));
          },
          ""};
}

/// Makes a kind of the values that a parser understands, which throws std::invalid_argument.
template <typename Parse>
ValueKind understood(Kind kind, const std::string& shown, Parse parse) {
  return {kind, shown,
          [parse](const std::string& text) -> std::string {
            try {
              parse(text);
              return "";
            } catch (const std::invalid_argument& error) {
              return error.what();
            }
          },
          ""};
}

/// A topic's name, or a list of them, clean and valid.
ValueKind topic(Kind kind = Kind::Value, const std::string& shown = "TOPIC") {
  return understood(kind, shown, [](const std::string& text) { replay::TopicName{text}; });
}

ValueKind topics() { return topic(Kind::List); }

// ---------------------------------------------------------------- values of a request, and theirs

void assign(bool& member, Texts texts) { member = texts.front() == "true"; }
void assign(double& member, Texts texts) { member = *numberOf(texts.front()); }
void assign(std::optional<double>& member, Texts texts) {
  member = numberOf(texts.front());
}
void assign(std::uint32_t& member, Texts texts) {
  member = static_cast<std::uint32_t>(*numberOf(texts.front()));
}
void assign(std::string& member, Texts texts) { member = texts.front(); }
void assign(std::vector<replay::TopicName>& member, Texts texts) {
  member = replay::topicNames(texts);
}
void assign(std::set<std::string>& member, Texts texts) {
  member = {texts.begin(), texts.end()};
}

std::string shown(bool value) { return value ? "true" : ""; }
std::string shown(double value) { return value == 0 ? "" : fmt::format("{:.3g}", value); }
std::string shown(const std::string& value) { return value; }
template <typename Other>  // a queue's length, or what is empty at first
std::string shown(const Other& value) {
  if constexpr (std::is_integral_v<Other>) return std::to_string(value);
  return "";
}

/// An option by the function that sets it.
PlayOption row(const std::string& name, const ValueKind& value, const std::string& help,
               std::function<void(Request&, const OptionTexts&)> set,
               const std::string& otherwise = "") {
  PlayOption option;
  option.kind = value.kind;
  option.name = name;
  option.value = value.shown;
  option.alone = value.alone;
  option.otherwise = otherwise;
  option.help = help;
  option.complaint = value.complaint;
  option.set = std::move(set);
  return option;
}

/// An option that is a member of the request, which says what holds if it is not given.
template <typename Member>
PlayOption member(const std::string& name, const ValueKind& value, const std::string& help,
                  Member of) {
  Request unasked;
  return row(
      name, value, help,
      [of](Request& request, Texts texts) { assign(of(request), texts); },
      shown(of(unasked)));
}

/// A flag that chooses one of several values of a member.
template <typename Member, typename Choice>
PlayOption choosing(const std::string& name, const std::string& help, Member of, Choice choice) {
  return row(name, flag(), help, [of, choice](Request& request, Texts texts) {
    Request unasked;
    if (texts.front() == "true") {
      of(request) = choice;
    } else if (of(request) == choice) {
      of(request) = of(unasked);
    }
  });
}

/// An option whose values are those that it can be set to, or elements of such a list.
PlayOption tried(const std::string& name, Kind kind, const std::string& shown_value,
                 const std::string& help, const Set& set, const std::string& otherwise = "") {
  const auto try_it = [set](const std::string& text) {
    Request unasked;
    set(unasked, {text});
  };
  return row(name, understood(kind, shown_value, try_it), help, set, otherwise);
}

/// An option of KEY=VALUE, each a member of the request.
template <typename Value>
PlayOption keyed(const std::string& name, const std::string& shown_value, const std::string& help,
                 const std::vector<std::pair<std::string, Value& (*)(Request&)>>& members,
                 const std::function<bool(const std::string&)>& is_value) {
  using Member = Value& (*)(Request&);
  const auto memberOf = [members](const std::string& text) -> Member {
    for (const auto& [key, member] : members) {
      if (text.rfind(key + "=", 0) == 0) return member;
    }
    return nullptr;
  };
  const auto valueOf = [](const std::string& text) { return text.substr(text.find('=') + 1); };
  const auto complaint = [=](const std::string& text) {
    const bool is_fit = memberOf(text) && is_value(valueOf(text));
    return is_fit ? "" : "'" + text + "' is not understood; see --help";
  };
  const auto set = [=](Request& request, Texts texts) {
    for (const std::string& text : texts) assign(memberOf(text)(request), {valueOf(text)});
  };
  Request unasked;
  std::vector<std::string> keys, defaults;
  for (const auto& [key, member] : members) {
    keys.push_back(key);
    defaults.push_back(shown(member(unasked)));
  }
  PlayOption option = row(name, {Kind::List, shown_value, complaint, ""}, help, set,
                          fmt::format("{}", fmt::join(defaults, " ")));
  option.keys = keys;
  return option;
}

PlayOption called(const std::string& aliases, PlayOption option) {
  option.aliases = aliases;
  return option;
}

PlayOption needing(const std::string& other, PlayOption option) {
  option.needs = other;
  return option;
}

PlayOption excluding(const std::string& other, PlayOption option) {
  option.excludes = other;
  return option;
}

// ------------------------------------------------------------------------------------- the options

std::vector<PlayOption> whatIsPlayed() {
  return {
      member("only", understood(Kind::Value, "MODALITIES", replay::parseModalities),
             "body,ar,speech: any of them; default all",
             [](Request& r) -> auto& { return r.only; }),
      member("topics", topics(), "Only these topics, whatever they are",
             [](Request& r) -> auto& { return r.plan.topics; }),
      member("also", topics(),
             "These topics as well: by itself only the body, and light and speech that somebody "
             "asked for, are played",
             [](Request& r) -> auto& { return r.plan.also; }),
      member("everything", flag(),
             "All but motion and control inputs, where no robot is live (so does --prefix)",
             [](Request& r) -> auto& { return r.everything; }),
      member("exclude", topics(), "All but these topics",
             [](Request& r) -> auto& { return r.plan.exclude; }),
      called("-e", member("regex", text("REGEX"), "Only topics whose whole name matches",
                          [](Request& r) -> auto& { return r.plan.regex; })),
      called("-x", member("exclude_regex", text("REGEX"), "All but topics whose name matches",
                          [](Request& r) -> auto& { return r.plan.exclude_regex; })),
  };
}

std::vector<PlayOption> whichPart() {
  return {
      called("-s", member("start", seconds(), "Begin so many seconds into the behavior",
                          [](Request& r) -> auto& { return r.plan.start_s; })),
      called("-u", member("duration", secondsAboveZero(), "Play so many seconds of it",
                          [](Request& r) -> auto& { return r.plan.duration_s; })),
      member("until", secondsAboveZero(), "Play until so many seconds into it",
             [](Request& r) -> auto& { return r.plan.until_s; }),
  };
}

std::vector<PlayOption> howItIsPlayed() {
  return {
      called("-r", member("rate", rateFactor(),
                          "Speed; velocities and trajectories go with it (0.1 to 10 for the body)",
                          [](Request& r) -> auto& { return r.options.rate; })),
      called("-l", member("loop", flag(), "Again and again (light and speech only)",
                          [](Request& r) -> auto& { return r.options.is_looping; })),
      called("-i", member("immediate", flag(), "All at once (light and speech only)",
                          [](Request& r) -> auto& { return r.options.is_immediate; })),
      member("pause", flag(), "Start paused",
             [](Request& r) -> auto& { return r.options.starts_paused; }),
      member("pause_topics", topics(), "Pause before each message on these topics",
             [](Request& r) -> auto& { return r.options.pause_topics; }),
      member("skip_empty", secondsAboveZero(),
             "Play so many seconds of each time without messages",
             [](Request& r) -> auto& { return r.options.skip_empty_s; }),
      called("-k", member("keep_alive", flag(), "Stay at the end, with the light on",
                          [](Request& r) -> auto& { return r.options.keeps_alive; })),
      row("keep_light", flag(), "Leave the light on when it ends",
          [](Request& r, Texts texts) { r.options.clear_projection = texts.front() == "false"; }),
      member("hold", seconds(), "Seconds the light stays after the end",
             [](Request& r) -> auto& { return r.options.hold_s; }),
  };
}

std::vector<PlayOption> inStep() {
  return {
      row("ungated", flag(), "Light and speech do not wait for the body",
          [](Request& r, Texts texts) { r.options.is_in_step = texts.front() == "false"; }),
      tried("latency", Kind::List, "LATENCY",
            "Send what takes effect late so many seconds earlier: ar=0.05,speech=0.2",
            [](Request& r, Texts texts) { r.options.latency_s = replay::parseLatency(texts); }),
      tried("on_failure", Kind::List, "REACTION", "stop or go_on when a modality fails",
            [](Request& r, Texts texts) { r.options.on_failure = replay::parseOnFailure(texts); },
            "body=stop,ar=go_on,speech=go_on"),
      member("goal_wait", seconds(),
             "Seconds a goal may take longer than it did when it was recorded",
             [](Request& r) -> auto& { return r.options.goal_wait_s; }),
      member("seek_lead", seconds(),
             "After a seek: seconds the arm has to get to where it goes on",
             [](Request& r) -> auto& { return r.options.seek_lead_s; }),
  };
}

std::vector<PlayOption> whoListens() {
  return {
      called("-d", member("delay", seconds(), "Wait so many seconds before the first message",
                          [](Request& r) -> auto& { return r.delay_s; })),
      row("wait_for_subscribers", secondsOrForever(),
          "Seconds to wait for somebody to listen on every topic; alone: until they do",
          [](Request& r, Texts texts) {
            r.wait_for_subscribers_s = numberOf(texts.front()).value_or(31'536'000);
          },
          shown(Request().wait_for_subscribers_s)),
      row("unheard", choice({"start", "abort"}),
          "If nobody listens on a topic by then: start (and tell), or abort",
          [](Request& r, Texts texts) { r.needs_subscribers = texts.front() == "abort"; },
          "start"),
      member("rate_control_topic", topic(),
             "Wait until this topic's header stamps have come as far as what was played, but for "
             "the longest delay (light and speech only)",
             [](Request& r) -> auto& { return r.rate_control.topic; }),
      needing("rate_control_topic",
              member("rate_control_max_delay", seconds(), "That delay in seconds",
                     [](Request& r) -> auto& { return r.rate_control.longest_delay_s; })),
  };
}

std::vector<PlayOption> whoseTime() {
  const auto clock = [](Request& r) -> auto& { return r.clock; };
  return {
      called("--clock", choosing("sim",
                                 "Give the recording's time on /clock; stamps stay as they were "
                                 "(--clock: its name in rosbag play and ros2 bag play)",
                                 clock, ReplayClock::Sim)),
      needing("sim", member("hz", hertz(), "How often a second",
                            [](Request& r) -> auto& { return r.clock_hz; })),
      excluding("sim", choosing("follow_clock", "Go, wait and pause as another node's /clock",
                                clock, ReplayClock::Follow)),
  };
}

std::vector<PlayOption> underWhichNames() {
  return {
      called("-p", member("prefix",
                          understood(Kind::Value, "NAMESPACE", replay::checkNamespace),
                          "Before every topic's name: another robot's namespace",
                          [](Request& r) -> auto& { return r.plan.prefix; })),
      called("-m",
             tried("remap", Kind::List, "RENAMING", "Topics under other names: /a:=/b ...",
                   [](Request& r, Texts texts) { r.plan.remap = parseTopicRenames(texts); })),
      member("tf_prefix", text("PREFIX"), "Before every frame's name: robot2",
             [](Request& r) -> auto& { return r.plan.rewriting.tf_prefix; }),
      row("remap_frame", list("RENAMING"), "Frames under other names: map:=odom ...",
          [](Request& r, Texts texts) { r.plan.rewriting.frames = parseRenames(texts); }),
      row("anchor", list("ANCHOR"),
          "Where light belongs: world (default: where it was, by the recording's tf) or body (by "
          "today's); for one topic: /topic=body",
          [](Request& r, Texts texts) {
            for (const std::string& anchor : texts) r.anchors.add(anchor);
          }),
      member("anchor_frame", text("FRAME"), "What stays where it is from then to now",
             [](Request& r) -> auto& { return r.anchors.frame; }),
  };
}

std::vector<PlayOption> theRobotsStart() {
  const auto start = [](Request& r) -> auto& { return r.body.start; };
  return {
      member("allow_motion", flag(), "The robot may move",
             [](Request& r) -> auto& { return r.allow_motion; }),
      choosing("to_start",
               "Move slowly to the start, first: the base, if it is less than a meter away, then "
               "arm, torso and gripper, by up to 0.2 rad or 2 cm, or as they were recorded on "
               "their way there",
               start, BodyOptions::Start::MoveThere),
      member("unchecked_approach", flag(),
             "Joints may go to the start, or after a seek, by up to 3.2 rad each and 8 rad in "
             "all, straight, though nobody has checked that way",
             [](Request& r) -> auto& { return r.body.accepts_unchecked; }),
      excluding("to_start",
                choosing("any_start",
                         "Begin wherever the robot stands; default: only where it stood", start,
                         BodyOptions::Start::Anywhere)),
      keyed<double>("start_tolerance", "TOLERANCE",
                    "How far it may stand from there: turning=RAD sliding=M gripper=M base=M "
                    "base_turn=RAD",
                    {{"turning", [](Request& r) -> auto& { return r.body.tolerances.turning; }},
                     {"sliding", [](Request& r) -> auto& { return r.body.tolerances.sliding; }},
                     {"gripper", [](Request& r) -> auto& { return r.body.tolerances.gripper; }},
                     {"base", [](Request& r) -> auto& { return r.body.tolerances.base; }},
                     {"base_turn",
                      [](Request& r) -> auto& { return r.body.tolerances.base_turn; }}},
                    [](const std::string& value) { return numberOf(value).value_or(-1) >= 0; }),
  };
}

/// Sets what a profile says, which holds where no other option, which are all set later, says more.
void setRobot(Request& request, const std::string& name_or_file) {
  const replay::RobotProfile robot = findRobotProfile(name_or_file);
  request.body.robot = robot;
  const replay::RobotProfile::Base& base = robot.base;
  request.body.base.is_holonomic = base.is_holonomic;
  replay::TrackFrames& frames = request.body.base.frames;
  if (!base.map_frame.empty()) frames.map = base.map_frame;
  if (!base.odom_frame.empty()) frames.odometry = base.odom_frame;
  if (!base.base_frame.empty()) frames.base = base.base_frame;
  EmergencyStopOptions& stop = request.body.stops.emergency_stop;
  static_cast<replay::RobotProfile::EmergencyStop&>(stop) = robot.emergency_stop;
  stop.profile = robot.name;
  ScanOptions& scan = request.body.base.scan;
  if (!base.footprint.empty()) scan.footprint = replay::Footprint::polygon(base.footprint);
  if (base.deceleration > 0) scan.obstacles.deceleration = base.deceleration;
}

std::vector<PlayOption> whichRobot() {
  return {
      row("robot", text("NAME|FILE"),
          "What is known of this robot: fetch, pr2, tiago, turtlebot3, ur, or a file "
          "(assets/README.md); default: nothing",
          [](Request& r, Texts texts) { setRobot(r, texts.front()); }),
      member("robot_namespace", text("NAMESPACE"),
             "Which of several robots it is: /robot2, where the recorded robot's topics and frames "
             "are found under its names; default: ROS's own namespace of this node, else as recorded",
             [](Request& r) -> auto& { return r.robot_namespace; }),
      member("any_map", flag(),
             "Another map than it was recorded on will do; default: base and light stay where they "
             "are",
             [](Request& r) -> auto& { return r.body.is_any_map_right; }),
  };
}

std::vector<PlayOption> theRobotsSafety() {
  return {
      row("limits", text("FILE"),
          "How fast it may move, a YAML file, where that is lower than what the robot's "
          "description and --robot say",
          [](Request& r, Texts texts) { r.body.limits = readLimits(texts.front()); }),
      tried("estop_topic", Kind::Value, "TOPIC[:FIELD]",
            "An emergency stop to obey: a boolean of messages of any type, true stops the robot "
            "(TOPIC:!FIELD: false does); default: the robot's by its profile; none",
            [](Request& r, Texts texts) { r.body.stops.emergency_stop.set(texts.front()); }),
      member("estop_longest_silence", range("SECONDS", 0.01, 60),
             "It has to be repeated within so many seconds, 0.01 to 60; default: within five of "
             "its periods, if it has one",
             [](Request& r) -> auto& { return r.body.stops.emergency_stop.longest_silence_s; }),
      tried("hold_to_run", Kind::Value, "TOPIC:BUTTON",
            "The robot moves only while somebody holds this button of a joystick, /joy:10",
            [](Request& r, Texts texts) { r.body.stops.hold_button.set(texts.front()); }),
      member("longest_stall", range("SECONDS", 0.04, 10),
             "Seconds the player may hang in motion before the watchdog stops the robot, 0.04 to "
             "10; default: 0.06 to 0.15, by how late and busy this machine is",
             [](Request& r) -> auto& { return r.body.longest_stall_s; }),
      row("rules", text("FILE"), "Rules for fields, topics and what stops them, a YAML file",
          [](Request& r, Texts texts) {
            const ReplayRules rules = readRules(texts.front());
            r.plan.rewriting.rules = rules.types;
            r.plan.rewriting.stops = rules.stops;
            r.plan.settled = rules.also;
          }),
      member("queue", range("COUNT", 1, 1'000'000, true),
             "Outgoing messages kept for each topic, 1 to 1000000",
             [](Request& r) -> auto& { return r.queue; }),
      member("realtime", flag(), "Do not try SCHED_FIFO",
             [](Request& r) -> auto& { return r.is_realtime; }),
  };
}

std::vector<PlayOption> theRobotsBase() {
  return {
      member("open_loop", flag(),
             "Send the base's velocities as they were recorded, wherever they lead; default: it is "
             "driven along its recorded poses, or refused",
             [](Request& r) -> auto& { return r.body.base.is_open_loop; }),
      member("odometry_only", flag(),
             "Without localization, then or now, follow the base's odometry from where it stands; "
             "default: it is refused",
             [](Request& r) -> auto& { return r.body.base.is_odometry_enough; }),
      member("keep_rate", flag(),
             "Refuse a drive that the base's limits make longer than the rate says; default: the "
             "rest waits for it",
             [](Request& r) -> auto& { return r.body.base.keeps_rate; }),
      member("base_topic", topic(), "Which of several velocity topics is the base's",
             [](Request& r) -> auto& { return r.body.base.topic; }),
      keyed<std::string>("base_frame", "FRAME",
                         "Frames as they were recorded: map=FRAME odom=FRAME base=FRAME",
                         {{"map", [](Request& r) -> auto& { return r.body.base.frames.map; }},
                          {"odom", [](Request& r) -> auto& { return r.body.base.frames.odometry; }},
                          {"base", [](Request& r) -> auto& { return r.body.base.frames.base; }}},
                         [](const std::string& value) { return !value.empty(); }),
      keyed<double>("localization_noise", "DEVIATION",
                    "How exactly localization knows the base, standard deviations: position=M "
                    "yaw=RAD",
                    {{"position", [](Request& r) -> auto& { return r.body.base.noise.position; }},
                     {"yaw", [](Request& r) -> auto& { return r.body.base.noise.yaw; }}},
                    [](const std::string& value) { return numberOf(value).value_or(0) > 0; }),
  };
}

std::vector<PlayOption> whatIsInTheWay() {
  return {
      member("scan", topic(),
             "What sees people and things in the base's way, sensor_msgs/LaserScan: the base stops "
             "before them and waits",
             [](Request& r) -> auto& { return r.body.base.scan.topic; }),
      excluding("scan", member("no_scan", flag(), "The base drives though nothing sees them",
                               [](Request& r) -> auto& { return r.body.base.scan.is_waived; })),
      member("obstacle_wait", seconds(),
             "Seconds the base waits for what stands in its way; then the replay stops",
             [](Request& r) -> auto& { return r.body.base.scan.obstacles.patience; }),
      member("clearance", range("METERS", 0, 2), "So much around the base is kept free, 0 to 2",
             [](Request& r) -> auto& { return r.body.base.scan.obstacles.clearance; }),
      tried("footprint", Kind::Value, "FOOTPRINT",
            "The base on the floor, in meters: a radius, or corners 'X,Y X,Y X,Y'; default: the "
            "robot's, or 0.4",
            [](Request& r, Texts texts) {
              r.body.base.scan.footprint = replay::parseFootprint(texts.front());
            }),
  };
}

std::vector<PlayOption> makeTable() {
  std::vector<PlayOption> table;
  const auto add = [&table](PlayGroup group, std::vector<PlayOption> options) {
    for (PlayOption& option : options) {
      option.group = group;
      table.push_back(std::move(option));
    }
  };
  add(PlayGroup::What, whatIsPlayed());
  add(PlayGroup::Part, whichPart());
  add(PlayGroup::How, howItIsPlayed());
  add(PlayGroup::InStep, inStep());
  add(PlayGroup::Listeners, whoListens());
  add(PlayGroup::Time, whoseTime());
  add(PlayGroup::Names, underWhichNames());
  add(PlayGroup::Robot, whichRobot());
  add(PlayGroup::Robot, theRobotsStart());
  add(PlayGroup::Robot, theRobotsSafety());
  add(PlayGroup::Robot, theRobotsBase());
  add(PlayGroup::Robot, whatIsInTheWay());
  return table;
}

// -------------------------------------------------------------------------------- what is given

/// "goal-wait" and "clock" are understood, too.
const PlayOption& optionOfGoal(const std::string& word) {
  std::string name = word;
  for (const FormerOption& former : formerOptions()) {
    if (name == former.name) {
      throw std::invalid_argument(name + " has become " + former.now + former.remark);
    }
  }
  const std::string alias = "--" + name;
  std::replace(name.begin(), name.end(), '-', '_');
  std::vector<std::string> names;
  for (const PlayOption& option : playOptions()) {
    if (option.name == name || option.aliases == alias) {
      if (option.group != PlayGroup::Robot) return option;
      throw std::invalid_argument(option.name + " is for the player's parameter ~" + option.name +
                                  ", not for a goal");
    }
    if (option.group != PlayGroup::Robot) names.push_back(option.name);
  }
  throw std::invalid_argument("a replay has no option '" + name + "'" +
                              replay::didYouMean(name, names));
}

}  // namespace

const char* titleOf(PlayGroup group) {
  constexpr const char* kTitles[] = {
      "What is played",
      "Which part of it",
      "How it is played",
      "In step with the body",
      "Who listens",
      "Whose time",
      "Under which names, and where light belongs",
      "The robot (for player_node by its parameters alone, not by a goal)"};
  return kTitles[static_cast<std::size_t>(group)];
}

const std::vector<PlayOption>& playOptions() {
  static const std::vector<PlayOption> table = makeTable();
  return table;
}

const std::vector<FormerOption>& formerOptions() {
  static const std::vector<FormerOption> former = {
      {"clear_projection", "keep_light", ", which is true where that was false"},
      {"namespace", "prefix", ""},
      {"paused", "pause", ""}};
  return former;
}

std::string complaintOf(const PlayOption& option, const std::string& text) {
  if (!option.complaint) return "";
  const bool is_list = option.kind == Kind::List;
  for (const std::string& each : is_list ? replay::splitAt(',', text) : OptionTexts{text}) {
    if (const std::string complaint = option.complaint(each); !complaint.empty()) return complaint;
  }
  return "";
}

void giveOption(ReplayRequest& request, const PlayOption& option, Texts texts) {
  if (option.kind != Kind::List && texts.size() != 1) {
    throw std::invalid_argument(option.name + ": one value is needed");
  }
  OptionTexts all;
  for (const std::string& text : texts) {
    if (const std::string complaint = complaintOf(option, text); !complaint.empty()) {
      throw std::invalid_argument(option.name + ": " + complaint);
    }
    const bool is_list = option.kind == Kind::List;
    const OptionTexts parts = is_list ? replay::splitAt(',', text) : OptionTexts{text};
    all.insert(all.end(), parts.begin(), parts.end());
  }
  option.set(request, all);
}

void giveGoalOptions(ReplayRequest& request, const std::vector<std::string>& options) {
  std::map<const PlayOption*, OptionTexts> given;  // in the table's order
  std::set<std::string> names;
  for (const std::string& text : options) {
    const std::size_t sign = text.find('=');
    const std::string name = text.substr(0, sign);
    const PlayOption& option = optionOfGoal(name);
    if (sign == std::string::npos && option.alone.empty()) {
      throw std::invalid_argument(option.name + " needs a value: " + option.name + "=" +
                                  option.value);
    }
    OptionTexts& texts = given[&option];
    if (option.kind != Kind::List && !texts.empty()) {
      throw std::invalid_argument(option.name + " is given twice");
    }
    texts.push_back(sign == std::string::npos ? option.alone : text.substr(sign + 1));
    if (texts.back() != "false") names.insert(option.name);
  }
  for (const auto& [option, texts] : given) {
    if (names.count(option->name) > 0 && names.count(option->excludes) > 0) {
      throw std::invalid_argument(option->name + " excludes " + option->excludes);
    }
    giveOption(request, *option, texts);
  }
}

}  // namespace afterglow::nodes
