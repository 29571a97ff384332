#include "replay/record/file_references.hpp"

#include <algorithm>
#include <functional>
#include <utility>

#include "replay/messages/topic_name.hpp"

namespace afterglow::replay {
namespace {

constexpr std::int8_t kPlayFile = -2;

/// Calls on_place(type, path) for every field that is a message, at any depth.
void visitTypes(const Schema& schema, std::size_t type, const std::string& prefix,
                const std::function<void(const MessageType&, const std::string&)>& on_place) {
  on_place(schema.types()[type], prefix);
  for (const Field& field : schema.types()[type].fields) {
    if (field.type != FieldType::Message) continue;
    const bool is_array = field.arity != Field::Arity::Single;
    visitTypes(schema, field.message, prefix + field.name + (is_array ? "[]." : "."), on_place);
  }
}

bool isField(const MessageType& type, const std::string& name, FieldType expected) {
  return std::any_of(type.fields.begin(), type.fields.end(), [&](const Field& field) {
    return field.name == name && field.type == expected && field.arity == Field::Arity::Single;
  });
}

/// Another package's idea of these types may have other fields.
bool isSound(const MessageType& type) {
  return type.name == kSoundRequestType && isField(type, "sound", FieldType::Int8) &&
         isField(type, "arg", FieldType::String) && isField(type, "arg2", FieldType::String);
}

bool isMesh(const MessageType& type) {
  return type.name == "visualization_msgs/Marker" &&
         isField(type, "mesh_resource", FieldType::String);
}

std::string soundUri(const std::string& arg, const std::string& package) {
  if (!package.empty()) return "package://" + package + "/" + arg;
  return !arg.empty() && arg.front() == '/' ? "file://" + arg : arg;
}

}  // namespace

FileReferences::FileReferences(const Schema& schema) {
  std::vector<FieldPath> meshes, sounds;
  visitTypes(schema, 0, "", [&](const MessageType& type, const std::string& prefix) {
    if (isMesh(type)) {
      meshes.push_back(FieldPath::parse(prefix + "mesh_resource"));
    } else if (isSound(type)) {
      for (const char* field : {"sound", "arg", "arg2"}) {
        sounds.push_back(FieldPath::parse(prefix + field));
      }
    }
  });
  meshes_ = meshes.size();
  sounds_ = sounds.size() / 3;
  meshes.insert(meshes.end(), sounds.begin(), sounds.end());
  if (!meshes.empty()) finder_ = std::make_unique<FieldFinder>(schema, meshes);
}

std::vector<std::string> FileReferences::find(const Bytes& bytes) const {
  std::vector<std::string> uris;
  try {
    visit(bytes,
          [&](const std::string& uri, const FieldSpan&, const FieldSpan*) { uris.push_back(uri); });
  } catch (const MessageError&) {
    uris.clear();
  }
  return uris;
}

void FileReferences::visit(const Bytes& bytes,
                           const std::function<void(const std::string&, const FieldSpan&,
                                                    const FieldSpan*)>& on_file) const {
  if (!finder_) return;
  const auto tell = [&](const std::string& uri, const FieldSpan& name, const FieldSpan* package) {
    if (!uri.empty()) on_file(uri, name, package);
  };
  const std::vector<std::vector<FieldSpan>> places = finder_->find(bytes);
  for (std::size_t i = 0; i < meshes_; ++i) {
    for (const FieldSpan& span : places[i]) tell(readString(bytes, span), span, nullptr);
  }
  for (std::size_t i = 0; i < sounds_; ++i) {
    const auto* place = &places[meshes_ + 3 * i];
    for (std::size_t n = 0; n < place[0].size(); ++n) {
      if (static_cast<std::int8_t>(bytes.at(place[0][n].offset)) != kPlayFile) continue;
      const FieldSpan &name = place[1].at(n), &package = place[2].at(n);
      tell(soundUri(readString(bytes, name), readString(bytes, package)), name, &package);
    }
  }
}

void FileReferences::replace(
    Bytes& bytes, const std::function<std::string(const std::string& uri)>& other) const {
  std::vector<std::pair<FieldSpan, std::string>> texts;
  visit(bytes, [&](const std::string& uri, const FieldSpan& name, const FieldSpan* package) {
    const std::string found = other(uri);
    if (found.empty()) return;
    // sound_play takes a path.
    texts.emplace_back(name, package ? found.substr(std::string("file://").size()) : found);
    if (package) texts.emplace_back(*package, "");
  });
  std::sort(texts.begin(), texts.end(),
            [](const auto& a, const auto& b) { return a.first.offset < b.first.offset; });
  std::vector<FieldSpan> spans;
  for (const auto& [span, text] : texts) spans.push_back(span);
  auto text = texts.begin();
  editStrings(bytes, spans, [&](const std::string&) { return (text++)->second; });
}

}  // namespace afterglow::replay
