#include "nodes/verbs/play_options.hpp"

#include <CLI/Error.hpp>
#include <cmath>
#include <filesystem>
#include <stdexcept>

#include "nodes/player/replay_words.hpp"
#include "nodes/verbs/body_options.hpp"
#include "nodes/verbs/verb_tools.hpp"

namespace afterglow::nodes {
namespace {

/// --wait-for-subscribers without seconds: until they are there.
constexpr const char* kForever = "31536000";

std::string atLeastZero(const std::string& text) {
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  return *end == 0 && value >= 0 && std::isfinite(value) ? "" : text + " is no number of seconds";
}

std::string aboveZero(const std::string& text) {
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  return *end == 0 && value > 0 && value <= 1000 ? "" : text + " is no number above 0, up to 1000";
}

std::string isReportFile(const std::string& text) {
  const std::string ending = std::filesystem::path(text).extension();
  const bool is_known = ending == ".json" || ending == ".txt" || ending == ".html";
  return is_known ? "" : text + " has to end with .json, .txt or .html";
}

/// A check that a parser of these words, which throws std::invalid_argument, does.
template <typename Parse>
CLI::Validator understood(const Parse& parse) {
  return CLI::Validator(
      [parse](std::string& text) -> std::string {
        try {
          parse(text);
          return "";
        } catch (const std::invalid_argument& error) {
          return error.what();
        }
      },
      "");
}

void addWhat(CLI::App& verb, PlayCommand& c) {
  replay::PlanOptions& plan = c.request.plan;
  verb.add_option("behavior", c.behaviors,
                  std::string(kBehaviorHelp) + "; several ids are played one after the other")
      ->required();
  verb.add_option("--only", c.request.only, "body,ar,speech: any of them; default all")
      ->check(understood(replay::parseModalities));
  verb.add_option("--topics", plan.topics, "Only these topics, whatever they are");
  verb.add_option("--also", plan.also,
                  "These topics as well: by itself only the body, and light and speech that "
                  "somebody asked for, are played");
  verb.add_flag("--everything", c.request.everything,
                "All but motion and control inputs, where no robot is live (so does --prefix)");
  verb.add_option("--exclude", plan.exclude, "All but these topics");
  verb.add_option("-e,--regex", plan.regex, "Only topics whose whole name matches");
  verb.add_option("-x,--exclude-regex", plan.exclude_regex, "All but topics whose name matches");
  verb.add_option("-s,--start", plan.start_s, "Begin so many seconds into the behavior")
      ->check(atLeastZero);
  verb.add_option("-u,--duration", c.duration_s, "Play so many seconds of it")->check(aboveZero);
  verb.add_option("--until", c.until_s, "Play until so many seconds into it")->check(aboveZero);
}

void addHow(CLI::App& verb, PlayCommand& c) {
  replay::PlayOptions& play = c.request.options;
  verb.add_option("-r,--rate", play.rate,
                  "Speed; velocities and trajectories go with it (0.1 to 10 for the body)")
      ->check(aboveZero);
  verb.add_flag("-l,--loop", play.is_looping, "Again and again (light and speech only)");
  verb.add_flag("-i,--immediate", play.is_immediate, "All at once (light and speech only)");
  verb.add_flag("--pause", play.starts_paused, "Start paused");
  verb.add_option("--skip-empty", c.skip_empty_s,
                  "Play so many seconds of each time without messages")
      ->check(aboveZero);
  verb.add_option("--pause-topics", c.pause_topics, "Pause before each message on these topics");
  verb.add_option("--latency", c.latency,
                  "Send what takes effect late so many seconds earlier: ar=0.05,speech=0.2")
      ->check(understood([](const std::string& text) { replay::parseLatency({text}); }));
  verb.add_option("--on-failure", c.on_failure,
                  "stop or go_on when a modality fails; default body=stop,ar=go_on,speech=go_on")
      ->check(understood([](const std::string& text) { replay::parseOnFailure({text}); }));
  verb.add_option("--goal-wait", play.goal_wait_s,
                  "Seconds a goal may take longer than it did when it was recorded; default 10")
      ->check(atLeastZero);
  verb.add_flag("!--ungated", play.is_in_step, "Light and speech do not wait for the body");
  verb.add_flag("-k,--keep-alive", play.keeps_alive, "Stay at the end, with the light on");
  verb.add_flag("--keep-light", c.keeps_light, "Leave the light on when it ends");
  verb.add_option("--seek-lead", play.seek_lead_s,
                  "After a seek: seconds the arm has to get to where it goes on; default 5")
      ->check(atLeastZero);
}

void addListeners(CLI::App& verb, PlayCommand& c) {
  verb.add_option("-d,--delay", c.request.delay_s, "Wait so many seconds before the first message")
      ->check(atLeastZero);
  verb.add_option("--wait-for-subscribers", c.request.wait_for_subscribers_s,
                  "Seconds to wait for somebody to listen on every topic; alone: until they do; "
                  "default 2")
      ->check(atLeastZero)
      ->expected(0, 1)
      ->default_str(kForever);
  verb.add_option("--unheard", c.unheard,
                  "If nobody listens on a topic by then: start (default, and told) or abort")
      ->check(CLI::IsMember({"start", "abort"}));
  auto* consumer = verb.add_option("--rate-control-topic", c.request.rate_control.topic,
                                   "Wait until this topic's header stamps have come as far as what "
                                   "was played, but for the longest delay (light and speech only)");
  verb.add_option("--rate-control-max-delay", c.request.rate_control.longest_delay_s,
                  "That delay in seconds; default 1")
      ->check(atLeastZero)
      ->needs(consumer);
  verb.add_option("--queue", c.request.queue, "Outgoing messages kept for each topic; default 100")
      ->check(CLI::Range(1, 1'000'000));
}

void addClock(CLI::App& verb, PlayCommand& c) {
  auto* sim = verb.add_flag("--sim,--clock", c.is_sim,
                            "Give the recording's time on /clock; stamps stay as they were");
  verb.add_option("--hz", c.request.clock_hz, "How often a second; default 100")
      ->check(aboveZero)
      ->needs(sim);
  verb.add_flag("--follow-clock", c.follows_clock, "Go, wait and pause as another node's /clock")
      ->excludes(sim);
  verb.add_flag("--no-realtime", c.is_normal, "Do not try SCHED_FIFO");
}

void addNames(CLI::App& verb, PlayCommand& c) {
  verb.add_option("-p,--prefix", c.prefix, "Before every topic's name");
  verb.add_option("--namespace", c.rename_space, "Another robot's: before every topic's name");
  verb.add_option("-m,--remap", c.remap, "Topics under other names: /a:=/b ...");
  verb.add_option("--tf-prefix", c.request.plan.rewriting.tf_prefix,
                  "Before every frame's name: robot2");
  verb.add_option("--remap-frame", c.remap_frame, "Frames under other names: map:=odom ...");
  verb.add_option("--anchor", c.anchors,
                  "Where light belongs: world (default: where it was, by the recording's tf) or "
                  "body (by today's); for one topic: /topic=body");
  verb.add_option("--anchor-frame", c.request.anchors.frame,
                  "What stays where it is from then to now; default map");
  verb.add_option("--rules", c.rules_file, "Rewriting rules by type and field, a YAML file");
}

}  // namespace

void addPlayOptions(CLI::App& verb, PlayCommand& c) {
  addStoreOption(verb, c.store);
  addWhat(verb, c);
  addHow(verb, c);
  addListeners(verb, c);
  addClock(verb, c);
  addNames(verb, c);
  verb.add_flag("--allow-motion", c.request.allow_motion, "The robot may move");
  addBodyOptions(verb, c.request.body);
  verb.add_option("--limits", c.limits_file,
                  "How fast it may move, a YAML file; default: a Fetch's, or as fast as it did");
  auto* dry_run = verb.add_flag("--dry-run", c.is_dry_run, "Show the plan; needs no ROS master");
  verb.add_flag("--json", c.is_json, "The plan of --dry-run as JSON")->needs(dry_run);
  verb.add_option("--report", c.report_file,
                  "Write what was measured: FILE.json, FILE.txt or, with plots, FILE.html")
      ->check(isReportFile);
  verb.add_flag("-q,--quiet", c.is_quiet, "No status line, no table at the end");
  verb.add_flag("!--no-keys", c.has_keys, "Leave the keyboard alone");
}

void readPlayOptions(PlayCommand& c) {
  const auto given = [](double value) {
    return value == 0 ? std::nullopt : std::optional<double>(value);
  };
  c.request.clock = c.is_sim          ? ReplayClock::Sim
                    : c.follows_clock ? ReplayClock::Follow
                                      : ReplayClock::Live;
  c.request.is_realtime = !c.is_normal;
  c.request.needs_subscribers = parseUnheard(c.unheard);
  if (!c.limits_file.empty()) c.request.limits = readLimits(c.limits_file);
  replay::PlanOptions& plan = c.request.plan;
  plan.duration_s = given(c.duration_s);
  plan.until_s = given(c.until_s);
  plan.prefix = c.rename_space + c.prefix;
  plan.remap = parseRenames(c.remap);
  plan.rewriting.frames = parseRenames(c.remap_frame);
  if (!c.rules_file.empty()) {
    const ReplayRules rules = readRules(c.rules_file);
    plan.rewriting.rules = rules.types;
    plan.settled = rules.also;
  }
  for (const std::string& anchor : c.anchors) c.request.anchors.add(anchor);
  replay::PlayOptions& play = c.request.options;
  play.latency_s = replay::parseLatency(c.latency);
  play.on_failure = replay::parseOnFailure(c.on_failure);
  play.clear_projection = !c.keeps_light;
  play.skip_empty_s = given(c.skip_empty_s);
  play.pause_topics = {c.pause_topics.begin(), c.pause_topics.end()};
}

}  // namespace afterglow::nodes
