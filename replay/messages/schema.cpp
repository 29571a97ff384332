#include "replay/messages/schema.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "replay/messages/message.hpp"
#include "replay/messages/text.hpp"

namespace afterglow::replay {
namespace {

struct Builtin {
  std::string_view name;
  FieldType type;
};

// name() gives the first name of a type.
constexpr std::array<Builtin, 16> kBuiltins{{{"bool", FieldType::Bool},
                                             {"int8", FieldType::Int8},
                                             {"uint8", FieldType::UInt8},
                                             {"int16", FieldType::Int16},
                                             {"uint16", FieldType::UInt16},
                                             {"int32", FieldType::Int32},
                                             {"uint32", FieldType::UInt32},
                                             {"int64", FieldType::Int64},
                                             {"uint64", FieldType::UInt64},
                                             {"float32", FieldType::Float32},
                                             {"float64", FieldType::Float64},
                                             {"string", FieldType::String},
                                             {"time", FieldType::Time},
                                             {"duration", FieldType::Duration},
                                             {"byte", FieldType::Int8},
                                             {"char", FieldType::UInt8}}};

constexpr std::string_view kHeaderDefinition = "uint32 seq\ntime stamp\nstring frame_id\n";

// Sizes saturate: those of nested fixed arrays may overflow.
constexpr std::size_t kHuge = std::numeric_limits<std::size_t>::max() / 2;

std::size_t add(std::size_t a, std::size_t b) { return a > kHuge - b ? kHuge : a + b; }

std::size_t multiply(std::size_t a, std::size_t b) {
  return b > 0 && a > kHuge / b ? kHuge : a * b;
}

std::optional<FieldType> builtin(std::string_view type) {
  for (const Builtin& b : kBuiltins) {
    if (b.name == type) return b.type;
  }
  return std::nullopt;
}

bool isLetter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }

bool isName(std::string_view text) {
  return !text.empty() && isLetter(text.front()) &&
         std::all_of(text.begin(), text.end(),
                     [](char c) { return isLetter(c) || (c >= '0' && c <= '9') || c == '_'; });
}

bool isQualified(std::string_view type) {
  const std::size_t slash = type.find('/');
  return slash != std::string_view::npos && isName(type.substr(0, slash)) &&
         isName(type.substr(slash + 1));
}

struct Line {
  std::size_t number;  // in the whole definition, from 1
  std::string_view text;
};

/// The part of a definition that describes one type.
struct Section {
  std::size_t heading = 1;  // line number
  std::vector<Line> lines;
};

bool sameText(const Section& a, const Section& b) {
  return std::equal(a.lines.begin(), a.lines.end(), b.lines.begin(), b.lines.end(),
                    [](const Line& x, const Line& y) { return x.text == y.text; });
}

/// "float64[36] covariance", taken apart but not yet resolved.
struct Declaration {
  std::string_view type;
  std::string_view name;
  Field::Arity arity = Field::Arity::Single;
  std::size_t length = 0;
};

}  // namespace

std::size_t fixedSize(FieldType type) {
  switch (type) {
    case FieldType::Bool:
    case FieldType::Int8:
    case FieldType::UInt8:
      return 1;
    case FieldType::Int16:
    case FieldType::UInt16:
      return 2;
    case FieldType::Int32:
    case FieldType::UInt32:
    case FieldType::Float32:
      return 4;
    case FieldType::Int64:
    case FieldType::UInt64:
    case FieldType::Float64:
    case FieldType::Time:
    case FieldType::Duration:
      return 8;
    case FieldType::String:
    case FieldType::Message:
      break;
  }
  return 0;
}

std::string_view name(FieldType type) {
  for (const Builtin& b : kBuiltins) {
    if (b.type == type) return b.name;
  }
  return "message";
}

/// Two steps: cuts the text into sections, one for each type; then follows the fields from the
/// outermost type, so that only contained types are parsed and cycles are noticed.
class SchemaParser {
 public:
  SchemaParser(const std::string& type, std::string_view definition) : root_(type) {
    if (!isQualified(type)) {
      throw MessageError("\"" + type + "\" is no message type; expected package/Type");
    }
    cut(definition);
  }

  Schema parse() {
    addType(root_);
    return std::move(schema_);
  }

 private:
  [[noreturn]] void fail(std::size_t line, const std::string& what) const {
    throw MessageError("definition of " + root_ + ", line " + std::to_string(line) + ": " + what);
  }

  void cut(std::string_view text) {
    Section section;
    std::string type = root_;
    bool heading_awaited = false;
    for (std::size_t number = 1; !text.empty(); ++number) {
      const std::size_t end = std::min(text.find('\n'), text.size());
      const std::string_view line = trimmed(text.substr(0, end));
      text.remove_prefix(std::min(end + 1, text.size()));
      if (line.empty()) continue;
      if (heading_awaited) {
        type = heading(number, line);
        section.heading = number;
        heading_awaited = false;
      } else if (line.size() > 1 && line.find_first_not_of('=') == std::string_view::npos) {
        addSection(type, std::exchange(section, {}));
        heading_awaited = true;
      } else {
        section.lines.push_back({number, line});
      }
    }
    if (!heading_awaited) addSection(type, std::move(section));
  }

  std::string heading(std::size_t number, std::string_view line) const {
    constexpr std::string_view kMark = "MSG:";
    if (line.substr(0, kMark.size()) != kMark) {
      fail(number, "expected \"MSG: package/Type\" behind a line of '='");
    }
    const std::string_view type = trimmed(line.substr(kMark.size()));
    if (!isQualified(type)) {
      fail(number, "\"" + std::string(type) + "\" is no message type; expected package/Type");
    }
    return std::string(type);
  }

  void addSection(const std::string& type, Section&& section) {
    const std::size_t line = section.heading;
    // try_emplace does not move from its argument when the key exists already.
    const auto [at, is_new] = sections_.try_emplace(type, std::move(section));
    if (!is_new && !sameText(at->second, section)) {
      fail(line, type + " is defined twice, differently");
    }
  }

  /// The index of a type; parses it and all that it contains.
  std::size_t addType(const std::string& type) {
    if (const auto known = indices_.find(type); known != indices_.end()) return known->second;
    const std::size_t index = schema_.types_.size();
    schema_.types_.push_back({type, {}});
    schema_.minimum_sizes_.push_back(0);
    schema_.fixed_sizes_.push_back(true);
    extents_.emplace_back();
    path_.push_back(type);
    std::set<std::string_view> names;
    for (const Line& line : sections_.at(type).lines) {
      const auto declared = declaration(line);
      if (!declared) continue;
      if (!names.insert(declared->name).second) {
        fail(line.number, type + " has two fields named " + std::string(declared->name));
      }
      addField(index, line.number, *declared);
    }
    path_.pop_back();
    indices_.emplace(type, index);
    return index;
  }

  void addField(std::size_t index, std::size_t line, const Declaration& declared) {
    Field field;
    field.name = declared.name;
    field.arity = declared.arity;
    field.length = declared.length;
    if (const auto type = builtin(declared.type)) {
      field.type = *type;
    } else {
      field.type = FieldType::Message;
      field.message = addType(resolve(index, line, declared));
    }
    measure(index, line, field);
    schema_.types_[index].fields.push_back(std::move(field));
  }

  /// The full name of a field's message type; it has a section and is not being parsed already.
  std::string resolve(std::size_t index, std::size_t line, const Declaration& declared) {
    const std::string& owner = schema_.types_[index].name;
    std::string type(declared.type);
    if (type == "Header") {
      type = sections_.count("roslib/Header") > 0 ? "roslib/Header" : "std_msgs/Header";
    } else if (type.find('/') == std::string::npos) {
      type = owner.substr(0, owner.find('/') + 1) + type;
    }
    if (sections_.count(type) == 0) {
      if (type != "std_msgs/Header" && type != "roslib/Header") {
        fail(line, "field " + std::string(declared.name) + " of " + owner + " is of type " + type +
                       ", whose definition is missing");
      }
      addHeader(type, line);
    }
    if (std::find(path_.begin(), path_.end(), type) != path_.end()) {
      fail(line,
           type + " contains itself, through field " + std::string(declared.name) + " of " + owner);
    }
    if (path_.size() >= Schema::kDeepest) {
      fail(line, "messages are nested more than " + std::to_string(Schema::kDeepest) + " deep");
    }
    return type;
  }

  void addHeader(const std::string& type, std::size_t line) {
    Section& section = sections_[type];
    std::string_view text = kHeaderDefinition;
    while (!text.empty()) {
      section.lines.push_back({line, text.substr(0, text.find('\n'))});
      text.remove_prefix(text.find('\n') + 1);
    }
  }

  /// Keeps the sizes of the type up to date, and its extent with those of all it contains.
  void measure(std::size_t index, std::size_t line, const Field& field) {
    const bool is_message = field.type == FieldType::Message;
    std::size_t size = field.type == FieldType::String ? 4 : fixedSize(field.type);
    if (is_message) size = schema_.minimum_sizes_[field.message];
    bool fixed = field.type != FieldType::String;
    if (is_message) fixed = schema_.fixed_sizes_[field.message];
    if (field.arity == Field::Arity::FixedArray) {
      size = multiply(size, field.length);
      if (field.length == 0) fixed = true;
    }
    if (field.arity == Field::Arity::DynamicArray) {
      size = 4;
      fixed = false;
    }
    schema_.minimum_sizes_[index] = add(schema_.minimum_sizes_[index], size);
    if (!fixed) schema_.fixed_sizes_[index] = false;
    if (is_message) extents_[index].addInner(extents_[field.message], field.name.size() + 1);
    extents_[index].addField(field.name.size(), size == 0);
    checkExtent(line, extents_[index]);
  }

  /// The extent of the tree of fields that a type describes.
  struct Extent {
    std::size_t fields = 0, empty_fields = 0, path_letters = 0;

    void addField(std::size_t letters, bool is_empty) {
      ++fields;
      empty_fields += is_empty ? 1 : 0;
      path_letters = add(path_letters, letters);
    }
    void addInner(const Extent& inner, std::size_t prefix_letters) {
      fields += inner.fields;
      empty_fields += inner.empty_fields;
      path_letters = add(path_letters, add(inner.path_letters, inner.fields * prefix_letters));
    }
  };

  void checkExtent(std::size_t line, const Extent& extent) const {
    const auto check = [&](std::size_t value, std::size_t most, const std::string& of) {
      if (value > most) fail(line, "more than " + std::to_string(most) + of);
    };
    check(extent.fields, Schema::kMostFields, " fields in all");
    check(extent.empty_fields, Schema::kMostEmptyFields, " fields that take no bytes");
    check(extent.path_letters, Schema::kLongestPaths, " letters in the paths of its fields");
  }

  /// Empty for comments and constants.
  std::optional<Declaration> declaration(const Line& line) const {
    const std::string_view text = trimmed(line.text.substr(0, line.text.find('#')));
    if (text.empty()) return std::nullopt;
    const std::size_t gap = text.find_first_of(" \t");
    if (gap == std::string_view::npos) {
      fail(line.number, "\"" + std::string(text) + "\" is no field; expected \"type name\"");
    }
    Declaration declared;
    declared.type = text.substr(0, gap);
    declared.name = trimmed(text.substr(gap));
    if (const std::size_t equals = declared.name.find('='); equals != std::string_view::npos) {
      declared.name = trimmed(declared.name.substr(0, equals));
      checkConstant(line.number, declared);
      return std::nullopt;
    }
    takeBrackets(line.number, declared);
    checkNames(line.number, declared);
    return declared;
  }

  void checkConstant(std::size_t line, const Declaration& declared) const {
    const auto type = builtin(declared.type);
    if (!type || *type == FieldType::Time || *type == FieldType::Duration) {
      fail(line, "a constant cannot be of type " + std::string(declared.type));
    }
    if (!isName(declared.name)) {
      fail(line, "\"" + std::string(declared.name) + "\" is no name for a constant");
    }
  }

  /// Moves the "[9]" of a declaration's type into its arity.
  void takeBrackets(std::size_t line, Declaration& declared) const {
    const std::size_t open = declared.type.find('[');
    if (open == std::string_view::npos) return;
    const std::string_view inside = declared.type.substr(open + 1);
    const std::string whole(declared.type);
    declared.type = declared.type.substr(0, open);
    if (inside == "]") {
      declared.arity = Field::Arity::DynamicArray;
      return;
    }
    declared.arity = Field::Arity::FixedArray;
    std::uint32_t length = 0;
    const auto [end, error] = std::from_chars(inside.data(), inside.data() + inside.size(), length);
    if (error != std::errc() ||
        inside.substr(static_cast<std::size_t>(end - inside.data())) != "]") {
      fail(line, "\"" + whole + "\" is no array type; expected type[] or type[length]");
    }
    declared.length = length;
  }

  void checkNames(std::size_t line, const Declaration& declared) const {
    if (!isName(declared.type) && !isQualified(declared.type)) {
      fail(line, "\"" + std::string(declared.type) + "\" is no type");
    }
    if (!isName(declared.name)) {
      fail(line, "\"" + std::string(declared.name) + "\" is no name for a field");
    }
  }

  const std::string root_;
  Schema schema_;
  std::map<std::string, Section> sections_;
  std::map<std::string, std::size_t> indices_;  // of types that are complete
  std::vector<Extent> extents_;                 // with all that a type contains
  std::vector<std::string> path_;               // types that are being parsed
};

Schema Schema::parse(const std::string& type, std::string_view definition) {
  return SchemaParser(type, definition).parse();
}

Schema Schema::of(const Channel& channel) { return parse(channel.type, channel.definition); }

std::shared_ptr<const Schema> Schema::understood(const std::string& type,
                                                 std::string_view definition) {
  try {
    return std::make_shared<const Schema>(parse(type, definition));
  } catch (const MessageError&) {
    return nullptr;
  }
}

namespace {

void visitFieldsOf(const Schema& schema, std::size_t type_index, const std::string& prefix,
                   const std::function<void(const MessageType&, const Field&,
                                            const std::string&)>& visit) {
  const MessageType& type = schema.types()[type_index];
  for (const Field& field : type.fields) {
    const std::string path =
        prefix + field.name + (field.arity == Field::Arity::Single ? "" : "[]");
    if (field.type == FieldType::Message) {
      visitFieldsOf(schema, field.message, path + ".", visit);
    } else {
      visit(type, field, path);
    }
  }
}

}  // namespace

void visitFields(const Schema& schema,
                 const std::function<void(const MessageType&, const Field&, const std::string&)>&
                     visit) {
  visitFieldsOf(schema, 0, "", visit);
}

}  // namespace afterglow::replay
