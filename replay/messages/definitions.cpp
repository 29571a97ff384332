#include "replay/messages/definitions.hpp"

#include <openssl/evp.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <sstream>

#include "replay/messages/schema.hpp"
#include "replay/messages/text.hpp"

namespace afterglow::replay {
namespace {

namespace fs = std::filesystem;

const std::string kSeparator = std::string(80, '=') + "\n";

/// The parts of a .msg file that MD5 and contained types need.
struct Declarations {
  struct Field {
    std::string type;  ///< type as written, with brackets
    std::string name;
  };
  std::string constants;  ///< constants as the MD5 text has them
  std::vector<Field> fields;
};

void addLine(const std::string& line, Declarations& declarations) {
  const std::string text(trimmed(line.substr(0, line.find('#'))));
  const std::size_t gap = text.find_first_of(kBlanks);
  if (gap == std::string::npos) return;
  const std::string type = text.substr(0, gap);
  const std::string rest(trimmed(text.substr(gap)));
  const std::size_t equals = rest.find('=');
  if (equals == std::string::npos) {
    declarations.fields.push_back({type, rest});
    return;
  }
  // The value of a string constant is all of the text behind '=', including '#'.
  const std::string value =
      type == "string" ? line.substr(line.find('=') + 1) : rest.substr(equals + 1);
  const std::string name(trimmed(rest.substr(0, equals)));
  declarations.constants += type + " " + name + "=" + std::string(trimmed(value)) + "\n";
}

/// The full name of a field's message type; empty for a builtin.
std::string messageType(const std::string& field_type, const std::string& owner) {
  static const std::vector<std::string> kBuiltins = {
      "bool",   "int8",    "uint8",   "int16",  "uint16", "int32",    "uint32", "int64",
      "uint64", "float32", "float64", "string", "time",   "duration", "byte",   "char"};
  const std::string bare = field_type.substr(0, field_type.find('['));
  if (std::find(kBuiltins.begin(), kBuiltins.end(), bare) != kBuiltins.end()) return "";
  if (bare == "Header") return "std_msgs/Header";
  if (bare.find('/') != std::string::npos) return bare;
  return owner.substr(0, owner.find('/') + 1) + bare;
}

Declarations declarationsOf(const std::string& text) {
  Declarations declarations;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) addLine(line, declarations);
  return declarations;
}

/// The parts of a full text by the types they define.
std::map<std::string, Declarations> sectionsOf(const std::string& root, const std::string& text) {
  constexpr std::string_view kMark = "MSG:";
  std::map<std::string, Declarations> sections;
  std::string type = root;
  bool is_heading = false;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    const std::string_view text_of_line = trimmed(line);
    if (is_heading && !text_of_line.empty()) {
      type = trimmed(text_of_line.substr(kMark.size()));
      sections[type] = {};
      is_heading = false;
    } else if (text_of_line.size() > 1 &&
               text_of_line.find_first_not_of('=') == std::string_view::npos) {
      is_heading = true;
    } else {
      addLine(line, sections[type]);
    }
  }
  // The text need not contain the header's definition: Schema::parse() knows it.
  sections.try_emplace("std_msgs/Header",
                       declarationsOf("uint32 seq\ntime stamp\nstring frame_id\n"));
  return sections;
}

std::string md5(const std::string& text) {
  unsigned char digest[EVP_MAX_MD_SIZE];
  unsigned int size = 0;
  if (EVP_Digest(text.data(), text.size(), digest, &size, EVP_md5(), nullptr) != 1) {
    throw MessageError("this machine's OpenSSL computes no MD5");
  }
  constexpr const char* kDigits = "0123456789abcdef";
  std::string hex;
  for (unsigned int i = 0; i < size; ++i) {
    hex += kDigits[digest[i] >> 4];
    hex += kDigits[digest[i] & 15];
  }
  return hex;
}

class Md5Maker {
 public:
  explicit Md5Maker(const std::map<std::string, Declarations>& sections) : sections_(sections) {}

  std::string md5Of(const std::string& type) {
    if (const auto known = known_.find(type); known != known_.end()) return known->second;
    const Declarations& declarations = sections_.at(type);
    std::string text = declarations.constants;
    for (const auto& field : declarations.fields) {
      const std::string contained = sectionName(messageType(field.type, type));
      text += (contained.empty() ? field.type : md5Of(contained)) + " " + field.name + "\n";
    }
    if (!text.empty()) text.pop_back();
    return known_[type] = md5(text);
  }

 private:
  /// Bags from before 2010 define the header as roslib's.
  std::string sectionName(const std::string& type) const {
    return type == "std_msgs/Header" && sections_.count("roslib/Header") > 0 ? "roslib/Header"
                                                                             : type;
  }

  const std::map<std::string, Declarations>& sections_;
  std::map<std::string, std::string> known_;
};

std::optional<std::string> fileText(const fs::path& path) {
  std::error_code ignored;
  if (!fs::is_regular_file(path, ignored)) return std::nullopt;
  std::ifstream file(path);
  if (!file) return std::nullopt;
  std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  text.erase(std::remove(text.begin(), text.end(), '\r'), text.end());
  return text;
}

/// Returns the folders where a catkin devel space keeps the sources' definitions:
/// set(x_MSG_INCLUDE_DIRS "A;B").
std::vector<std::string> namedFolders(const fs::path& package_folder, const std::string& package) {
  const auto text = fileText(package_folder / "cmake" / (package + "-msg-paths.cmake"));
  const std::string mark = "set(" + package + "_MSG_INCLUDE_DIRS \"";
  const std::size_t at = text ? text->find(mark) : std::string::npos;
  if (at == std::string::npos) return {};
  const std::size_t begin = at + mark.size();
  return splitAt(';', text->substr(begin, text->find('"', begin) - begin));
}

void addFolders(const char* variable, const char* below, std::vector<std::string>& folders) {
  const char* value = std::getenv(variable);
  for (const std::string& path : splitAt(':', value ? value : "")) folders.push_back(path + below);
}

}  // namespace

std::string definitionMd5(const std::string& type, const std::string& text) {
  static_cast<void>(Schema::parse(type, text));  // no cycles, nothing missing
  const auto sections = sectionsOf(type, text);
  if (sections.count(type) == 0) return md5("");
  return Md5Maker(sections).md5Of(type);
}

std::optional<std::string> DefinitionFolders::text(const std::string& type,
                                                   const std::string& kind) const {
  const std::size_t slash = type.find('/');
  if (slash == std::string::npos || type.find_first_of("/.", slash + 1) != std::string::npos ||
      type.find('.') != std::string::npos) {
    return std::nullopt;
  }
  const std::string package = type.substr(0, slash);
  const std::string file = type.substr(slash + 1) + "." + kind;
  for (const fs::path folder : folders_) {
    if (auto text = fileText(folder / package / kind / file)) return text;
    if (folder.filename() == package) {
      if (auto text = fileText(folder / kind / file)) return text;
    }
    for (const fs::path named : namedFolders(folder / package, package)) {
      if (auto text = fileText(named / file)) return text;
    }
  }
  return std::nullopt;
}

std::string DefinitionFolders::withContained(const std::string& type,
                                             const std::string& root) const {
  std::string full = root + "\n";
  std::vector<std::string> seen;
  // Depth first, each type where it is met first.
  const auto addContained = [&](const auto& self, const std::string& owner,
                                const std::string& owner_text) -> void {
    for (const auto& field : declarationsOf(owner_text).fields) {
      const std::string contained = messageType(field.type, owner);
      if (contained.empty() || std::find(seen.begin(), seen.end(), contained) != seen.end()) {
        continue;
      }
      seen.push_back(contained);
      const auto contained_text = text(contained);
      if (!contained_text) continue;  // Schema::parse() reports it
      full += kSeparator + "MSG: " + contained + "\n" + *contained_text + "\n";
      self(self, contained, *contained_text);
    }
  };
  addContained(addContained, type, root);
  full.pop_back();
  return full;
}

std::optional<std::string> DefinitionFolders::fullText(const std::string& type) const {
  const auto root = text(type);
  if (!root) return std::nullopt;
  return withContained(type, *root);
}

std::optional<Definition> DefinitionFolders::find(const std::string& type) const {
  const auto full = fullText(type);
  if (!full) return std::nullopt;
  return Definition{*full, definitionMd5(type, *full)};
}

std::optional<ActionText> DefinitionFolders::findAction(const std::string& type) const {
  const auto whole = text(type, "action");
  if (!whole) return std::nullopt;
  std::vector<std::string> parts(1);
  std::istringstream lines(*whole);
  for (std::string line; std::getline(lines, line);) {
    if (trimmed(line) == "---") {
      parts.emplace_back();
    } else {
      parts.back() += line + "\n";
    }
  }
  parts.resize(3);
  for (std::string& part : parts) part = withContained(type, part);
  return ActionText{parts[0], parts[1], parts[2]};
}

std::string mendDefinition(Channel& channel, const FindDefinition& find) {
  std::string own_md5, why;
  try {
    own_md5 = definitionMd5(channel.type, channel.definition);
    const bool has_fields = !Schema::of(channel).root().fields.empty();
    if (!has_fields) why = "it has no field";
  } catch (const MessageError& error) {
    why = error.what();
  }
  if (why.empty() && channel.md5.empty()) channel.md5 = own_md5;
  if (channel.md5 == own_md5 && !own_md5.empty()) return "";
  const auto known = find ? find(channel.type) : std::nullopt;
  const bool is_as_known = known && known->md5 == own_md5;  // std_msgs/Empty has no field
  if (known && !is_as_known && (channel.md5.empty() || channel.md5 == known->md5)) {
    if (why.empty()) why = "it has another MD5 than the type";
    channel.definition = known->text;
    channel.md5 = known->md5;
    return why;
  }
  if (channel.md5.empty()) channel.md5 = own_md5;
  if (channel.md5.empty()) throw MessageError(why + ", and the type is not known here");
  return "";
}

std::string mendedText(const Channel& channel, const std::string& why) {
  return channel.topic + " (" + channel.type + ") is read by the definition known here, as its " +
         "own is defective: " + why;
}

FindDefinition findInstalled() {
  return [](const std::string& type) -> std::optional<Definition> {
    try {
      return installedDefinitions().find(type);
    } catch (const MessageError&) {
      return std::nullopt;
    }
  };
}

DefinitionFolders installedDefinitions() {
  std::vector<std::string> folders;
  addFolders("ROS_PACKAGE_PATH", "", folders);
  addFolders("CMAKE_PREFIX_PATH", "/share", folders);
  std::error_code ignored;
  const fs::path program = fs::read_symlink("/proc/self/exe", ignored);
  const fs::path prefix = program.parent_path().parent_path();
  folders.push_back(prefix / "devel" / "share");
  folders.push_back(prefix.parent_path() / "share");
  folders.push_back("/usr/share");
  return DefinitionFolders(std::move(folders));
}

DefinitionFolders installedRos2Definitions() {
  std::vector<std::string> folders;
  addFolders("AMENT_PREFIX_PATH", "/share", folders);
  return DefinitionFolders(std::move(folders));
}

}  // namespace afterglow::replay
