#include "replay/ros2/ros2_definition.hpp"

#include <algorithm>
#include <charconv>
#include <iterator>
#include <map>
#include <utility>
#include <vector>

#include "replay/messages/schema.hpp"
#include "replay/messages/text.hpp"

namespace afterglow::replay {
namespace {

constexpr std::string_view kForeign = "# From ROS 2: ";
constexpr const char* kHeader = "std_msgs/Header";
constexpr const char* kHeaderFields = "uint32 seq\ntime stamp\nstring frame_id\n";
/// IDL has no structure without members.
constexpr std::string_view kPlaceholder = "structure_needs_at_least_one_member";

std::string_view takeLine(std::string_view& text) {
  const std::size_t end = std::min(text.find('\n'), text.size());
  const std::string_view line = text.substr(0, end);
  text.remove_prefix(std::min(end + 1, text.size()));
  return line;
}

/// The number behind "<="; 0: there is none.
std::size_t boundIn(std::string_view text) {
  const std::size_t at = text.find("<=");
  std::size_t bound = 0;
  if (at != std::string_view::npos) {
    std::from_chars(text.data() + at + 2, text.data() + text.size(), bound);
  }
  return bound;
}

bool isNameLetter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
}

/// The types of one definition, with the lines of each.
class Sections {
 public:
  Sections(const std::string& root, std::string_view text) : root_(root) {
    std::string type = root;
    bool heading_awaited = false;
    names_.push_back(root);
    while (!text.empty()) {
      const std::string_view line = trimmed(takeLine(text));
      if (line.empty()) continue;
      if (heading_awaited) {
        type = heading(line);
        heading_awaited = false;
        if (lines_.count(type) == 0) names_.push_back(type);
        lines_[type].clear();
      } else if (line.size() > 1 && line.find_first_not_of('=') == std::string_view::npos) {
        heading_awaited = true;
      } else {
        lines_[type].push_back(line);
      }
    }
  }

  /// In the order of the text, the root first.
  const std::vector<std::string>& names() const { return names_; }
  const std::vector<std::string_view>& lines(const std::string& type) const {
    static const std::vector<std::string_view> kNone;
    const auto found = lines_.find(type);
    return found == lines_.end() ? kNone : found->second;
  }

 private:
  std::string heading(std::string_view line) const {
    constexpr std::string_view kMark = "MSG:";
    if (line.substr(0, kMark.size()) != kMark) {
      throw MessageError("definition of " + root_ + ": \"" + std::string(line.substr(0, 40)) +
                         "\" stands where \"MSG: package/Type\" should");
    }
    return ros1TypeName(std::string(trimmed(line.substr(kMark.size()))));
  }

  const std::string root_;
  std::vector<std::string> names_;
  std::map<std::string, std::vector<std::string_view>> lines_;  ///< views of the text
};

/// One line of a definition of ROS 2 as ROS 1 writes it.
class LineTranslator {
 public:
  LineTranslator(std::string owner, Ros2Bounds* bounds)
      : owner_(std::move(owner)), bounds_(bounds) {}

  /// Empty for comments and for what ROS 1 does without.
  std::string translate(std::string_view line) const {
    if (line.front() == '#') return "";
    if (line == "---") fail(line, "is of a service or an action, not of a message");
    const std::size_t gap = line.find_first_of(kBlanks);
    if (gap == std::string_view::npos) fail(line, "is no field");
    const std::string type = translateType(line, line.substr(0, gap));
    const std::string_view rest = trimmed(line.substr(gap));
    const auto name_end = std::find_if_not(rest.begin(), rest.end(), isNameLetter);
    const std::string_view name = rest.substr(0, static_cast<std::size_t>(name_end - rest.begin()));
    const std::string_view behind = trimmed(rest.substr(name.size()));
    if (name.empty()) fail(line, "has no name");
    if (name == kPlaceholder) return "";
    if (behind.empty() || behind.front() != '=') {
      noteBound(std::string(name), line.substr(0, gap));
      return type + " " + std::string(name) + "\n";  // what stands behind it is a default value
    }
    return type + " " + std::string(name) + "=" + constant(type, trimmed(behind.substr(1))) + "\n";
  }

 private:
  void noteBound(const std::string& name, std::string_view written) const {
    const std::size_t open = std::min(written.find('['), written.size());
    const Ros2Bound bound{boundIn(written.substr(open)), boundIn(written.substr(0, open))};
    if (bounds_ && (bound.elements != 0 || bound.letters != 0)) (*bounds_)[{owner_, name}] = bound;
  }

  [[noreturn]] void fail(std::string_view line, const std::string& what) const {
    throw MessageError("definition of " + owner_ + ": \"" + std::string(line.substr(0, 80)) +
                       "\" " + what);
  }

  static std::string constant(const std::string& type, std::string_view value) {
    if (type != "string") {
      const std::string_view number = trimmed(value.substr(0, value.find('#')));
      if (type != "bool") return std::string(number);
      return number == "true" || number == "True" || number == "1" ? "True" : "False";
    }
    const char quote = value.empty() ? ' ' : value.front();
    if (quote != '"' && quote != '\'') return std::string(value);
    return std::string(value.substr(1, value.find(quote, 1) - 1));
  }

  std::string translateType(std::string_view line, std::string_view written) const {
    const std::size_t open = written.find('[');
    std::string type(written.substr(0, open));
    std::string brackets(open == std::string_view::npos ? "" : written.substr(open));
    if (brackets.substr(0, 3) == "[<=") brackets = "[]";
    if (brackets.find_first_not_of("[0]") == std::string::npos && brackets.size() > 2) {
      fail(line, "is an array of no elements, which ROS 2 has not");
    }
    if (const std::size_t bound = type.find("<="); bound != std::string::npos) type.resize(bound);
    if (type == "wstring" || type == "wchar") fail(line, "has wide letters, which ROS 1 has not");
    if (type.find('/') != std::string::npos) type = ros1TypeName(type);
    if (type == "builtin_interfaces/Time") type = "time";
    if (type == "builtin_interfaces/Duration") type = "duration";
    return type + brackets;
  }

  const std::string owner_;
  Ros2Bounds* const bounds_;
};

std::string fieldsOf(const std::string& type, const std::vector<std::string_view>& lines,
                     Ros2Bounds* bounds) {
  const LineTranslator translator(type, bounds);
  std::string fields;
  for (const std::string_view line : lines) fields += translator.translate(line);
  if (type != kHeader) return fields;
  if (fields != "time stamp\nstring frame_id\n") {
    throw MessageError("definition of std_msgs/Header: it has other fields than in ROS 2");
  }
  return kHeaderFields;
}

/// Names that ROS 2 does not allow as they are in ROS 1.
struct Renamed {
  const char* type;
  const char* ros1;
  const char* ros2;
};
constexpr Renamed kRenamed[] = {{"sensor_msgs/CameraInfo", "D", "d"},
                                {"sensor_msgs/CameraInfo", "K", "k"},
                                {"sensor_msgs/CameraInfo", "R", "r"},
                                {"sensor_msgs/CameraInfo", "P", "p"},
                                {"stereo_msgs/DisparityImage", "T", "t"}};

/// One line of a definition of ROS 1 as ROS 2 writes it; empty for comments and a header's `seq`.
std::string ros2Line(const std::string& owner, std::string_view line) {
  const std::size_t gap = line.find_first_of(kBlanks);
  if (line.front() == '#' || gap == std::string_view::npos) return "";
  const std::string_view written = line.substr(0, gap), rest = trimmed(line.substr(gap));
  const std::size_t open = std::min(written.find('['), written.size());
  std::string type(written.substr(0, open));
  if (type == "Header") type = kHeader;
  if (type == "time") type = "builtin_interfaces/Time";
  if (type == "duration") type = "builtin_interfaces/Duration";
  if (type == "byte") type = "int8";
  if (type == "char") type = "uint8";
  const auto name_end = std::find_if_not(rest.begin(), rest.end(), isNameLetter);
  const std::string name(rest.begin(), name_end);
  if (owner == kHeader && name == "seq") return "";
  const std::string_view behind = trimmed(rest.substr(name.size()));
  if (behind.empty() || behind.front() != '=') {
    return type + std::string(written.substr(open)) + " " + nameInRos2(owner, name) + "\n";
  }
  const std::string_view value = trimmed(behind.substr(1));
  if (type == "string") {
    const char quote = value.find('"') == std::string_view::npos ? '"' : '\'';
    return type + " " + name + "=" + quote + std::string(value) + quote + "\n";
  }
  return type + " " + name + "=" + std::string(trimmed(value.substr(0, value.find('#')))) + "\n";
}

std::string headingOf(const std::string& type) {
  return std::string(80, '=') + "\nMSG: " + type + "\n";
}

}  // namespace

std::string nameInRos1(const std::string& type, const std::string& field) {
  for (const Renamed& renamed : kRenamed) {
    if (type == renamed.type && field == renamed.ros2) return renamed.ros1;
  }
  return field;
}

std::string nameInRos2(const std::string& type, const std::string& field) {
  for (const Renamed& renamed : kRenamed) {
    if (type == renamed.type && field == renamed.ros1) return renamed.ros2;
  }
  return field;
}

std::string ros2TypeName(const std::string& ros1_type) {
  const std::size_t slash = ros1_type.find('/');
  return ros1_type.substr(0, slash) + "/msg" + ros1_type.substr(std::min(slash, ros1_type.size()));
}

std::string ros2Definition(const std::string& ros1_type, std::string_view ros1_definition) {
  const Sections sections(ros1_type, ros1_definition);
  std::string text;
  for (const std::string& type : sections.names()) {
    if (type != ros1_type) text += headingOf(type);
    for (const std::string_view line : sections.lines(type)) text += ros2Line(type, line);
  }
  for (const char* builtin : {"builtin_interfaces/Time", "builtin_interfaces/Duration"}) {
    if (text.find(builtin) == std::string::npos) continue;
    text += headingOf(builtin) + "int32 sec\nuint32 nanosec\n";
  }
  return text;
}

std::string ros1TypeName(const std::string& ros2_type) {
  const std::size_t first = ros2_type.find('/'), last = ros2_type.rfind('/');
  const auto isName = [](std::string_view text) {
    return !text.empty() && std::all_of(text.begin(), text.end(), isNameLetter);
  };
  const std::string package = ros2_type.substr(0, first);
  const std::string name = last == std::string::npos ? "" : ros2_type.substr(last + 1);
  const std::string between =
      first == last ? "msg" : ros2_type.substr(first + 1, last - first - 1);
  if (!isName(package) || !isName(name) || !isName(between)) {
    throw MessageError("\"" + ros2_type.substr(0, 80) +
                       "\" is no message type; expected package/msg/Type");
  }
  return package + "/" + name;
}

std::string ros1Definition(const std::string& ros2_type, std::string_view ros2_definition,
                           Ros2Bounds* bounds) {
  const std::string root = ros1TypeName(ros2_type);
  const Sections sections(root, ros2_definition);
  std::string text;
  for (const std::string& type : sections.names()) {
    const bool is_root = type == root;
    // These are numbers of ROS 1's own.
    const bool is_builtin =
        type == "builtin_interfaces/Time" || type == "builtin_interfaces/Duration";
    if (is_builtin && !is_root) continue;
    if (!is_root) text += headingOf(type);
    text += fieldsOf(type, sections.lines(type), bounds);
  }
  return text;
}

std::string markAsForeign(const std::string& definition, const std::string& why) {
  std::string line = why;
  std::replace(line.begin(), line.end(), '\n', ' ');
  return std::string(kForeign) + line + "\n" + definition;
}

std::optional<std::string> whyForeign(std::string_view definition) {
  if (definition.substr(0, kForeign.size()) != kForeign) return std::nullopt;
  definition.remove_prefix(kForeign.size());
  return std::string(takeLine(definition));
}

namespace {

constexpr const char* kMarker = "visualization_msgs/Marker";

/// Packages whose types ROS 2 took over from ROS 1 with all their fields.
constexpr const char* kPackages[] = {"actionlib_msgs",  "diagnostic_msgs",   "geometry_msgs",
                                     "nav_msgs",        "sensor_msgs",       "shape_msgs",
                                     "std_msgs",        "stereo_msgs",       "tf2_msgs",
                                     "trajectory_msgs", "visualization_msgs"};
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
