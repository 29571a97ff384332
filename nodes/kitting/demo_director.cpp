#include "nodes/kitting/demo_director.hpp"

#include <fmt/format.h>
#include <sound_play/SoundRequest.h>
#include <std_srvs/Trigger.h>
#include <sys/utsname.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <optional>
#include <stdexcept>
#include <thread>

#include "calib/camera_info_file.hpp"
#include "nodes/conversion/geometry_conversion.hpp"
#include "nodes/fetch/fetch_facts.hpp"
#include "nodes/tools/program.hpp"
#include "nodes/verbs/verb_tools.hpp"
#include "replay/query/time_text.hpp"
#include "replay/store/open/open_store.hpp"

namespace afterglow::nodes {
namespace {

constexpr const char *kPart_s = "20", *kShortFilm_s = "14.5";  // of the long film; a short one's
constexpr const char* kPictureSize = "638,648";  // as in the films

std::string afterglowCommand() {
  return std::filesystem::canonical("/proc/self/exe").parent_path() / "afterglow";
}

/// Makes the folder, with one for key frames, and returns its name.
std::string withFrames(const std::string& folder) {
  std::filesystem::create_directories(folder + "/frames");
  return folder;
}

void runAll(const std::vector<std::vector<std::string>>& commands) {
  for (const std::vector<std::string>& command : commands) {
    const ProgramResult result = runProgram(command);
    const bool is_mute = result.output.find("not heard") != std::string::npos;
    if (result.status == 0 && !is_mute) continue;
    throw std::runtime_error(fmt::format("'{}' failed: {}", fmt::join(command, " "),
                                         result.output.substr(0, result.output.find('\n'))));
  }
}

}  // namespace

DemoFilms::DemoFilms(const DemoFolders& folders)
    : folders_(folders), work_(withFrames(folders.out) + "/demo.mp4") {}

void DemoFilms::run(std::vector<Command> commands) {
  for (Command& command : commands) command.insert(command.begin(), {"nice", "-n", "19"});
  running_.push_back(std::async(std::launch::async, runAll, std::move(commands)));
}

DemoFilms::Command DemoFilms::keyFrames(const MeasuredBehavior& measured, bool is_replay,
                                        bool is_observed) const {
  Command command = {afterglowCommand(),
                     "render",
                     std::to_string(is_replay ? measured.replay_id : measured.behavior.id),
                     "--store",
                     folders_.out + "/demo.db",
                     "--config",
                     folders_.assets + "/projector.yaml"};
  if (is_observed) {
    command.insert(command.end(), {"--view", "observer", "--room", folders_.assets + "/view.yaml",
                                   "--place", measured.behavior.name, "--size", kPictureSize});
  }
  for (const KeyFrame& frame : measured.key_frames) {
    const double at_s = is_replay ? frame.replay_offset_s : frame.offset_s;
    const std::string& name = is_replay ? frame.replay : frame.live;
    command.insert(command.end(), {"--at", fmt::format("{:.3f}", at_s), "--out",
                                   fmt::format("{}/frames/{}{}.png", folders_.out, name,
                                               is_observed ? "" : "_projector")});
  }
  return command;
}

void DemoFilms::begin(const MeasuredBehavior& measured, const BehaviorStory& story) {
  parts_.push_back(work_.path(measured.behavior.name + ".mp4"));
  Command film = {afterglowCommand()};
  const Command words = filmArguments(measured, folders_.assets);
  film.insert(film.end(), words.begin(), words.end());
  film.insert(film.end(),
              {"--store", folders_.out + "/demo.db", "--fps", "15", "--caption", story.caption,
               "--at-most", kPart_s, "--title", story.title, "--closing", story.light, "--out",
               parts_.back(), "--at-most", kShortFilm_s, "--title", "", "--closing", "", "--out",
               folders_.out + "/" + measured.behavior.name + ".mp4"});
  run({film});
  run({keyFrames(measured, false, true), keyFrames(measured, true, true),
       keyFrames(measured, false, false), keyFrames(measured, true, false)});
}

void DemoFilms::finish(const std::string& video) {
  for (std::future<void>& each : running_) each.get();
  running_.clear();
  const std::string list = work_.path("parts.txt");
  std::ofstream file(list);
  for (const std::string& part : parts_) file << "file 'file:" << part << "'\n";
  file.close();
  runAll({{"ffmpeg", "-hide_banner", "-nostats", "-nostdin", "-loglevel", "error", "-y", "-f",
           "concat", "-safe", "0", "-i", list, "-c", "copy", "-movflags", "+faststart",
           "file:" + video}});
}

namespace {

constexpr double kStartUp = 30;  // seconds that nodes may take to come up on a busy machine
constexpr double kBeat = 0.2;  // seconds after a behavior, until tf tells its end

// The nodes may still be starting.
RobotModel robotDescription() {
  std::string xml;
  if (!waitUntil([&] { return ros::param::get("/robot_description", xml); }, kStartUp)) {
    throw TaskError("the parameter /robot_description is not set");
  }
  return RobotModel::fromXml(xml);
}

// What people need to know to compare two runs.
std::vector<std::pair<std::string, std::string>> versions() {
  std::string ros = ros::param::param<std::string>("/rosdistro", "") + " " +
                    ros::param::param<std::string>("/rosversion", "");
  ros.erase(std::remove(ros.begin(), ros.end(), '\n'), ros.end());
  utsname system{};
  uname(&system);
  return {{"afterglow", AFTERGLOW_VERSION},
          {"ROS", ros},
          {system.sysname, std::string(system.release) + " " + system.machine},
          {"processors", std::to_string(std::thread::hardware_concurrency())}};
}

std::string imageName(const std::string& behavior, const std::string& moment, const char* run) {
  std::string name = behavior + "_" + moment + "_" + run;
  std::replace(name.begin(), name.end(), ' ', '_');
  return name;
}

/// Topics of a behavior's replay: also the question, and where the player was when.
std::vector<std::string> replayTopics() {
  std::vector<std::string> topics = kittingTopics();
  topics.insert(topics.end(), {"/ask/goal", "/player_node/status"});
  return topics;
}

/// Shows its name on the terminal while it lives, then a line that says how it went.
class Stage {
 public:
  explicit Stage(const std::string& name) : name_(name), waiting_(std::in_place, name) {}
  ~Stage() { end("FAILED", ""); }

  /// Ends well; `detail` says what came of it.
  void done(const std::string& detail) { end("done", detail); }

 private:
  void end(const char* mark, const std::string& detail) {
    if (!waiting_) return;
    waiting_.reset();
    std::cout << fmt::format("{:<6} {:<46} {:>5.1f} s  {}", mark, name_,
                             (ros::WallTime::now() - begin_).toSec(), detail)
              << std::endl;
  }

  const std::string name_;
  const ros::WallTime begin_ = ros::WallTime::now();
  std::optional<Waiting> waiting_;  ///< empty when it is over
};

}  // namespace

DemoDirector::DemoDirector(const DemoFolders& folders)
    : folders_(folders),
      story_(loadDemoStory(folders.assets + "/story.yaml")),
      robot_(robotDescription(),
             calib::loadCameraInfo(folders.assets + "/projector_camera_info.yaml").lens),
      room_(loadThings(folders.assets + "/room.urdf")),
      task_(robot_, room_,
            {[this](const std::string& moment) { onMoment(moment); }, [this] { showRoom(); },
             [this] { say(); }}),
      films_(folders),
      solids_(
          ros::NodeHandle().advertise<visualization_msgs::MarkerArray>("/room/solids", 1, true)),
      obstacles_(ros::NodeHandle().advertise<geometry_msgs::PoseArray>("/obstacles", 1, true)) {
  static_tf_.sendTransform(room_.surfaces());
}

DemoReport DemoDirector::run() {
  const ros::WallTime begin = ros::WallTime::now();
  report_.date = replay::timeText(replay::wallNow()).replace(10, 1, " ").substr(0, 16);
  report_.versions = versions();
  report_.video = "demo.mp4";
  report_.store = "demo.db";
  waitUntilReady();
  for (const BehaviorStory& behavior : story_.behaviors) record(behavior);
  removeObjects();
  for (std::size_t i = 0; i < story_.behaviors.size(); ++i) {
    replay(report_.behaviors.at(i), story_.behaviors[i]);
  }
  expectAllNodes();
  finishFilms();
  report_.wall_s = (ros::WallTime::now() - begin).toSec();
  return report_;
}

/// Shows the things to the recorder, and to the robot's laser.
void DemoDirector::showRoom() {
  solids_.publish(room_.markers());
  obstacles_.publish(room_.obstacles());
  if (recorded_ != nullptr) keepRoom();
}

/// Keeps the room for the ghosts of its replay.
void DemoDirector::keepRoom() {
  std::vector<RoomThen>& rooms = rooms_then_[recorded_->name];
  const double offset_s = (ros::WallTime::now() - recording_began_).toSec();
  rooms.push_back({rooms.empty() ? 0 : offset_s, room_});
}

void DemoDirector::waitUntilReady() {
  Stage stage("Starting robot, projector, recorder, player");
  robot_.waitUntilReady(kStartUp);
  robot_asked_.waitUntilReady(kStartUp);
  if (!ros::service::waitForService("/recorder_node/start_recording", ros::Duration(kStartUp))) {
    throw TaskError("recorder_node is not there");
  }
  showRoom();
  // Who replays the first one later, with --to-start, has the arm go this way.
  recordBehavior("unfold", kittingTopics(), [this] { task_.prepare(); });
  stage.done("ready");
}

EndPose DemoDirector::endPose() const {
  return {toPlanarPose(robot_.T_map_base()), robot_.T_map_link(kGripperLink).translation()};
}

// ---------------------------------------------------------------------------------------- done

void DemoDirector::record(const BehaviorStory& behavior) {
  Stage stage("Doing and recording '" + behavior.name + "'");
  MeasuredBehavior& measured = report_.behaviors.emplace_back();
  measured.says = behavior.says;
  const auto result = recordBehavior(behavior.name, kittingTopics(), [&] {
    recording_began_ = ros::WallTime::now();
    recorded_ = &behavior;
    keepRoom();
    task_.run(behavior.name);
    recorded_ = nullptr;
  });
  sleepFor(kBeat);
  measured.live_end = endPose();
  measured.behavior.id = result.behavior_id;
  measured.messages = result.messages;
  measured.dropped = result.dropped;
  readStore(measured);
  const auto heard = std::count_if(measured.topics.begin(), measured.topics.end(),
                                   [](const auto& topic) { return topic.count > 0; });
  stage.done(fmt::format("{} messages on {} topics", result.messages, heard));
}

void DemoDirector::onMoment(const std::string& moment) {
  if (recorded_ == nullptr) return;
  const auto& told = recorded_->moments;
  if (std::none_of(told.begin(), told.end(), [&](const auto& m) { return m.first == moment; })) {
    return;
  }
  KeyFrame frame;
  frame.moment = moment;
  frame.offset_s = (ros::WallTime::now() - recording_began_).toSec();
  frame.live = imageName(recorded_->name, moment, "recorded");
  frame.replay = imageName(recorded_->name, moment, "replayed");
  report_.behaviors.back().key_frames.push_back(frame);
}

void DemoDirector::say() {
  sound_play::SoundRequest request;
  request.sound = sound_play::SoundRequest::SAY;
  request.command = sound_play::SoundRequest::PLAY_ONCE;
  request.volume = 1;
  request.arg = recorded_->says;
  request.arg2 = "voice_kal_diphone";  // sound_play's; speaker_node takes its own for it
  robot_.out().speech.publish(request);
}

// What the recorder wrote, read back as anybody would.
void DemoDirector::readStore(MeasuredBehavior& measured) const {
  const auto store =
      replay::openStore(folders_.out + "/" + report_.store, replay::OpenMode::ReadOnly);
  const auto behavior = store->behavior(measured.behavior.id);
  if (!behavior) {
    throw TaskError("the store lacks behavior " + std::to_string(measured.behavior.id));
  }
  measured.behavior = *behavior;
  for (const replay::TopicSummary& topic : store->topics(*behavior)) {
    const auto& own = behavior->topics;
    if (std::count(own.begin(), own.end(), topic.topic)) measured.topics.push_back(topic);
  }
}

// ------------------------------------------------------------------------------------ replayed

void DemoDirector::removeObjects() {
  Stage stage("Taking the objects away, the robot back to start");
  room_.removeObjects();
  showRoom();
  std_srvs::Trigger reset;
  if (!ros::service::call("/fake_fetch/reset", reset) || !reset.response.success) {
    throw TaskError("the robot was not put back to its start: " + reset.response.message);
  }
  sleepFor(0.3);
  task_.prepare();
  robot_.leaveGraph();
  stage.done("");
}

void DemoDirector::replay(MeasuredBehavior& measured, const BehaviorStory& behavior) {
  Stage stage("Asking '" + behavior.question + "'");
  ReplayResult result;
  const auto recorded = recordBehavior(behavior.name + "_replayed", replayTopics(), [&] {
    recording_began_ = ros::WallTime::now();
    Shown shown;
    onReplayed(0, measured, shown);
    result = robot_asked_.ask(behavior.question, durationOf(measured.behavior),
                              [&](double position) { onReplayed(position, measured, shown); });
    measured.replay_s = (ros::WallTime::now() - recording_began_).toSec();
    sleepFor(kBeat);
    measured.replay_end = endPose();
  });
  measured.replay_id = recorded.behavior_id;
  measured.player_report = nlohmann::json::parse(result.report);
  if (result.behavior_id != measured.behavior.id) {
    throw TaskError("'" + behavior.question + "' found another behavior");
  }
  films_.begin(measured, behavior);
  stage.done(fmt::format("replays '{}', p99 lateness {:.2f} ms", behavior.name,
                         latenessOf(measured.player_report).p99_ms));
}

/// Moves the things that were there then as they went, as ghosts.
void DemoDirector::onReplayed(double position, MeasuredBehavior& measured, Shown& shown) {
  auto& frames = measured.key_frames;
  if (shown.frames < frames.size() && position >= frames[shown.frames].offset_s) {
    frames[shown.frames++].replay_offset_s = (ros::WallTime::now() - recording_began_).toSec();
  }
  const auto& rooms = rooms_then_[measured.behavior.name];
  if (shown.rooms < rooms.size() && position >= rooms[shown.rooms].offset_s) {
    KittingRoom ghosts = rooms[shown.rooms++].room;
    ghosts.removeObjects();
    solids_.publish(ghosts.markers());
  }
}

void DemoDirector::finishFilms() {
  Stage stage("Rendering the films");
  films_.finish(folders_.out + "/" + report_.video);
  for (MeasuredBehavior& each : report_.behaviors) each.film = each.behavior.name + ".mp4";
  stage.done(report_.video);
}

}  // namespace afterglow::nodes
