#include <afterglow/StartRecording.h>
#include <afterglow/StopRecording.h>
#include <diagnostic_msgs/DiagnosticArray.h>
#include <fmt/format.h>
#include <ros/ros.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <map>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <thread>
#include <utility>

#include "nodes/behavior_trees/include/afterglow/recorder_client.hpp"
#include "nodes/recorder/recorder_node.hpp"
#include "nodes/tools/diagnostics.hpp"
#include "nodes/tools/program.hpp"
#include "nodes/tools/ros_graph.hpp"
#include "nodes/tools/stop_signal.hpp"
#include "nodes/verbs/command.hpp"
#include "nodes/verbs/verb_node.hpp"
#include "nodes/verbs/verb_tools.hpp"
#include "replay/bags/bag_file.hpp"
#include "replay/messages/text.hpp"
#include "replay/query/time_text.hpp"
#include "replay/record/disk_guard.hpp"
#include "replay/store/open/open_store.hpp"
#include "replay/store/store.hpp"

namespace afterglow::nodes {
namespace {

struct RecordOptions {
  RecordingOptions asked;
  std::string store, outcome;
  std::string file, file_prefix;     ///< -O, -o; empty: no file
  std::vector<std::string> words;    ///< topics
  std::vector<std::string> command;  ///< words behind "--"
  double duration_s = 0;             ///< 0: no end
};

/// A recorder's services, on connections that outlive the master.
class RecordCalls {
 public:
  explicit RecordCalls(const std::string& node)
      : start_(nh_.serviceClient<StartRecording>(node + "/start_recording", true)),
        stop_(nh_.serviceClient<StopRecording>(node + "/stop_recording", true)) {}

  StartRecording::Response start(const RecordingOptions& asked) {
    StartRecording call;
    copyRecordingFields(asked, call.request);
    return answer(start_, call);
  }
  StopRecording::Response stop(std::int64_t id, const std::string& outcome) {
    StopRecording call;
    call.request.behavior_id = id;
    call.request.outcome = outcome;
    return answer(stop_, call);
  }

 private:
  template <typename Call>
  typename Call::Response answer(ros::ServiceClient& client, Call& call) {
    if (!client.call(call)) throw std::runtime_error("the recorder gives no answer");
    if (!call.response.success) throw std::runtime_error(call.response.message);
    return call.response;
  }

  ros::NodeHandle nh_;
  ros::ServiceClient start_, stop_;
};

/// A recorder's own words on /diagnostics.
class RecorderWords {
 public:
  explicit RecorderWords(const std::string& node) : name_(node.substr(1) + ": recorder") {
    subscriber_ = nh_.subscribe<diagnostic_msgs::DiagnosticArray>(
        "/diagnostics", 10, [this](const diagnostic_msgs::DiagnosticArrayConstPtr& array) {
          for (const auto& status : array->status) {
            if (status.name == name_) take(status);
          }
        });
  }

  /// "812 messages with their context, 204.1 a second, 0 lost; ready", since the first that was
  /// heard.
  std::string text() {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (newest_.values.empty()) return "";
    const bool is_well = newest_.level == diagnostic_msgs::DiagnosticStatus::OK;
    return fmt::format("{} messages with their context, {} a second, {} lost{}", since("messages"),
                       newest_.value("messages_per_s"), since("dropped"),
                       is_well || newest_.message.empty() ? "" : "; " + newest_.message);
  }
  /// Returns how many messages it has stored on a topic that the behavior's request named.
  std::uint64_t storedOn(std::int64_t behavior, const std::string& topic) {
    const std::lock_guard<std::mutex> lock(mutex_);
    const std::string key = "behavior " + std::to_string(behavior) + " " + topic;
    return static_cast<std::uint64_t>(newest_.number(key));
  }
  /// Returns true if it ended what it recorded by itself: its disk is full, its store fails.
  bool isCutShort() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return has_run_ && newest_.value("behaviors") == "0";
  }
  std::string store() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return newest_.value("store");
  }

 private:
  void take(const diagnostic_msgs::DiagnosticStatus& status) {
    const std::lock_guard<std::mutex> lock(mutex_);
    newest_ = HeardStatus(status);
    if (first_.values.empty()) first_ = newest_;
    if (newest_.value("behaviors") != "0") has_run_ = true;
  }
  std::uint64_t since(const std::string& key) const {
    return static_cast<std::uint64_t>(std::max(0.0, newest_.number(key) - first_.number(key)));
  }

  const std::string name_;
  std::mutex mutex_;
  HeardStatus newest_, first_;
  bool has_run_ = false;
  ros::NodeHandle nh_;
  ros::Subscriber subscriber_;  ///< last: its callbacks use all of the above
};

/// The program that is the behavior. Ctrl-C in a terminal reaches it by itself.
class BehaviorProgram {
 public:
  explicit BehaviorProgram(const std::vector<std::string>& command) {
    if (command.empty()) return;
    ProgramStart start;
    start.input = start.output = start.error = ProgramStart::kOurs;
    pid_ = startProgram(command, start);
  }
  BehaviorProgram(const BehaviorProgram&) = delete;
  BehaviorProgram& operator=(const BehaviorProgram&) = delete;
  ~BehaviorProgram() { end(); }

  bool isThere() const { return pid_ > 0; }
  bool hasEnded() {
    int status = 0;
    if (pid_ > 0 && ::waitpid(pid_, &status, WNOHANG) == pid_) {
      pid_ = -1;
      status_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    }
    return status_ >= 0;
  }
  int status() const { return status_; }
  /// Asks it to, ever more firmly.
  void end() {
    const bool knows = isatty(STDIN_FILENO) != 0 && isStopRequested();
    for (const int number : {knows ? 0 : SIGINT, SIGTERM, SIGKILL}) {
      if (pid_ <= 0) return;
      ::kill(pid_, number);
      for (const Deadline until = deadlineIn(5); !hasEnded() && Deadline::clock::now() < until;) {
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
      }
    }
  }

 private:
  pid_t pid_ = -1;
  int status_ = -1;
};

void startRecordRos() {
  startVerbNode("afterglow_record");
  catchShutdownRequests();
  catchStopSignals(SecondSignal::IsIgnored);
  printWarningsOnly();
}

/// The recorder_node that runs in this namespace: another records another robot. Empty: none does.
std::string runningRecorder() {
  const std::string ending = "/start_recording";
  const std::string own = rosNamespace();
  for (const auto& [service, nodes] : askMaster(deadlineIn(kMasterPatience)).services) {
    const bool is_start = replay::endsWith(service, ending);
    const std::string node = is_start ? service.substr(0, service.size() - ending.size()) : "";
    const bool is_own = ros::names::parentNamespace(node) == (own.empty() ? "/" : own);
    const bool is_other = node.rfind(own + "/afterglow_record_", 0) != 0;  // ends with its behavior
    if (is_start && is_own && is_other && isAlive(node, deadlineIn(1))) return node;
  }
  return "";
}

std::string diskText(const std::string& store) {
  if (store.rfind("sqlite:", 0) != 0) return "";
  const auto free = replay::freeBytes(replay::storePath(store));
  return free ? fmt::format("; {:.1f} GB free", static_cast<double>(*free) * 1e-9) : "";
}

/// Tells each second what comes: a line for all, and one for each named topic.
class LiveLines {
 public:
  LiveLines(RecorderWords& words, std::int64_t behavior, const std::vector<std::string>& topics)
      : words_(words), behavior_(behavior), topics_(topics) {}

  void tell(double seconds) {
    const std::string text = words_.text();
    if (text.empty()) return;
    std::string lines = fmt::format("{:.0f} s: {}{}\n", seconds, text, diskText(words_.store()));
    for (const std::string& topic : topics_) lines += topicLine(topic, seconds - told_s_);
    told_s_ = seconds;
    std::cerr << lines;
  }

 private:
  std::string topicLine(const std::string& topic, double passed_s) {
    const std::uint64_t now = words_.storedOn(behavior_, topic);
    const std::uint64_t before = std::exchange(stored_[topic], now);
    if (now == 0) return "  " + topic + ": nothing yet\n";
    const double rate = static_cast<double>(now - std::min(now, before)) / passed_s;
    return fmt::format("  {}: {} messages, {:.1f} a second\n", topic, now, rate);
  }

  RecorderWords& words_;
  const std::int64_t behavior_;
  const std::vector<std::string>& topics_;
  std::map<std::string, std::uint64_t> stored_;
  double told_s_ = 0;
};

/// Returns the behavior's outcome when it has ended.
std::string awaitEnd(const RecordOptions& options, BehaviorProgram& program, RecorderWords& words,
                     LiveLines lines) {
  const auto begin = std::chrono::steady_clock::now();
  const auto seconds = [&] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  };
  double told_s = 0;
  while (ros::ok() && !isStopRequested()) {
    if (program.hasEnded()) return program.status() == 0 ? "success" : "failure";
    if (words.isCutShort()) return "";
    if (options.duration_s > 0 && seconds() >= options.duration_s) return "";
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    if (seconds() < told_s + 1) continue;
    told_s = seconds();
    lines.tell(told_s);
  }
  return "";
}

void tellEnd(const StopRecording::Response& ended, const std::string& store) {
  for (const std::string& remark : ended.remarks) {
    std::cerr << "afterglow record: " << remark << "\n";
  }
  if (!ended.silent_topics.empty()) {
    std::cerr << fmt::format("afterglow record: nothing on {}\n",
                             fmt::join(ended.silent_topics, ", "));
  }
  if (!ended.kept) {
    std::cout << "nothing is kept: --keep-if does not name its outcome\n";
    return;
  }
  std::cout << "behavior " << ended.behavior_id << ": " << ended.messages << " messages, "
            << ended.dropped << " lost; afterglow show " << ended.behavior_id
            << (store.empty() ? "" : " --store " + store) << "\n";
}

/// The end of a recording.
struct Recorded {
  std::int64_t id = 0;
  bool is_kept = false;
  std::string store;    ///< its URI
  std::string failure;  ///< why the command failed; empty: it did not
};

/// Records by the recorder of that name.
Recorded recordBehavior(const RecordOptions& options, const std::string& node) {
  RecorderWords words(node);
  RecordCalls calls(node);
  const StartRecording::Response started = calls.start(options.asked);
  if (!started.message.empty()) std::cerr << "afterglow record: " << started.message << "\n";
  const std::int64_t id = started.behavior_id;
  std::cerr << "recording behavior " << id << " '" << options.asked.name << "' by " << node
            << (options.command.empty() ? "; Ctrl-C ends it\n" : "\n");
  std::string outcome = "failure";
  std::string failure;
  int status = 0;
  try {
    BehaviorProgram program(options.command);
    outcome = awaitEnd(options, program, words, {words, id, options.asked.topics});
    program.end();
    status = std::max(0, program.status());
  } catch (const std::exception& error) {  // the command cannot be started
    failure = error.what();
  }
  const bool is_chosen = !options.outcome.empty() && failure.empty();
  const StopRecording::Response ended = calls.stop(id, is_chosen ? options.outcome : outcome);
  const std::string store = options.store.empty() ? words.store() : replay::storeUri(options.store);
  tellEnd(ended, store);
  if (failure.empty() && status != 0 && outcome == "failure") {
    failure = "the command ended with status " + std::to_string(status);
  }
  return {id, ended.kept != 0, store, failure};
}

/// Records by a recorder in this process, without one that runs.
Recorded recordAlone(const RecordOptions& options) {
  RecorderNodeOptions own;
  own.store = options.store;
  own.mongodb_logger = false;
  own.space_advice = "make room, or name a store on another disk by --store";
  RecorderNode node(own);
  const auto finish = [&node] {
    node.close();
    const std::string rest = node.sendRest();
    if (!rest.empty()) std::cerr << "afterglow record: " << rest << "\n";
  };
  try {
    const Recorded recorded = recordBehavior(options, ros::this_node::getName());
    finish();
    return recorded;
  } catch (...) {
    finish();
    throw;
  }
}

/// Writes what was recorded into a file, too.
void writeFile(const std::string& path, const Recorded& recorded) {
  const auto store = replay::openStore(recorded.store, replay::OpenMode::ReadOnly);
  const auto behavior = store->behavior(recorded.id);
  if (!behavior)
    throw std::runtime_error(path + " is not written: behavior " + std::to_string(recorded.id) +
                             " is not in " + recorded.store);
  forgetStopRequest();  // Ctrl-C ended the recording
  Progress progress("writing " + path);
  replay::BagExport bag;
  bag.format = replay::formatOfFile(path);
  bag.progress = [&](auto done, auto total) { progress.update(done, total); };
  const auto written = replay::exportBags(*store, {*behavior}, {}, path, bag);
  std::cout << path << ": " << replay::counted(written.messages, "message") << ", "
            << sizeText(std::filesystem::file_size(path)) << "\n";
}

/// Names the file and the behavior as rosbag record names its file.
void nameRecording(RecordOptions& options) {
  namespace fs = std::filesystem;
  const replay::TimeParts now = replay::timeParts(replay::wallNow());
  std::string time = now.day + "-" + now.clock;
  std::replace(time.begin(), time.end(), ':', '-');
  const std::string& prefix = options.file_prefix;
  if (!prefix.empty()) options.file = prefix + (prefix.back() == '/' ? "" : "_") + time;
  const std::string ending = fs::path(options.file).extension().string();
  if (!options.file.empty() && ending != ".bag" && ending != ".mcap") options.file += ".bag";
  const fs::path folder = fs::path(options.file).parent_path();
  if (!folder.empty() && !fs::is_directory(folder)) {
    throw std::runtime_error(folder.string() + ": no such folder; nothing was recorded");
  }
  if (!options.asked.name.empty()) return;
  const std::string name = fs::path(prefix.empty() ? options.file : prefix).filename().string();
  options.asked.name = name.empty() ? time : prefix.empty() ? fs::path(name).stem().string() : name;
}

void runRecord(RecordOptions& options) {
  nameRecording(options);
  options.command = wordsBehindDashes();
  if (!options.command.empty() && !hasProgram(options.command.front())) {
    throw std::runtime_error("cannot start " + options.command.front() +
                             ": there is no such program; nothing was recorded");
  }
  startRecordRos();
  const ros::NodeHandle stays;  // with the last handle ROS shuts down
  for (const std::string& word : options.words) {
    options.asked.topics.push_back(ros::names::resolve(word));
  }
  ros::AsyncSpinner spinner(4);
  spinner.start();
  const std::string running = options.store.empty() ? runningRecorder() : "";
  const Recorded recorded =
      running.empty() ? recordAlone(options) : recordBehavior(options, running);
  if (!options.file.empty() && recorded.is_kept) writeFile(options.file, recorded);
  if (!recorded.failure.empty()) throw std::runtime_error(recorded.failure);
}

/// An option for each field of a request.
struct AddField {
  CLI::App& verb;

  static std::string names(const std::string& field) {
    static const std::map<std::string, std::string> usual = {
        {"regexes", "-e,--regex"}, {"all", "-a,--all"},  {"exclude", "-x,--exclude"},
        {"limits", "--limit"},     {"tags", "--tag"}};
    if (const auto found = usual.find(field); found != usual.end()) return found->second;
    std::string name = "--" + field;
    std::replace(name.begin(), name.end(), '_', '-');
    return name;
  }
  void operator()(const RecordingField& field, std::vector<std::string>& values) const {
    if (std::string(field.name) == "topics") return;  // words without an option
    verb.add_option(names(field.name), values, std::string(field.help) + "; may be repeated")
        ->expected(1)
        ->take_all();
  }
  void operator()(const RecordingField& field, bool& value) const {
    verb.add_flag(names(field.name), value, field.help);
  }
  template <typename Value>
  void operator()(const RecordingField& field, Value& value) const {
    verb.add_option(names(field.name), value, field.help);
  }
};

}  // namespace

void addRecordVerb(CLI::App& app) {
  auto options = std::make_shared<RecordOptions>();
  options->asked.attempt = 0;
  CLI::App* verb = addVerb(app, "record");
  verb->add_option("topics", options->words,
                   "Topics, and behind -- a command that is the behavior: it is run, and its exit "
                   "status says how it ended");
  visitRecordingFields(AddField{*verb}, options->asked);
  verb->get_option("--name")->description(
      "Name of the behavior; default: FILE's or PREFIX's, else the time");
  CLI::Option* file = verb->add_option(
      "-O,--output-name", options->file,
      "Write a bag, too, as export does, or an MCAP file: FILE, FILE.bag, FILE.mcap");
  verb->add_option("-o,--output-prefix", options->file_prefix,
                   "The same into PREFIX_2026-11-27-14-05-59.bag, with the time")
      ->excludes(file);
  verb->add_option("--duration", options->duration_s, "Ends by itself after so long: 30, 5m, 2h")
      ->transform(CLI::AsNumberWithUnit(
          std::map<std::string, double>{{"s", 1.0}, {"m", 60.0}, {"h", 3600.0}},
          CLI::AsNumberWithUnit::CASE_SENSITIVE));
  verb->add_option("--outcome", options->outcome,
                   "How it ends: any word; otherwise the command says success or failure, and "
                   "Ctrl-C stopped");
  addStoreOption(*verb, options->store);
  verb->get_option("--store")->description(
      "Record into this store, by this process alone: sqlite:PATH, PATH, mongodb://..., @FILE. "
      "Default: by a recorder_node that runs, into its store, or else $AFTERGLOW_STORE or "
      "~/.local/share/afterglow/afterglow.db");
  verb->callback([options] { runRecord(*options); });
  verb->footer(
      "Examples:\n"
      "  afterglow record --name tour /cmd_vel /projector/green_points /robotsound\n"
      "  afterglow record --name pick -e '/arm_.*' -- rosrun my_robot pick.py\n");
}

}  // namespace afterglow::nodes
