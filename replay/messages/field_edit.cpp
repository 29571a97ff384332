#include "replay/messages/field_edit.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

#include "replay/messages/wire.hpp"

namespace afterglow::replay {
namespace {

constexpr std::int64_t kNanoseconds = 1'000'000'000;

/// Throws MessageError unless the span is of this type and lies within the bytes.
void check(const Bytes& bytes, const FieldSpan& span, FieldType type) {
  if (span.type != type) {
    throw MessageError("field at byte " + std::to_string(span.offset) + " is of type " +
                       std::string(name(span.type)) + ", not " + std::string(name(type)));
  }
  if (span.offset > bytes.size() || span.size > bytes.size() - span.offset) {
    throw MessageError("field at byte " + std::to_string(span.offset) +
                       " lies outside of the message");
  }
}

FieldPath::Step parseStep(std::string_view part, std::string_view whole) {
  const auto refuse = [&] {
    throw MessageError("\"" + std::string(whole) + "\" is no field path; expected e.g. a.b[].c[3]");
  };
  FieldPath::Step step;
  const std::size_t open = std::min(part.find('['), part.size());
  step.name = part.substr(0, open);
  if (step.name.empty() || step.name.find(']') != std::string::npos) refuse();
  std::string_view brackets = part.substr(open);
  if (brackets.empty()) return step;
  step.index = FieldPath::Step::Index::Each;
  if (brackets == "[]") return step;
  step.index = FieldPath::Step::Index::One;
  const auto [end, error] =
      std::from_chars(brackets.data() + 1, brackets.data() + brackets.size(), step.at);
  if (error != std::errc() ||
      std::string_view(end, brackets.data() + brackets.size() - end) != "]") {
    refuse();
  }
  return step;
}

}  // namespace

FieldPath FieldPath::parse(std::string_view text) {
  FieldPath path;
  std::string_view rest = text;
  for (bool more = true; more;) {
    const std::size_t dot = std::min(rest.find('.'), rest.size());
    path.steps_.push_back(parseStep(rest.substr(0, dot), text));
    more = dot < rest.size();
    if (more) rest.remove_prefix(dot + 1);
  }
  return path;
}

std::string FieldPath::str() const {
  std::string text;
  for (const Step& step : steps_) {
    text += (text.empty() ? "" : ".") + step.name;
    if (step.index == Step::Index::Each) text += "[]";
    if (step.index == Step::Index::One) text += "[" + std::to_string(step.at) + "]";
  }
  return text;
}

std::optional<Stamp> readTime(const Bytes& bytes, const FieldSpan& span) {
  if (span.type != FieldType::Time) return std::nullopt;
  check(bytes, span, FieldType::Time);
  const std::uint8_t* at = bytes.data() + span.offset;
  return Stamp::fromParts(loadNumber<std::uint32_t>(at), loadNumber<std::uint32_t>(at + 4));
}

std::string readString(const Bytes& bytes, const FieldSpan& span) {
  check(bytes, span, FieldType::String);
  const std::uint8_t* at = bytes.data() + span.offset;
  return std::string(at + 4, at + span.size);
}

std::string stringAt(const Schema& schema, const Bytes& bytes, std::string_view path) {
  const auto spans = findField(schema, bytes, FieldPath::parse(path));
  return spans.empty() ? std::string() : readString(bytes, spans.front());
}

void writeTime(Bytes& bytes, const FieldSpan& span, Stamp stamp) {
  check(bytes, span, FieldType::Time);
  if (stamp.ns < 0 || stamp.ns / kNanoseconds > std::numeric_limits<std::uint32_t>::max()) {
    throw MessageError("ROS time cannot hold a stamp of " + std::to_string(stamp.ns) + " ns");
  }
  std::uint8_t* at = bytes.data() + span.offset;
  storeNumber(at, static_cast<std::uint32_t>(stamp.ns / kNanoseconds));
  storeNumber(at + 4, static_cast<std::uint32_t>(stamp.ns % kNanoseconds));
}

std::size_t editStrings(Bytes& bytes, const std::vector<FieldSpan>& spans,
                        const std::function<std::string(const std::string&)>& edit) {
  Bytes edited;
  std::size_t copied = 0;
  std::size_t changed = 0;
  for (const FieldSpan& span : spans) {
    const std::string before = readString(bytes, span);
    const std::string after = edit(before);
    if (after == before) continue;
    if (after.size() > std::numeric_limits<std::uint32_t>::max()) {
      throw MessageError("a string of " + std::to_string(after.size()) + " bytes fits no message");
    }
    edited.insert(edited.end(), bytes.begin() + static_cast<std::ptrdiff_t>(copied),
                  bytes.begin() + static_cast<std::ptrdiff_t>(span.offset));
    const std::size_t at = edited.size();
    edited.resize(at + 4);
    storeNumber(edited.data() + at, static_cast<std::uint32_t>(after.size()));
    edited.insert(edited.end(), after.begin(), after.end());
    copied = span.offset + span.size;
    ++changed;
  }
  if (changed == 0) return 0;
  edited.insert(edited.end(), bytes.begin() + static_cast<std::ptrdiff_t>(copied), bytes.end());
  bytes = std::move(edited);
  return changed;
}

std::size_t editStrings(const Schema& schema, Bytes& bytes, const FieldPath& path,
                        const std::function<std::string(const std::string&)>& edit) {
  return editStrings(bytes, findField(schema, bytes, path), edit);
}

std::optional<Stamp> headerStamp(const Schema& schema, const Bytes& bytes) {
  if (schema.root().fields.empty()) return std::nullopt;
  const Field& first = schema.root().fields.front();
  if (first.type != FieldType::Message || first.arity != Field::Arity::Single) return std::nullopt;
  const std::string& type = schema.types()[first.message].name;
  if (type != "std_msgs/Header" && type != "roslib/Header") return std::nullopt;
  constexpr std::size_t kStampOffset = 4;  // behind seq
  if (bytes.size() < kStampOffset + 8) {
    throw MessageError(schema.root().name + ": ends within its header");
  }
  return readTime(bytes, {FieldType::Time, kStampOffset, 8});
}

/// The paths as a tree over the schema: the wanted fields of one message type at one place.
struct FieldFinder::Node {
  struct Branch {
    std::size_t field = 0;
    FieldPath::Step::Index index = FieldPath::Step::Index::None;
    std::size_t at = 0;
    std::vector<std::size_t> paths;  ///< indices of the paths that end here
    std::unique_ptr<Node> below;     ///< node of the paths that continue

    bool names(std::size_t element) const {
      return index != FieldPath::Step::Index::One || at == element;
    }
  };
  std::vector<Branch> branches;

  /// Puts the branches of one field together, so that a walk need not search.
  void sort() {
    std::stable_sort(branches.begin(), branches.end(),
                     [](const Branch& a, const Branch& b) { return a.field < b.field; });
    for (Branch& branch : branches) {
      if (branch.below) branch.below->sort();
    }
  }

  Branch& branch(std::size_t field, const FieldPath::Step& step) {
    for (Branch& known : branches) {
      if (known.field == field && known.index == step.index && known.at == step.at) return known;
    }
    branches.emplace_back();
    branches.back().field = field;
    branches.back().index = step.index;
    branches.back().at = step.at;
    return branches.back();
  }
};

namespace {

[[noreturn]] void refuse(const Schema& schema, const FieldPath& path, const std::string& what) {
  throw MessageError("field path " + path.str() + " of " + schema.root().name + ": " + what);
}

/// Index of the field a step names in a type.
std::size_t resolve(const Schema& schema, const FieldPath& path, const MessageType& type,
                    const FieldPath::Step& step) {
  const auto field = std::find_if(type.fields.begin(), type.fields.end(),
                                  [&](const Field& f) { return f.name == step.name; });
  if (field == type.fields.end()) refuse(schema, path, type.name + " has no field " + step.name);
  const bool array = field->arity != Field::Arity::Single;
  const bool indexed = step.index != FieldPath::Step::Index::None;
  if (array && !indexed) {
    refuse(schema, path, step.name + " is an array; expected " + step.name + "[] or an index");
  }
  if (!array && indexed) refuse(schema, path, step.name + " is no array");
  return static_cast<std::size_t>(field - type.fields.begin());
}

/// Calls on_step(field index, step, last) for each step, resolved from the outermost type inwards.
template <typename OnStep>
void follow(const Schema& schema, const FieldPath& path, OnStep&& on_step) {
  std::size_t type_index = 0;
  for (std::size_t i = 0; i < path.steps().size(); ++i) {
    const FieldPath::Step& step = path.steps()[i];
    const MessageType& type = schema.types()[type_index];
    const std::size_t index = resolve(schema, path, type, step);
    const Field& field = type.fields[index];
    const bool last = i + 1 == path.steps().size();
    if (!last && field.type != FieldType::Message) {
      refuse(schema, path,
             step.name + " is a " + std::string(name(field.type)) + " and has no field " +
                 path.steps()[i + 1].name);
    }
    on_step(index, step, last);
    type_index = field.message;
  }
}

/// A walk over one message along a tree of paths. Node is FieldFinder's private type.
template <typename Node>
class Walk {
 public:
  Walk(const Schema& schema, const Bytes& bytes, std::vector<std::vector<FieldSpan>>& found)
      : schema_(schema), reader_(schema, bytes), found_(found) {}

  void run(const Node& root) {
    message(0, root);
    reader_.finish();
  }

 private:
  void message(std::size_t type_index, const Node& node) {
    const std::vector<Field>& fields = schema_.types()[type_index].fields;
    auto next = node.branches.begin();
    for (std::size_t i = 0; i < fields.size(); ++i) {
      const auto first = next;
      while (next != node.branches.end() && next->field == i) ++next;
      if (first != next) {
        elements(fields[i], first, next);
      } else {
        reader_.skipField(fields[i]);
      }
    }
  }

  template <typename Branches>
  void elements(const Field& field, Branches first, Branches end) {
    reader_.enter(field);
    std::size_t count = reader_.count(field);
    // Elements without bytes have no fields to be found, however many a message claims.
    if (field.arity != Field::Arity::Single && field.type == FieldType::Message &&
        schema_.minimumSize(field.message) == 0) {
      count = 0;
    }
    for (std::size_t element = 0; element < count; ++element) {
      reader_.atElement(element);
      const std::size_t start = reader_.offset();
      bool passed = false;
      for (auto branch = first; branch != end; ++branch) {
        if (!branch->names(element)) continue;
        reader_.seek(start);  // two branches may name the same element
        take(field, *branch);
        passed = true;
      }
      if (!passed) reader_.skipElement(field);
    }
    reader_.leave();
  }

  template <typename Branch>
  void take(const Field& field, const Branch& branch) {
    const std::size_t start = reader_.offset();
    if (branch.below) {
      message(field.message, *branch.below);
    } else {
      reader_.skipElement(field);
    }
    for (const std::size_t path : branch.paths) {
      found_[path].push_back({field.type, start, reader_.offset() - start});
    }
  }

  const Schema& schema_;
  WireReader reader_;
  std::vector<std::vector<FieldSpan>>& found_;
};

}  // namespace

FieldFinder::FieldFinder(Schema schema, const std::vector<FieldPath>& paths)
    : schema_(std::move(schema)), path_count_(paths.size()), root_(std::make_unique<Node>()) {
  for (std::size_t i = 0; i < paths.size(); ++i) {
    Node* node = root_.get();
    follow(schema_, paths[i], [&](std::size_t field, const FieldPath::Step& step, bool last) {
      Node::Branch& branch = node->branch(field, step);
      if (last) {
        branch.paths.push_back(i);
        return;
      }
      if (!branch.below) branch.below = std::make_unique<Node>();
      node = branch.below.get();
    });
  }
  root_->sort();
}

FieldFinder::FieldFinder(const Schema& schema, const FieldPath& path)
    : FieldFinder(schema, std::vector<FieldPath>{path}) {}

FieldFinder::~FieldFinder() = default;
FieldFinder::FieldFinder(FieldFinder&&) noexcept = default;
FieldFinder& FieldFinder::operator=(FieldFinder&&) noexcept = default;

std::vector<std::vector<FieldSpan>> FieldFinder::find(const Bytes& bytes) const {
  std::vector<std::vector<FieldSpan>> found(path_count_);
  Walk<Node>(schema_, bytes, found).run(*root_);
  return found;
}

std::vector<FieldSpan> findField(const Schema& schema, const Bytes& bytes, const FieldPath& path) {
  return std::move(FieldFinder(schema, path).find(bytes).front());
}

bool fits(const Schema& schema, const Bytes& bytes) {
  try {
    WireReader reader(schema, bytes);
    for (const Field& field : schema.root().fields) reader.skipField(field);
    reader.finish();
  } catch (const MessageError&) {
    return false;
  }
  return true;
}

}  // namespace afterglow::replay
