#include "replay/ros2/known_types.hpp"

#include <algorithm>
#include <iterator>

namespace afterglow::replay {
namespace {

constexpr const char* kMarker = "visualization_msgs/Marker";

/// Packages whose types ROS 2 took over from ROS 1 with all their fields.
constexpr const char* kPackages[] = {
    "actionlib_msgs", "diagnostic_msgs", "geometry_msgs", "nav_msgs",  "sensor_msgs",
    "shape_msgs",     "std_msgs",        "stereo_msgs",   "tf2_msgs",  "trajectory_msgs",
    "visualization_msgs"};
/// But for these.
constexpr const char* kChanged[] = {"shape_msgs/SolidPrimitive", "std_msgs/Time",
                                    "std_msgs/Duration"};

/// Since Galactic; before, it was ROS 1's.
constexpr const char* kMarkerFields =
    "std_msgs/Header header\nstring ns\nint32 id\nint32 type\nint32 action\n"
    "geometry_msgs/Pose pose\ngeometry_msgs/Vector3 scale\nstd_msgs/ColorRGBA color\n"
    "duration lifetime\nbool frame_locked\ngeometry_msgs/Point[] points\n"
    "std_msgs/ColorRGBA[] colors\nstring texture_resource\n"
    "sensor_msgs/CompressedImage texture\nUVCoordinate[] uv_coordinates\nstring text\n"
    "string mesh_resource\nMeshFile mesh_file\nbool mesh_use_embedded_materials\n";
constexpr const char* kMarkerParts[][2] = {
    {"sensor_msgs/CompressedImage", "std_msgs/Header header\nstring format\nuint8[] data\n"},
    {"visualization_msgs/UVCoordinate", "float32 u\nfloat32 v\n"},
    {"visualization_msgs/MeshFile", "string filename\nuint8[] data\n"}};

const std::string kSeparator = std::string(80, '=') + "\n";

/// The definition with that of one contained type, or of the root, replaced.
std::string withMarker(const std::string& type, const std::string& definition) {
  std::string text = definition;
  const std::string heading = kSeparator + "MSG: " + std::string(kMarker) + "\n";
  const std::size_t found = type == kMarker ? 0 : text.find(heading);
  if (found == std::string::npos) return "";
  const std::size_t begin = type == kMarker ? 0 : found + heading.size();
  const std::size_t end = std::min(text.find(kSeparator, begin), text.size());
  text.replace(begin, end - begin, kMarkerFields);
  for (const auto& [part, fields] : kMarkerParts) {
    if (text.find("MSG: " + std::string(part) + "\n") != std::string::npos) continue;
    text += "\n" + kSeparator + "MSG: " + part + "\n" + fields;
  }
  return text;
}

}  // namespace

std::vector<std::string> ros2Layouts(const std::string& type, const Definition& known) {
  const auto holds = [](const auto& list, const std::string& name) {
    return std::find(std::begin(list), std::end(list), name) != std::end(list);
  };
  const bool is_common = holds(kPackages, type.substr(0, type.find('/')));
  if (type != "rosgraph_msgs/Clock" && (!is_common || holds(kChanged, type))) return {};
  std::vector<std::string> layouts;
  if (const std::string text = withMarker(type, known.text); !text.empty()) {
    layouts.push_back(text);
  }
  layouts.push_back(known.text);
  return layouts;
}

}  // namespace afterglow::replay
