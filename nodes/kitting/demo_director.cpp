#include "nodes/kitting/demo_director.hpp"

#include <fmt/format.h>
#include <std_srvs/Trigger.h>
#include <sys/utsname.h>

#include <algorithm>
#include <ctime>
#include <filesystem>
#include <thread>

#include "calib/camera_info_file.hpp"
#include "nodes/fetch/fetch_facts.hpp"
#include "replay/store/open/open_store.hpp"

namespace afterglow::nodes {
namespace {

namespace fs = std::filesystem;

constexpr double kStartUp = 30;  // seconds that nodes may take to come up on a busy machine
constexpr double kCardSeconds = 2.5;
constexpr double kBeat = 0.5;    // seconds after a behavior, for its last picture
constexpr double kTypical = 13;  // seconds of a behavior, for the progress bar

// The nodes may still be starting.
RobotModel robotDescription() {
  std::string xml;
  const ros::WallTime deadline = ros::WallTime::now() + ros::WallDuration(kStartUp);
  while (!ros::param::get("/robot_description", xml)) {
    if (ros::WallTime::now() > deadline) {
      throw TaskError("the parameter /robot_description is not set");
    }
    sleepFor(0.05);
  }
  return RobotModel::fromXml(xml);
}

std::string utcNow() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  char text[32];
  std::strftime(text, sizeof(text), "%Y-%m-%d %H:%M", &utc);
  return text;
}

// What people need to know to compare two runs.
std::vector<std::pair<std::string, std::string>> versions() {
  std::vector<std::pair<std::string, std::string>> result = {{"afterglow", AFTERGLOW_VERSION}};
  std::string distro, version;
  ros::param::get("/rosdistro", distro);
  ros::param::get("/rosversion", version);
  const auto trimmed = [](std::string text) {
    text.erase(std::remove(text.begin(), text.end(), '\n'), text.end());
    return text;
  };
  result.emplace_back("ROS", trimmed(distro) + " " + trimmed(version));
  utsname system{};
  if (uname(&system) == 0) {
    result.emplace_back(system.sysname, std::string(system.release) + " " + system.machine);
  }
  result.emplace_back("processors", std::to_string(std::thread::hardware_concurrency()));
  return result;
}

}  // namespace

DemoDirector::DemoDirector(const DemoFiles& files, DemoProgress& progress)
    : files_(files),
      progress_(progress),
      story_(loadDemoStory(files.assets + "/story.yaml")),
      plan_(loadKittingPlan(files.assets + "/task.yaml")),
      robot_(robotDescription(),
             calib::loadCameraInfo(files.assets + "/projector_camera_info.yaml").lens),
      room_(loadRoom(files.assets + "/room.yaml")),
      task_(plan_, robot_, room_, [this](const std::string& moment) { onMoment(moment); }),
      bystander_({files.out + "/parts/silent.mp4", files.out + "/speech/speech.json"}) {}

DemoReport DemoDirector::run() {
  begin_ = ros::WallTime::now();
  report_.date = utcNow();
  report_.versions = versions();
  waitUntilReady();
  for (const BehaviorStory& behavior : story_.behaviors) record(behavior);
  removeObjects();
  for (std::size_t i = 0; i < story_.behaviors.size(); ++i) {
    replay(report_.behaviors.at(i), story_.behaviors[i]);
  }
  robot_.waitUntilReady(1);  // whoever died on the way took part of the demo with them
  finishFilm();
  report_.wall_s = (ros::WallTime::now() - begin_).toSec();
  return report_;
}

void DemoDirector::waitUntilReady() {
  progress_.begin("Starting robot, projector, recorder, player", 4);
  robot_.waitUntilReady(kStartUp);
  recorder_.waitUntilReady(kStartUp);
  player_.waitUntilReady(kStartUp);
  bystander_.waitUntilReady(kStartUp);
  bystander_.caption(story_.title, story_.subtitle);
  room_.show();
  task_.prepare();
  progress_.done("ready");
}

std::string DemoDirector::sayingOf(const std::string& behavior) const {
  if (behavior == "pick") return plan_.pick.says;
  if (behavior == "drive") return plan_.drive.says;
  return plan_.place.says;
}

void DemoDirector::doBehavior(const std::string& name) {
  if (name == "pick") return task_.pick();
  if (name == "drive") return task_.drive();
  if (name == "place") return task_.place();
  throw TaskError("the story tells of '" + name + "', which the robot cannot do");
}

EndPose DemoDirector::endPose() const {
  return {robot_.floorPose(), robot_.T_map_link(kGripperLink).translation()};
}

std::string DemoDirector::pictureName(const std::string& behavior, const std::string& moment,
                                      const char* run) {
  std::string name = behavior + "_" + moment + "_" + run;
  std::replace(name.begin(), name.end(), ' ', '_');
  return name;
}

// ---------------------------------------------------------------------------------------- done

void DemoDirector::record(const BehaviorStory& behavior) {
  progress_.begin("Doing and recording '" + behavior.name + "'", kTypical);
  bystander_.look(behavior.name);
  bystander_.caption(story_.live_tag, behavior.caption);
  report_.behaviors.emplace_back();
  recording_ = &report_.behaviors.back();
  recording_->says = sayingOf(behavior.name);
  const DemoRecording request{behavior.name, "kitting/" + behavior.name, kittingTopics()};
  const RecordBehaviorResult result = recorder_.record(request, [&] {
    recording_began_ = ros::WallTime::now();
    doBehavior(behavior.name);
  });
  sleepFor(kBeat);
  recording_->live_end = endPose();
  recording_->behavior.id = result.behavior_id;
  recording_->messages = result.messages;
  recording_->dropped = result.dropped;
  recording_ = nullptr;
  progress_.done(std::to_string(result.messages) + " messages on " +
                 std::to_string(kittingTopics().size() - result.silent_topics.size()) + " topics");
}

void DemoDirector::onMoment(const std::string& moment) {
  const BehaviorStory& behavior = story_.behaviors.at(report_.behaviors.size() - 1);
  for (const auto& [name, words] : behavior.moments) {
    if (name != moment || recording_ == nullptr) continue;
    KeyFrame frame;
    frame.moment = moment;
    frame.offset_s = (ros::WallTime::now() - recording_began_).toSec();
    frame.live = pictureName(behavior.name, moment, "recorded");
    frame.replay = pictureName(behavior.name, moment, "replayed");
    bystander_.takePicture(frame.live);
    recording_->key_frames.push_back(frame);
  }
}

// ------------------------------------------------------------------------------------ replayed

void DemoDirector::removeObjects() {
  progress_.begin("Taking the objects away, the robot back to start", 6);
  bystander_.look("");
  bystander_.caption("", story_.later);
  room_.removeObjects();
  std_srvs::Trigger reset;
  if (!ros::service::call("/fake_fetch/reset", reset) || !reset.response.success) {
    throw TaskError("the robot was not put back to its start: " + reset.response.message);
  }
  sleepFor(0.3);
  bystander_.look(story_.behaviors.front().name);
  const ros::WallTime card = ros::WallTime::now();
  task_.prepare();
  sleepFor(kCardSeconds - (ros::WallTime::now() - card).toSec());
  readStore();
  progress_.done("");
}

// What the recorder wrote, read back as anybody would.
void DemoDirector::readStore() {
  const auto store = replay::openStore(files_.store, replay::OpenMode::ReadOnly);
  for (MeasuredBehavior& measured : report_.behaviors) {
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
}

void DemoDirector::replay(MeasuredBehavior& measured, const BehaviorStory& behavior) {
  progress_.begin("Finding and replaying '" + behavior.name + "'",
                  durationOf(measured.behavior) + 1);
  bystander_.look(behavior.name);
  bystander_.caption(story_.replay_tag, behavior.question);
  std::size_t next = 0;
  const auto& frames = measured.key_frames;
  const ros::WallTime begin = ros::WallTime::now();
  const ReplayResult result =
      player_.replay(behavior.name, durationOf(measured.behavior), [&](double position) {
        if (next < frames.size() && position >= frames[next].offset_s) {
          bystander_.takePicture(frames[next++].replay);
        }
      });
  measured.replay_s = (ros::WallTime::now() - begin).toSec();
  sleepFor(kBeat);
  measured.replay_end = endPose();
  measured.player_report = nlohmann::json::parse(result.report);
  if (result.behavior_id != measured.behavior.id) {
    throw TaskError("the name '" + behavior.name + "' found another behavior");
  }
  progress_.done(
      fmt::format("p99 lateness {:.2f} ms", latenessOf(measured.player_report).p99_ms));
}

void DemoDirector::finishFilm() {
  progress_.begin("Putting video and speech together", 6);
  bystander_.caption(story_.title, story_.subtitle);
  bystander_.look("");
  sleepFor(kCardSeconds);
  report_.video = "demo.mp4";
  report_.store = fs::path(files_.store).filename().string();
  report_.folder = files_.typed_out;
  report_.assets = files_.typed_assets;
  report_.command = files_.typed_command;
  bystander_.finish(files_.out + "/" + report_.video);
  fs::remove_all(files_.out + "/parts");
  progress_.done(report_.video);
}

}  // namespace afterglow::nodes
