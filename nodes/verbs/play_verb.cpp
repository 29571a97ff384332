#include "nodes/verbs/play_verb.hpp"

#include <ros/network.h>
#include <ros/ros.h>

#include <CLI/Error.hpp>
#include <cstdlib>
#include <fstream>
#include <future>
#include <iostream>
#include <memory>
#include <stdexcept>

#include "nodes/player/replay_session.hpp"
#include "nodes/player/stop_signal.hpp"
#include "nodes/verbs/verb_tools.hpp"

namespace afterglow::nodes {
namespace {

struct Options {
  std::string store, report_file;
  std::vector<std::string> behavior;
  ReplayRequest request;
  bool is_dry_run = false;
};

std::string rewritesOf(const replay::PlannedTopic& topic) {
  std::string text;
  for (const replay::RewrittenField& field : topic.rewrites) {
    text += (text.empty() ? "" : "; ") + field.path + " " + std::string(describe(field.rule));
  }
  return text;
}

void printPlan(const replay::PlayPlan& plan) {
  using Align = TextTable::Align;
  TextTable table({{"topic", Align::Left},
                   {"messages", Align::Right},
                   {"modality", Align::Left},
                   {"rewritten", Align::Left}});
  for (const replay::PlannedTopic& topic : plan.topics) {
    table.add({topic.channel.topic, std::to_string(topic.count),
               topic.isPlayed() ? std::string(name(topic.modality)) : "-",
               topic.isPlayed() ? rewritesOf(topic) : "not played: " + topic.why_not});
  }
  std::cout << "behavior " << plan.behavior.id << " '" << plan.behavior.name << "', "
            << fixedText(replay::PlaybackTime{plan.durationNs()}.seconds(), 3) << " s\n"
            << table.text("  ");
}

void printReport(const replay::PlayReport& report) {
  using Align = TextTable::Align;
  TextTable table({{"topic", Align::Left},
                   {"planned", Align::Right},
                   {"published", Align::Right},
                   {"skipped", Align::Right},
                   {"late p50 ms", Align::Right},
                   {"p99", Align::Right},
                   {"max", Align::Right}});
  const auto ms = [](std::int64_t ns) { return fixedText(static_cast<double>(ns) * 1e-6, 3); };
  for (const auto& [topic, played] : report.topics) {
    if (topic.isPlayed()) {
      table.add({topic.channel.topic, std::to_string(topic.count), std::to_string(played.published),
                 std::to_string(played.skipped), ms(played.lateness.quantile(0.5)),
                 ms(played.lateness.quantile(0.99)), ms(played.lateness.max())});
    }
  }
  std::cout << table.text();
  for (const std::string& note : report.notes) {
    std::cerr << "afterglow play: " << note << "\n";
  }
}

void writeReport(const std::string& path, const replay::PlayReport& report) {
  std::ofstream file(path, std::ios::trunc);
  file << dumpJson(toJson(report), 2) << "\n";
  if (!file.flush()) {
    throw std::runtime_error(path + ": cannot be written");
  }
}

void startRos() {
  setenv("ROS_MASTER_URI", "http://localhost:11311", 0);  // roscpp ends the process without it
  std::string host;
  std::uint32_t port = 0;
  if (!ros::network::splitURI(getenv("ROS_MASTER_URI"), host, port)) {
    throw std::runtime_error(std::string("ROS_MASTER_URI is no URI: ") + getenv("ROS_MASTER_URI"));
  }
  int argc = 0;
  ros::init(argc, nullptr, "afterglow_play",
            ros::init_options::NoSigintHandler | ros::init_options::AnonymousName |
                ros::init_options::NoRosout);
  askMaster(deadlineIn(kMasterPatience));
  ros::start();
  catchStopSignals();
}

replay::PlayReport play(ReplaySession& session) {
  auto playing = std::async(std::launch::async, [&session] { return session.run(); });
  while (playing.wait_for(std::chrono::milliseconds(20)) != std::future_status::ready) {
    if (isStopRequested() || !ros::ok()) {
      session.stop("stopped by a signal");
    }
  }
  return playing.get();
}

void run(const Options& options) {
  const auto store = replay::openStore(options.store, replay::OpenMode::ReadOnly);
  ReplayRequest request = options.request;
  request.behavior_id = findBehavior(*store, options.store, options.behavior).id;
  ReplaySession session(*store, request);
  if (options.is_dry_run) {
    printPlan(session.plan());
    return;
  }
  session.checkMotionAllowed();
  startRos();
  const replay::PlayReport report = play(session);
  ros::shutdown();
  if (!options.report_file.empty()) {
    writeReport(options.report_file, report);
  }
  printReport(report);
  if (!report.is_complete) {
    throw std::runtime_error(report.reason);
  }
}

std::string positiveNumber(const std::string& text) {
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  return *end == 0 && value > 0 && value <= 1000 ? "" : text + " is no number above 0";
}

}  // namespace

void addPlayVerb(CLI::App& app) {
  const auto options = std::make_shared<Options>();
  CLI::App* verb = app.add_subcommand("play", "Replay a behavior into the running robot");
  addStoreOption(*verb, options->store);
  ReplayRequest& request = options->request;
  verb->add_option("behavior", options->behavior, kBehaviorHelp)->required();
  verb->add_option("--only", request.only, "body,ar,speech: any of them; default all")
      ->check([](const std::string& text) -> std::string {
        try {
          replay::parseModalities(text);
          return "";
        } catch (const std::invalid_argument& error) {
          return error.what();
        }
      });
  verb->add_option("--rate", request.options.rate, "Speed, for ar and speech only; default 1")
      ->check(positiveNumber);
  verb->add_flag("--allow-motion", request.allow_motion, "The robot may move");
  verb->add_flag("--dry-run", options->is_dry_run, "Show the plan; needs no ROS master");
  verb->add_option("--report", options->report_file, "Write what was measured, as JSON");
  verb->callback([options] { run(*options); });
}

}  // namespace afterglow::nodes
