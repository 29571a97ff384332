#include "nodes/recorder/world_snapshot.hpp"

#include <fcntl.h>
#include <ros/serialization.h>
#include <sys/stat.h>
#include <tf2/exceptions.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>
#include <utility>

#include "calib/file_replacement.hpp"
#include "nodes/conversion/geometry_conversion.hpp"
#include "nodes/conversion/resource_file.hpp"
#include "nodes/tools/ros_graph.hpp"
#include "replay/messages/text.hpp"
#include "replay/messages/topic_name.hpp"
#include "replay/plan/recorded_drivers.hpp"
#include "replay/store/checksum.hpp"

namespace afterglow::nodes {
namespace {

nlohmann::json toJson(const sensor_msgs::CameraInfo& info) {
  return {{"frame_id", info.header.frame_id},
          {"width", info.width},
          {"height", info.height},
          {"distortion_model", info.distortion_model},
          {"D", info.D},
          {"K", std::vector<double>(info.K.begin(), info.K.end())},
          {"R", std::vector<double>(info.R.begin(), info.R.end())},
          {"P", std::vector<double>(info.P.begin(), info.P.end())}};
}

}  // namespace

WorldSnapshot::WorldSnapshot(const RecorderNodeOptions& options, replay::Store& store)
    : options_(options), store_(store) {
  if (!options_.map_topic.empty()) {
    map_subscriber_ = node_.subscribe<nav_msgs::OccupancyGrid>(
        options_.map_topic, 1, [this](const nav_msgs::OccupancyGridConstPtr& map) {
          std::string identity = mapIdentity(*map);
          const std::lock_guard<std::mutex> lock(mutex_);
          map_ = std::move(identity);
        });
  }
  if (options_.camera_info.empty()) {
    return;
  }
  camera_info_subscriber_ = node_.subscribe<sensor_msgs::CameraInfo>(
      options_.camera_info, 1, [this](const sensor_msgs::CameraInfoConstPtr& info) {
        const std::lock_guard<std::mutex> lock(mutex_);
        camera_info_ = *info;
      });
}

replay::RobotNames WorldSnapshot::robot() const {
  const std::string name_space = rosNamespace();
  return replay::findRobotNames(
      name_space, robotParameter(name_space, "tf_prefix"),
      [this](const std::string& frame) { return buffer_._frameExists(frame); });
}

replay::Snapshot::Frames WorldSnapshot::frames() const {
  const replay::RobotNames robot = this->robot();
  replay::Snapshot::Frames frames;
  for (std::size_t i = 1; i < options_.anchors.size(); ++i) {
    const std::string from = robot.frame(options_.anchors[i - 1]);
    const std::string to = robot.frame(options_.anchors[i]);
    try {
      const auto transform = buffer_.lookupTransform(from, to, ros::Time(0)).transform;
      frames[from + "->" + to] = {transform.translation.x, transform.translation.y,
                                  transform.translation.z, transform.rotation.x,
                                  transform.rotation.y,    transform.rotation.z,
                                  transform.rotation.w};
    } catch (const tf2::TransformException&) {
      // Not connected: this robot has no such frame, or not yet.
    }
  }
  return frames;
}

std::string WorldSnapshot::urdf() {
  const std::string text = robotParameter(rosNamespace(), "robot_description");
  if (text.empty()) return {};
  const std::lock_guard<std::mutex> lock(mutex_);
  if (text != urdf_text_) {
    const replay::Bytes bytes(text.begin(), text.end());
    const std::string hash = replay::sha256(bytes);
    store_.addFile(hash, bytes);
    urdf_text_ = text;
    urdf_sha256_ = hash;
  }
  return urdf_sha256_;
}

std::string WorldSnapshot::map() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return map_;
}

std::string WorldSnapshot::calibration() const {
  nlohmann::json json = nlohmann::json::object();
  if (!options_.calibration.empty()) {
    for (const std::string name : {"projector.yaml", "T_camera_projector.yaml"}) {
      std::ifstream file = calib::openRegularFile(options_.calibration + "/" + name);
      const std::string text{std::istreambuf_iterator<char>(file), {}};
      if (!text.empty()) json[name] = text;
    }
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  if (camera_info_) {
    json["camera_info"] = toJson(*camera_info_);
  }
  return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

namespace {

constexpr double kPatience = 1;  // s, for each of two questions

/// "/arm/status" for "/arm/goal": who tells of an action serves it.
std::set<std::string> withStatus(const std::vector<std::string>& topics) {
  std::set<std::string> all(topics.begin(), topics.end());
  for (const std::string& topic : topics) {
    const std::string action = replay::actionOfGoal(topic);
    if (!action.empty()) all.insert(action + "/status");
  }
  return all;
}

}  // namespace

replay::RecordedNodes nodesNow(const std::vector<std::string>& topics) {
  replay::RecordedNodes nodes;
  try {
    const RosGraph graph = askMaster(deadlineIn(kPatience));
    const std::map<std::string, std::string> types = askTopicTypes(deadlineIn(kPatience));
    std::set<std::string> noted = withStatus(topics);
    for (const auto& [topic, type] : types) {
      if (replay::tellsWhoDrove(type)) noted.insert(topic);
    }
    for (const std::string& topic : noted) {
      const auto type = types.find(topic);
      const replay::TopicNodes around{type == types.end() ? "" : type->second,
                                      graph.otherPublishers(topic), graph.otherSubscribers(topic)};
      if (!around.publishers.empty() || !around.subscribers.empty()) nodes[topic] = around;
    }
  } catch (const std::runtime_error&) {  // a recording goes on without its master
    nodes.clear();
  }
  return nodes;
}

std::string mapIdentity(const nav_msgs::OccupancyGrid& map) {
  nav_msgs::MapMetaData info = map.info;
  info.map_load_time = ros::Time();
  replay::Bytes bytes(ros::serialization::serializationLength(info));
  ros::serialization::OStream stream(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
  ros::serialization::serialize(stream, info);
  bytes.insert(bytes.end(), map.data.begin(), map.data.end());
  return replay::sha256(bytes);
}

namespace {

namespace fs = std::filesystem;

const std::string kSounds = "/usr/share/sounds";
constexpr std::uintmax_t kLargest = 20u << 20;

bool isSoundOrMesh(const fs::path& path) {
  static const std::set<std::string> kKnown = {".wav",  ".ogg", ".oga",  ".mp3", ".flac",
                                               ".aiff", ".stl", ".stlb", ".dae", ".mesh",
                                               ".obj",  ".ply", ".glb",  ".gltf"};
  return kKnown.count(replay::lowerCase(path.extension())) != 0;
}

/// An open file, closed with the object.
class OpenFile {
 public:
  /// Nothing is created, and no pipe or device waited for.
  explicit OpenFile(const fs::path& path)
      : file_(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY)) {
    struct stat about {};
    if (file_ < 0 || fstat(file_, &about) != 0 || !S_ISREG(about.st_mode)) {
      close();
      throw std::runtime_error("there is no such file");
    }
    size_ = static_cast<std::uintmax_t>(about.st_size);
  }
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;
  ~OpenFile() { close(); }

  std::uintmax_t size() const { return size_; }
  /// Returns the path of the open file, whatever its name leads to by now.
  fs::path realPath() const {
    return fs::read_symlink("/proc/self/fd/" + std::to_string(file_));
  }
  replay::Bytes contents() const {
    replay::Bytes bytes(static_cast<std::size_t>(size_));
    std::size_t have = 0;
    while (have < bytes.size()) {
      const auto read = ::read(file_, bytes.data() + have, bytes.size() - have);
      if (read <= 0) throw std::runtime_error("it cannot be read");
      have += static_cast<std::size_t>(read);
    }
    return bytes;
  }

 private:
  void close() {
    if (file_ >= 0) ::close(file_);
  }
  int file_;
  std::uintmax_t size_ = 0;
};

replay::Bytes contentsOf(const std::string& uri, const std::vector<std::string>& roots) {
  const ResourceFile named = resourceFile(uri);
  if (!isSoundOrMesh(named.path)) throw std::runtime_error("no sound and no mesh by its name");
  const OpenFile file(named.path);
  const fs::path real = file.realPath();
  if (!isSoundOrMesh(real)) throw std::runtime_error("a link to what is no sound and no mesh");
  if (!named.package.empty() && !isInside(real, named.package)) {
    throw std::runtime_error("it leads out of its package");
  }
  const auto isIn = [&](const std::vector<std::string>& folders) {
    return std::any_of(folders.begin(), folders.end(),
                       [&](const std::string& folder) { return isInside(real, folder); });
  };
  if (named.package.empty() && !isIn({kSounds}) && !isIn(roots) && !isIn(packageFolders())) {
    throw std::runtime_error("outside the folders that files may come from (~file_roots)");
  }
  if (file.size() > kLargest) throw std::runtime_error("larger than 20 MiB");
  return file.contents();
}

}  // namespace

std::map<std::string, std::string> keepFiles(replay::Store& store,
                                             const std::set<std::string>& uris,
                                             const std::vector<std::string>& roots,
                                             std::vector<std::string>& remarks) {
  std::map<std::string, std::string> kept;
  for (const std::string& uri : uris) {
    replay::Bytes contents;
    try {
      contents = contentsOf(uri, roots);
    } catch (const std::runtime_error& error) {
      remarks.push_back("the file '" + printable(uri.substr(0, kLongestResource)) +
                        "' was not kept: " + error.what());
      continue;
    }
    const std::string hash = replay::sha256(contents);
    store.addFile(hash, contents);
    kept[uri] = hash;
  }
  return kept;
}

bool isHere(const std::string& uri) {
  try {
    std::error_code error;
    return fs::is_regular_file(resourceFile(uri).path, error);
  } catch (const std::runtime_error&) {
    return false;
  }
}

}  // namespace afterglow::nodes
