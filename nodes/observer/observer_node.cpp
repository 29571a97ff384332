#include "nodes/observer/observer_node.hpp"

#include <sensor_msgs/Image.h>
#include <std_msgs/String.h>

#include <algorithm>
#include <filesystem>
#include <stdexcept>
#include <utility>

#include "nodes/conversion/camera_messages.hpp"
#include "nodes/observer/room_solids.hpp"

namespace afterglow::nodes {
namespace {

constexpr double kLongestNap_s = 0.02;  // so that a stop is noticed soon
constexpr double kWalk_s = 1.2;         // from one place to another
constexpr std::size_t kMostKeyFrames = 100;

/// The moments at which images are due, ROS time: evenly after the first, however long each takes.
class Pace {
 public:
  Pace(std::int64_t start_ns, int fps) : start_ns_(start_ns), fps_(fps) {}
  std::int64_t nextAfter(std::int64_t now_ns) const {
    const std::int64_t second = 1'000'000'000;
    const std::int64_t done = (now_ns - start_ns_) * fps_ / second;
    return start_ns_ + ((done + 1) * second + fps_ - 1) / fps_;
  }

 private:
  std::int64_t start_ns_;
  int fps_;
};

std::int64_t toNs(ros::Time time) { return static_cast<std::int64_t>(time.toNSec()); }

/// Until then, or a moment: ROS time may stand while news come.
void napUntil(std::int64_t deadline_ns) {
  const double left_s = static_cast<double>(deadline_ns - toNs(ros::Time::now())) * 1e-9;
  if (left_s > 0) ros::WallDuration(std::min(left_s, kLongestNap_s)).sleep();
}

bool isFileName(const std::string& name) {
  return !name.empty() && name.size() < 100 && name[0] != '.' &&
         std::all_of(name.begin(), name.end(), [](unsigned char c) {
           return std::isalnum(c) != 0 || c == '-' || c == '_' || c == '.';
         });
}

std::size_t dropsOf(const LayerStatus& status) {
  std::size_t drops = 0;
  for (const auto& [reason, count] : status.dropped) drops += count;
  return drops;
}

}  // namespace

ObserverNodeOptions ObserverNodeOptions::read(const ros::NodeHandle& own) {
  ObserverNodeOptions options;
  if (!own.getParam("view", options.view) || options.view.empty()) {
    throw std::runtime_error("~view is missing: the YAML file of the bystander's view");
  }
  own.param("video", options.video, options.video);
  own.param("speech", options.speech, options.speech);
  own.param("folder", options.folder, options.folder);
  own.param("human_voice", options.human_voice, options.human_voice);
  own.param("fps", options.fps, options.fps);
  own.param("inset", options.inset, options.inset);
  own.param("font", options.font, options.font);
  if (options.fps < 1 || options.fps > 120) {
    throw std::runtime_error("~fps is " + std::to_string(options.fps) + "; 1 to 120 can be drawn");
  }
  return options;
}

ObserverNode::ObserverNode(const ObserverNodeOptions& options)
    : ObserverNode(options, loadRoomView(options.view)) {}

ObserverNode::ObserverNode(const ObserverNodeOptions& options, const RoomView& room)
    : options_(options),
      room_(room),
      look_from_(room.look),
      look_to_(room.look),
      scene_(room, tf_),
      has_film_(!options.video.empty()),
      image_publisher_(own_.advertise<sensor_msgs::Image>("image", 1)) {
  if (!options_.folder.empty()) std::filesystem::create_directories(options_.folder);
  darkroom_ = std::make_unique<Darkroom>(darkroomOptions());
  subscribe();
  finish_ = own_.advertiseService("finish", &ObserverNode::onFinish, this);
}

DarkroomOptions ObserverNode::darkroomOptions() {
  DarkroomOptions darkroom;
  darkroom.width = room_.width;
  darkroom.height = room_.height;
  darkroom.fps = options_.fps;
  darkroom.video = options_.video;
  if (has_film_ && !options_.speech.empty()) {
    const auto folder = std::filesystem::path(options_.speech).parent_path() / "asked";
    asked_ = std::make_unique<SpeechLog>(folder.string());
    darkroom.speech = {options_.speech, (folder / "speech.json").string()};
  }
  darkroom.folder = options_.folder;
  darkroom.font = options_.font;
  darkroom.has_inset = options_.inset;
  darkroom.on_image = [this](std::int64_t ros_ns, const auto& image) { publish(ros_ns, image); };
  return darkroom;
}

void ObserverNode::subscribe() {
  ros::NodeHandle node;
  const auto hears = [this](ros::NodeHandle& from, const char* topic, std::uint32_t queue,
                            std::function<void(const std::string&)> take) {
    subscribers_.push_back(from.subscribe<std_msgs::String>(
        topic, queue, [take = std::move(take)](const auto& text) { take(text->data); }));
  };
  hears(own_, "caption", 10, [this](const std::string& text) {
    caption_ = {parseCaption(text).tag, parseCaption(text).text, caption_.speech};
  });
  hears(node, "/speaker_node/state", 10, [this](const auto& text) { caption_.speech = text; });
  hears(own_, "asked", 10, [this](const std::string& text) { onAsked(text); });
  hears(own_, "look", 10, [this](const std::string& name) { onLook(name); });
  hears(own_, "key_frame", 100, [this](const std::string& name) { onKeyFrame(name); });
  subscribers_.push_back(node.subscribe<visualization_msgs::MarkerArray>(
      "/room/solids", 100,
      [this](const auto& solids) { scene_.addSolids(*solids, ros::Time::now()); }));
  subscribers_.push_back(node.subscribe<sensor_msgs::CameraInfo>(
      "/projector/camera_info", 2, [this](const auto& info) { scene_.setLens(*info); }));
  subscribers_.push_back(node.subscribe<sensor_msgs::Image>(
      "/projector/image", 4, [this](const auto& image) { scene_.addImage(*image); },
      ros::VoidConstPtr(), ros::TransportHints().tcpNoDelay()));
}

void ObserverNode::run(const std::function<bool()>& is_stopped) {
  ros::Time::waitForValid();
  const std::int64_t start_ns = toNs(ros::Time::now());
  const Pace pace(start_ns, options_.fps);
  std::int64_t deadline_ns = start_ns;
  while (!is_stopped()) {
    napUntil(deadline_ns);
    hearNews();
    const ros::Time now = ros::Time::now();  // no earlier than what was heard
    if (toNs(now) < deadline_ns) continue;
    // A live picture is of now, or none.
    const bool waits = is_filming_ || !key_frames_.empty();
    if (isWatched() && (waits || darkroom_->isIdle())) darkroom_->add(shoot(now));
    deadline_ns = pace.nextAfter(toNs(ros::Time::now()));
  }
  if (has_film_) darkroom_->finish(toNs(ros::Time::now()));
}

bool ObserverNode::onFinish(std_srvs::Trigger::Request&, std_srvs::Trigger::Response& response) {
  is_filming_ = false;
  try {
    has_film_ = false;
    response.message = std::to_string(darkroom_->finish(toNs(ros::Time::now())));
    response.success = unheard_.empty();
    if (!response.success) response.message = unheard_;
  } catch (const std::runtime_error& error) {
    response.message = error.what();
  }
  return true;
}

bool ObserverNode::isWatched() const {
  return is_filming_ || !key_frames_.empty() || image_publisher_.getNumSubscribers() > 0;
}

void ObserverNode::hearNews() {
  lookForRobot();
  const std::size_t drops_before = dropsOf(scene_.status());
  ros::spinOnce();
  if (dropsOf(scene_.status()) > drops_before) {
    const auto reasons = scene_.status().dropped;
    ROS_WARN_THROTTLE(10, "something is not shown: %s", reasons.begin()->first.c_str());
  }
  is_filming_ = has_film_ && (is_filming_ || scene_.isFurnished());
}

void ObserverNode::onKeyFrame(const std::string& name) {
  if (!isFileName(name)) {
    ROS_ERROR("a key frame's name should be letters, digits, '-', '_' and '.'");
  } else if (key_frames_.size() < kMostKeyFrames) {
    key_frames_.push_back(name);
  }
}

void ObserverNode::onLook(const std::string& name) {
  const auto other = room_.others.find(name);
  if (other == room_.others.end() && !name.empty()) {
    ROS_ERROR("%s has no place '%s' to look from", options_.view.c_str(), name.c_str());
    return;
  }
  look_from_ = lookAt(ros::Time::now());
  look_to_ = name.empty() ? room_.look : other->second;
  look_changed_ = ros::Time::now();
}

// Starting and stopping gently.
Look ObserverNode::lookAt(ros::Time now) const {
  const double share = std::clamp((now - look_changed_).toSec() / kWalk_s, 0.0, 1.0);
  return between(look_from_, look_to_, share * share * (3 - 2 * share));
}

void ObserverNode::lookForRobot() {
  if (scene_.hasRobot() || ros::WallTime::now() < next_robot_look_) return;
  next_robot_look_ = ros::WallTime::now() + ros::WallDuration(1);
  std::string xml;
  if (!ros::param::get("/robot_description", xml)) return;
  try {
    MeshLibrary meshes;
    scene_.setRobot(RobotModel::fromXml(
        xml, "/robot_description", robotMeshes(meshes, [](const std::string& why) {
          ROS_WARN("a part of the robot is not shown: %s", why.c_str());
        })));
  } catch (const std::runtime_error& error) {
    ROS_ERROR_ONCE("the robot is not shown: %s", error.what());
  }
}

void ObserverNode::onAsked(const std::string& question) {
  caption_.asked = question;
  if (!asked_ || !is_filming_) return;
  try {
    if (!human_) human_ = std::make_unique<Speech>(SpeechOptions{options_.human_voice});
    const auto sound = human_->say(question);
    const double duration_s = static_cast<double>(sound->samples.size()) / sound->sample_rate;
    const std::int64_t onset_ns = toNs(ros::Time::now());
    asked_->add({question, options_.human_voice, onset_ns, duration_s, 1, false, ""}, *sound);
  } catch (const std::runtime_error& error) {
    unheard_ = "\"" + question + "\" is shown but not heard: " + error.what();
    ROS_WARN_ONCE("%s", unheard_.c_str());
  }
}

Shot ObserverNode::shoot(ros::Time now) {
  Shot shot;
  shot.ros_ns = toNs(now);
  shot.solids = scene_.solids(now);
  if (const render::ProjectedLight* light = scene_.light(now)) {
    shot.light = render::ProjectedLight{light->lens, light->T_projector_world, {}};
    shot.packed_light = PackedImage(light->image);
  }
  shot.look = lookAt(now);
  shot.caption = caption_;
  shot.key_frames = std::exchange(key_frames_, {});
  const render::Image* projected = scene_.projectorImage();
  if (!shot.key_frames.empty() && projected != nullptr) shot.projected = *projected;
  shot.is_filmed = is_filming_;
  return shot;
}

void ObserverNode::publish(std::int64_t ros_ns, const render::Image& image) const {
  if (image_publisher_.getNumSubscribers() == 0) return;
  sensor_msgs::Image message = toImage(image);
  message.header.stamp.fromNSec(static_cast<std::uint64_t>(ros_ns));
  message.header.frame_id = "observer_optical_frame";
  image_publisher_.publish(message);
}

}  // namespace afterglow::nodes
