#include "replay/plan/anchoring.hpp"

#include <stdexcept>

#include "replay/messages/ranges.hpp"
#include "replay/plan/topic_role.hpp"

namespace afterglow::replay {
namespace {

/// The types that projectors and rviz draw.
bool isDrawn(const std::string& type) {
  constexpr const char* kTypes[] = {
      "sensor_msgs/PointCloud2",         "sensor_msgs/PointCloud",
      "sensor_msgs/LaserScan",           "visualization_msgs/Marker",
      "visualization_msgs/MarkerArray",  "nav_msgs/Path",
      "nav_msgs/OccupancyGrid",          "nav_msgs/GridCells",
      "geometry_msgs/PoseStamped",       "geometry_msgs/PoseArray",
      "geometry_msgs/PointStamped",      "geometry_msgs/PolygonStamped",
      "geometry_msgs/Vector3Stamped",    "geometry_msgs/WrenchStamped",
      "geometry_msgs/QuaternionStamped", "geometry_msgs/PoseWithCovarianceStamped"};
  return contains(kTypes, type);
}

Anchor parseAnchor(const std::string& word) {
  if (word == "world") return Anchor::World;
  if (word == "body") return Anchor::Body;
  throw std::invalid_argument("'" + word + "' is no anchor (world, body, /topic=world, " +
                              "/topic=body)");
}

std::vector<FieldPath> headerPaths(const Schema& schema) {
  std::vector<FieldPath> paths;
  visitFields(schema, [&](const MessageType& type, const Field& field, const std::string& path) {
    const bool is_header = type.name == "std_msgs/Header" && &type != &schema.root();
    const bool is_meant = field.name == "stamp" || field.name == "frame_id";
    if (is_header && is_meant) paths.push_back(FieldPath::parse(path));
  });
  return paths;
}

}  // namespace

void AnchorSettings::add(const std::string& text) {
  const std::size_t equals = text.rfind('=');
  if (equals == std::string::npos) {
    anchor = parseAnchor(text);
  } else {
    topics[text.substr(0, equals)] = parseAnchor(text.substr(equals + 1));
  }
}

Anchor AnchorSettings::of(const Channel& channel) const {
  const auto name = TopicName::cleaned(channel.topic);
  const auto named = name ? topics.find(*name) : topics.end();
  if (named != topics.end()) return named->second;
  // A robot's odometry and ranges are light by their topic's name only.
  const bool is_light =
      isDrawn(channel.type) ||
      (name && roleOf(name->text(), channel.type).topic_class == TopicClass::Shown);
  return is_light ? anchor : Anchor::Body;
}

std::string recordedFrame(const std::string& frame) { return "recorded/" + bareName(frame); }

HeaderFields::HeaderFields(const Schema& schema)
    : paths_(headerPaths(schema)), finder_(schema, paths_) {}

std::vector<HeaderFields::Header> HeaderFields::find(const Bytes& bytes) const {
  std::vector<Header> headers;
  if (paths_.empty()) return headers;
  const std::vector<std::vector<FieldSpan>> spans = finder_.find(bytes);
  for (std::size_t i = 0; i < spans.size(); i += 2) {
    for (std::size_t n = 0; n < spans[i].size(); ++n) {
      const FieldSpan &stamp = spans[i][n], &frame = spans[i + 1].at(n);
      headers.push_back({readTime(bytes, stamp).value_or(Stamp{}),
                         bareName(readString(bytes, frame)), stamp, frame});
    }
  }
  return headers;
}

}  // namespace afterglow::replay
