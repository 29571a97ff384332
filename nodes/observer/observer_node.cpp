#include "nodes/observer/observer_node.hpp"

#include <sensor_msgs/Image.h>

#include <algorithm>
#include <filesystem>
#include <stdexcept>
#include <utility>

#include "nodes/conversion/camera_messages.hpp"
#include "render/image_file.hpp"

namespace afterglow::nodes {
namespace {

constexpr double kLongestNap_s = 0.02;  // so that a stop is noticed soon
constexpr double kWalk_s = 1.2;         // from one place to another

/// The moments at which pictures are due, ROS time: multiples of the frame's duration after the
/// first, however long each takes.
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

/// Whether it is time; false if stopped before.
bool waitUntil(std::int64_t deadline_ns, const std::function<bool()>& is_stopped) {
  while (!is_stopped()) {
    const double left_s = static_cast<double>(deadline_ns - toNs(ros::Time::now())) * 1e-9;
    if (left_s <= 0) return true;
    ros::WallDuration(std::min(left_s, kLongestNap_s)).sleep();
  }
  return false;
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
  own.param("folder", options.folder, options.folder);
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
      painter_(options.font),
      image_publisher_(own_.advertise<sensor_msgs::Image>("image", 1)),
      inbox_(ros::NodeHandle(), own_) {
  if (!options_.folder.empty()) std::filesystem::create_directories(options_.folder);
  if (options_.video.empty()) return;
  video_ = std::make_unique<TimedVideo>(options_.video, room_.width, room_.height, options_.fps);
}

void ObserverNode::run(const std::function<bool()>& is_stopped) {
  ros::Time::waitForValid();
  const std::int64_t start_ns = toNs(ros::Time::now());
  const Pace pace(start_ns, options_.fps);
  std::int64_t deadline_ns = start_ns;
  while (waitUntil(deadline_ns, is_stopped)) {
    hearNews();
    if (isWatched()) show(ros::Time::now());  // no earlier than what was heard
    deadline_ns = pace.nextAfter(toNs(ros::Time::now()));
  }
  if (video_) video_->close(toNs(ros::Time::now()));
}

bool ObserverNode::isWatched() const {
  return filming_ || !key_frames_.empty() || image_publisher_.getNumSubscribers() > 0;
}

void ObserverNode::hearNews() {
  lookForRobot();
  const ros::Time now = ros::Time::now();
  const std::size_t drops_before = dropsOf(scene_.status());
  const ObserverNews news = inbox_.take();
  for (const auto& solids : news.solids) scene_.addSolids(*solids, now);
  if (news.camera_info) scene_.setLens(*news.camera_info);
  for (const auto& image : news.images) scene_.addImage(*image);
  if (dropsOf(scene_.status()) > drops_before) {
    const auto reasons = scene_.status().dropped;
    ROS_WARN_THROTTLE(10, "something is not shown: %s", reasons.begin()->first.c_str());
  }
  if (news.caption) {
    Caption caption = parseCaption(*news.caption);
    caption.speech = caption_.speech;
    caption_ = std::move(caption);
  }
  if (news.speech) caption_.speech = *news.speech;
  if (news.look) hearLook(*news.look, now);
  hearKeyFrames(news.key_frames);
  filming_ = video_ && (filming_ || scene_.isFurnished());
}

void ObserverNode::hearKeyFrames(const std::deque<std::string>& names) {
  for (const std::string& name : names) {
    if (isFileName(name)) {
      key_frames_.push_back(name);
    } else {
      ROS_ERROR("a key frame's name should be letters, digits, '-', '_' and '.'");
    }
  }
}

void ObserverNode::hearLook(const std::string& name, ros::Time now) {
  const auto other = room_.others.find(name);
  if (other == room_.others.end() && !name.empty()) {
    ROS_ERROR("%s has no place '%s' to look from", options_.view.c_str(), name.c_str());
    return;
  }
  look_from_ = lookAt(now);
  look_to_ = name.empty() ? room_.look : other->second;
  look_changed_ = now;
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
    scene_.setRobot(RobotModel::fromXml(xml, "/robot_description"));
  } catch (const std::runtime_error& error) {
    ROS_ERROR_ONCE("the robot is not shown: %s", error.what());
  }
}

render::Image ObserverNode::draw(ros::Time now) {
  const render::ObserverView view = viewFrom(lookAt(now), room_.width, room_.height);
  render::Image picture = renderer_.render(scene_.solids(now), scene_.light(now), view);
  const render::Image* projector = scene_.projectorImage();
  if (options_.inset && projector != nullptr) {
    painter_.paintInset(picture, *projector, "projector image");
  }
  painter_.paint(picture, caption_);
  return picture;
}

void ObserverNode::show(ros::Time now) {
  render::Image picture = draw(now);
  saveKeyFrames(picture);
  if (image_publisher_.getNumSubscribers() > 0) {
    sensor_msgs::Image message = toImage(picture);
    message.header.stamp = now;
    message.header.frame_id = "observer_optical_frame";
    image_publisher_.publish(message);
  }
  if (filming_) video_->add(toNs(now), std::move(picture));
}

void ObserverNode::saveKeyFrames(const render::Image& picture) {
  for (const std::string& name : std::exchange(key_frames_, {})) {
    const std::string stem = (std::filesystem::path(options_.folder) / name).string();
    try {
      render::writePng(stem + ".png", picture);
      if (const auto* image = scene_.projectorImage()) {
        render::writePng(stem + "_projector.png", *image);
      }
    } catch (const std::runtime_error& error) {
      ROS_ERROR("%s", error.what());
    }
  }
}

}  // namespace afterglow::nodes
