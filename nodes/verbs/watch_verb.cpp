#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <unistd.h>

#include <boost/function.hpp>
#include <chrono>
#include <iostream>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "nodes/tools/ros_graph.hpp"
#include "nodes/tools/stop_signal.hpp"
#include "nodes/verbs/command.hpp"
#include "nodes/verbs/terminal_text.hpp"
#include "nodes/verbs/verb_node.hpp"
#include "nodes/verbs/verb_tools.hpp"
#include "nodes/verbs/watch_view.hpp"

namespace afterglow::nodes {
namespace {

using Level = WatchLine::Level;

/// Two words of nodes that say something once a second: rates are known then.
constexpr double kOnceSeconds = 2.6;
constexpr double kRefreshSeconds = 0.5, kAskSeconds = 2;

std::int64_t watchTime() {
  const auto now = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::nanoseconds>(now).count();
}

/// Listens to /diagnostics and to every player that the master knows.
class Watch {
 public:
  Watch() {
    diagnostics_ = nh_.subscribe<diagnostic_msgs::DiagnosticArray>(
        "/diagnostics", 100, [this](const diagnostic_msgs::DiagnosticArrayConstPtr& message) {
          view_.take(*message, watchTime());
        });
    findPlayers();
  }

  void listen(double seconds) {
    const Deadline until = deadlineIn(seconds);
    while (std::chrono::steady_clock::now() < until && ros::ok() && !isStopRequested()) {
      ros::getGlobalCallbackQueue()->callAvailable(ros::WallDuration(0.05));
    }
  }

  /// Players that have come since; whether the master answers becomes a line.
  void findPlayers() {
    asked_at_ = std::chrono::steady_clock::now();
    is_master_there_ = true;
    try {
      for (const auto& [topic, type] : askTopicTypes(deadlineIn(kMasterPatience))) {
        if (type == "afterglow/ReplayStatus" && players_.count(topic) == 0) listenTo(topic);
      }
    } catch (const std::exception&) {
      is_master_there_ = false;
    }
  }
  void findPlayersNowAndThen() {
    const std::chrono::duration<double> since = std::chrono::steady_clock::now() - asked_at_;
    if (since.count() > kAskSeconds) findPlayers();
  }

  std::vector<WatchLine> lines() const {
    std::vector<WatchLine> lines = view_.lines(watchTime());
    if (!is_master_there_) {
      lines.push_back({"ROS master", Level::Error,
                       "does not answer at " + ros::master::getURI(), {}});
    } else if (lines.empty()) {
      lines.push_back({"Afterglow", Level::Warning,
                       "no projector_node, recorder_node or player_node says anything", {}});
    }
    return lines;
  }

 private:
  void listenTo(const std::string& topic) {
    const std::string node = topic.substr(1, topic.rfind('/') - 1);
    const boost::function<void(const ReplayStatusConstPtr&)> take =
        [this, node](const ReplayStatusConstPtr& status) {
          view_.take(node, *status, watchTime());
        };
    players_[topic] = nh_.subscribe<ReplayStatus>(topic, 10, take);
  }

  ros::NodeHandle nh_;
  WatchView view_;
  ros::Subscriber diagnostics_;
  std::map<std::string, ros::Subscriber> players_;  ///< players by topic
  std::chrono::steady_clock::time_point asked_at_;
  bool is_master_there_ = true;
};

std::size_t faultsIn(const std::vector<WatchLine>& lines) {
  std::size_t faults = 0;
  for (const WatchLine& line : lines) faults += line.level == Level::Ok ? 0 : 1;
  return faults;
}

nlohmann::ordered_json toJson(const WatchLine& line) {
  static const char* const kLevels[] = {"ok", "warning", "error"};
  nlohmann::ordered_json json;
  json["name"] = line.name;
  json["level"] = kLevels[static_cast<int>(line.level)];
  json["text"] = line.text;
  json["values"] = line.values;
  return json;
}

nlohmann::ordered_json toJson(const std::vector<WatchLine>& lines) {
  nlohmann::ordered_json json;
  json["ok"] = faultsIn(lines) == 0;
  json["lines"] = nlohmann::ordered_json::array();
  for (const WatchLine& line : lines) json["lines"].push_back(toJson(line));
  return json;
}

void runOnce(Watch& watch, bool is_json) {
  watch.listen(kOnceSeconds);
  const std::vector<WatchLine> lines = watch.lines();
  if (is_json) {
    std::cout << dumpJson(toJson(lines), 2) << "\n";
  } else {
    for (const WatchLine& line : lines) std::cout << line.words() << "\n";
  }
  const std::size_t faults = faultsIn(lines);
  if (faults > 0) {
    throw std::runtime_error(std::to_string(faults) + " of " + std::to_string(lines.size()) +
                             (lines.size() == 1 ? " is" : " are") + " not well");
  }
}

/// Until it is interrupted. On a terminal all lines in place; else those that changed, in more than
/// their numbers.
void runLive(Watch& watch, bool is_json) {
  const bool is_screen = !is_json && isatty(STDOUT_FILENO) != 0;
  std::size_t shown = 0;
  std::map<std::string, std::string> kinds;
  watch.listen(kOnceSeconds);
  while (ros::ok() && !isStopRequested()) {
    std::vector<std::string> screen;
    for (const WatchLine& line : watch.lines()) {
      screen.push_back(line.words());
      std::string& before = kinds[line.name];
      const bool is_news = before != line.kind();
      before = line.kind();
      if (is_screen || !is_news) continue;
      std::cout << (is_json ? dumpJson(toJson(line)) : line.words()) << std::endl;
    }
    if (is_screen) shown = replaceLines(screen, shown);
    watch.listen(kRefreshSeconds);
    watch.findPlayersNowAndThen();
  }
}

struct WatchOptions {
  bool json = false, once = false;
};

void runWatch(const WatchOptions& options) {
  startVerbNode("afterglow_watch");
  catchStopSignals();
  Watch watch;
  if (options.once) {
    runOnce(watch, options.json);
  } else {
    runLive(watch, options.json);
  }
}

}  // namespace

void addWatchVerb(CLI::App& app) {
  const auto options = std::make_shared<WatchOptions>();
  CLI::App* verb = addVerb(app, "watch");
  verb->add_flag("--once", options->once,
                 "Listen for three seconds, say it and end: exit status 0 if all is well, 1 if "
                 "anything is not");
  verb->add_flag("--json", options->json,
                 "As JSON: {name, level: ok|warning|error, text, values}, one a line when it "
                 "changes; with --once {ok, lines: [...]}");
  verb->callback([options] { runWatch(*options); });
}

}  // namespace afterglow::nodes
