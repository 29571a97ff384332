#include "nodes/verbs/command.hpp"

#include <fmt/format.h>
#include <ros/ros.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <future>
#include <iostream>
#include <memory>
#include <optional>
#include <set>
#include <stdexcept>

#include "calib/file_replacement.hpp"
#include "nodes/pages/replay_page.hpp"
#include "nodes/player/live_graph.hpp"
#include "nodes/player/media_sink.hpp"
#include "nodes/player/replay_session.hpp"
#include "nodes/player/watchdog.hpp"
#include "nodes/tools/stop_signal.hpp"
#include "nodes/verbs/play_command.hpp"
#include "nodes/verbs/replay_text.hpp"
#include "nodes/verbs/terminal_text.hpp"
#include "nodes/verbs/verb_node.hpp"
#include "nodes/verbs/verb_tools.hpp"
#include "replay/query/time_text.hpp"
#include "replay/store/open/open_store.hpp"

namespace afterglow::nodes {
namespace {

std::string rewritesOf(const replay::PlannedTopic& topic, const replay::AnchorSettings& anchors) {
  std::vector<std::string> texts;
  if (anchors.of(topic.channel) == replay::Anchor::World) {
    texts.push_back("frames but " + anchors.frame + ": where they were");
  }
  for (const replay::RewrittenField& field : topic.rewrites) {
    texts.push_back(fmt::format("{} {} ({})", field.path, describe(field.rule), field.count));
  }
  return fmt::format("{}", fmt::join(texts, "; "));
}

void printPlan(const replay::PlayPlan& plan, const replay::AnchorSettings& anchors) {
  using Align = TextTable::Align;
  TextTable table({{"topic", Align::Left},
                   {"messages", Align::Right},
                   {"class", Align::Left},
                   {"modality", Align::Left},
                   {"why", Align::Left}});
  for (const replay::PlannedTopic& topic : plan.topics) {
    const bool is_renamed = topic.isPlayed() && topic.output.topic != topic.channel.topic;
    table.add({topic.channel.topic + (is_renamed ? " as " + topic.output.topic : ""),
               std::to_string(topic.count), std::string(name(topic.topic_class)),
               topic.isPlayed() ? std::string(name(topic.modality)) : "-",
               (topic.isPlayed() ? "" : "not played: ") + reasonOf(topic)});
    if (topic.isPlayed()) {
      if (const std::string text = rewritesOf(topic, anchors); !text.empty()) {
        table.add({"", "", "", "", "rewritten: " + text});
      }
    }
  }
  std::cout << "behavior " << plan.behavior.id << " '" << plan.behavior.name << "', "
            << fmt::format("{:.3f} s\n", replay::PlaybackTime{plan.durationNs()}.seconds())
            << table.text("  ");
}

void printReport(const replay::PlayReport& report) {
  std::cout << replayText(report);
  for (const std::string& remark : replayRemarks(report)) {
    std::cerr << "afterglow play: " << remark << "\n";
  }
}

/// By the file's ending. JSON: of one replay, or an array of several.
std::string reportFile(const std::string& path, const std::vector<replay::PlayReport>& reports) {
  const std::string ending = std::filesystem::path(path).extension();
  if (ending == ".html") return replayPage(reports, replay::timeText(replay::wallNow()));
  std::string text;
  for (const replay::PlayReport& report : reports) {
    if (ending == ".txt") {
      text += replayText(report);
      if (!report.is_complete) text += "stopped: " + report.reason + "\n";
      for (const std::string& remark : replayRemarks(report)) text += "note: " + remark + "\n";
    } else {
      text += (text.empty() ? "" : ",\n") + reportJson(report, 2);
    }
  }
  return ending == ".txt" ? text : reports.size() == 1 ? text + "\n" : "[" + text + "]\n";
}

constexpr const char* kNodeName = "afterglow_play";

void startRos() {
  startVerbNode(kNodeName);
  catchShutdownRequests();
  ros::start();
  catchStopSignals();
}

/// False if no master answers.
bool hasLookedAround(ReplayRequest& request) {
  try {
    nameVerbNode(kNodeName);
    lookAround(request, deadlineIn(kMasterPatience));
    return true;
  } catch (const std::exception&) {  // a replay needs the master, and says so then
    return false;
  }
}

/// What a projector's layer would be played, if one runs.
bool dependsOnLayers(const replay::PlayPlan& plan) {
  return std::any_of(plan.topics.begin(), plan.topics.end(), [](const auto& topic) {
    const auto role = replay::roleOf(topic.output.topic, topic.output.type);
    return topic.is_nameable && role.topic_class == replay::TopicClass::Shown;
  });
}

replay::PlayReport play(ReplaySession& session, const PlayCommand& command) {
  Keyboard keyboard(!command.has_no_keys);
  const bool has_line = !command.is_quiet && isatty(STDERR_FILENO) != 0;
  if (has_line && keyboard.isActive()) std::cerr << kPlayKeys << "\n";
  auto playing = std::async(std::launch::async, [&session] { return session.run(); });
  std::string answer;
  for (int turn = 0; playing.wait_for(std::chrono::milliseconds(20)) != std::future_status::ready;
       ++turn) {
    if (isStopRequested() || !ros::ok()) {
      keyboard.release();  // a second signal ends the process at once
      session.stop("stopped by " + (ros::ok() ? stopRequest() : "the end of ROS here"));
    }
    if (const std::string key = keyboard.key(); !key.empty()) answer = followKey(key, session);
    if (has_line && turn % 5 == 0) {
      replaceLine(statusText(session) + "  " + answer);
    }
  }
  if (has_line) replaceLine("");
  return playing.get();
}

bool isId(const std::string& word) {
  return !word.empty() && word.size() < 19 &&
         std::all_of(word.begin(), word.end(),
                     [](unsigned char c) { return c >= '0' && c <= '9'; });
}

/// Several ids, or the words that name one behavior.
std::vector<std::int64_t> chosen(const replay::Store& store, const PlayCommand& command) {
  std::vector<std::int64_t> ids;
  const std::vector<std::string>& words = command.behaviors;
  if (std::all_of(words.begin(), words.end(), isId)) {
    for (const std::string& word : words)
      ids.push_back(findBehavior(store, command.store, {word}).id);
  } else {
    ids.push_back(findBehavior(store, command.store, words).id);
  }
  return ids;
}

/// Where a master answers.
bool isRobotGuarded(const replay::PlayPlan& plan) {
  try {
    const RosGraph graph = askMaster(deadlineIn(kMasterPatience));
    const bool is_on_ros2 = !ros2Listeners(graph, plan.motionTopics()).empty();
    return RobotGuard::isThere(graph, is_on_ros2 ? ros2WatchName() : robotGuardName());
  } catch (const std::exception&) {  // it answered just now
    return false;
  }
}

void showPlan(const replay::PlayPlan& plan, const ReplayRequest& request,
              const Rehearsal& rehearsal, bool is_json) {
  if (is_json) {
    nlohmann::ordered_json json = toJson(plan);
    json["refusals"] = rehearsal.refusals;
    json["unchecked"] = rehearsal.unchecked;
    if (!rehearsal.slowed.empty()) json["slowed"] = rehearsal.slowed;
    std::cout << dumpJson(json, 2) << "\n";
  } else {
    printPlan(plan, MediaPreparation::anchorsIn(plan, request.anchors));
  }
  std::vector<std::string> remarks = plan.warnings();
  const bool is_refused = std::any_of(plan.topics.begin(), plan.topics.end(), [](const auto& topic) {
    return topic.verdict == replay::Verdict::Refuse;
  });
  const bool is_told_below = is_refused || plan.playedTopics().empty();
  if (!is_told_below) remarks.push_back(plan.leftOutText());
  remarks.insert(remarks.end(), rehearsal.slowed.begin(), rehearsal.slowed.end());
  for (const std::string& refusal : rehearsal.refusals) {
    remarks.push_back("would be refused: " + refusal);
  }
  if (!rehearsal.unchecked.empty()) {
    remarks.push_back((request.plan.layers ? "not known yet: "
                                           : "not known, as no ROS master answers: ") +
                      fmt::format("{}", fmt::join(rehearsal.unchecked, "; ")));
  }
  if (!request.plan.layers && dependsOnLayers(plan)) {
    remarks.push_back("no ROS master answers: what a running projector would show is not known");
  }
  if (request.plan.layers && !plan.motionTopics().empty() && !isRobotGuarded(plan)) {
    remarks.push_back(kNoRobotGuard);
  }
  for (const std::string& remark : remarks) {
    if (!remark.empty()) std::cerr << "afterglow play: " << remark << "\n";
  }
}

/// One after the other, until one is refused or stopped: the result is why, empty if none was.
std::string playAll(const std::vector<std::unique_ptr<ReplaySession>>& sessions,
                    const PlayCommand& command, std::vector<replay::PlayReport>& reports) {
  try {
    for (const auto& session : sessions) {
      reports.push_back(play(*session, command));
      if (!reports.back().is_complete) return reports.back().reason;
    }
    return "";
  } catch (const std::exception& error) {
    return error.what();
  }
}

/// Where a master answers it listens to the robot, and sends nothing.
Rehearsal rehearse(ReplaySession& session, bool has_master) {
  return session.rehearse(has_master, [] { return isStopRequested() || !ros::ok(); });
}

void run(const PlayCommand& command) {
  ReplayRequest request = command.request();
  const auto store = replay::openStore(command.store, replay::OpenMode::ReadOnly);
  const bool has_master = hasLookedAround(request);
  if (command.is_dry_run && has_master) {
    startRos();
    printWarningsOnly();
  }
  std::vector<std::unique_ptr<ReplaySession>> sessions;  // all are looked at before one is played
  for (const std::int64_t id : chosen(*store, command)) {
    request.behavior = std::to_string(id);
    sessions.push_back(std::make_unique<ReplaySession>(*store, request));
    if (command.is_dry_run) {
      const Rehearsal rehearsal = rehearse(*sessions.back(), has_master);
      showPlan(countRewrites(*store, sessions.back()->plan(), request.clock), request, rehearsal,
               command.is_json);
    } else {
      sessions.back()->checkPlayable();
    }
  }
  if (command.is_dry_run) {
    if (has_master) ros::shutdown();
    return;
  }
  startRos();
  if (command.is_quiet) printWarningsOnly();
  std::vector<replay::PlayReport> reports;
  const std::string failure = playAll(sessions, command, reports);
  ros::shutdown();
  for (const replay::PlayReport& report : reports) {
    if (!command.is_quiet) printReport(report);
  }
  if (!command.report_file.empty() && !reports.empty()) {
    calib::replaceFile(command.report_file, reportFile(command.report_file, reports));
  }
  if (!failure.empty()) {
    throw std::runtime_error(failure);
  }
}

}  // namespace

void addPlayVerb(CLI::App& app) {
  const auto command = std::make_shared<PlayCommand>();
  CLI::App* verb = addVerb(app, "play");
  addPlayOptions(*verb, *command);
  verb->callback([command] { run(*command); });
}

}  // namespace afterglow::nodes

// The verbs that listen to the running robot, `afterglow play`, `record` and `watch`, and
// `afterglow ask`.
int main(int argc, char** argv) {
  using namespace afterglow::nodes;
  return runCommand(argc, argv,
                    {addAskVerb, addExampleVerb, addPlayVerb, addRecordVerb, addWatchVerb});
}
