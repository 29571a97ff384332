#include "replay/record/file_references.hpp"

#include <algorithm>
#include <functional>

namespace afterglow::replay {
namespace {

constexpr std::int8_t kPlayFile = -2;

/// Calls on_place(type name, path) for every field that is a message, at any depth.
void visit(const Schema& schema, std::size_t type, const std::string& prefix,
           const std::function<void(const std::string&, const std::string&)>& on_place) {
  on_place(schema.types()[type].name, prefix);
  for (const Field& field : schema.types()[type].fields) {
    if (field.type != FieldType::Message) continue;
    const bool is_array = field.arity != Field::Arity::Single;
    visit(schema, field.message, prefix + field.name + (is_array ? "[]." : "."), on_place);
  }
}

std::string soundUri(const std::string& arg, const std::string& package) {
  if (!package.empty()) return "package://" + package + "/" + arg;
  return !arg.empty() && arg.front() == '/' ? "file://" + arg : arg;
}

}  // namespace

FileReferences::FileReferences(const Schema& schema) {
  std::vector<FieldPath> meshes, sounds;
  visit(schema, 0, "", [&](const std::string& type, const std::string& prefix) {
    if (type == "visualization_msgs/Marker") {
      meshes.push_back(FieldPath::parse(prefix + "mesh_resource"));
    } else if (type == "sound_play/SoundRequest") {
      for (const char* field : {"sound", "arg", "arg2"}) {
        sounds.push_back(FieldPath::parse(prefix + field));
      }
    }
  });
  meshes_ = meshes.size();
  sounds_ = sounds.size() / 3;
  meshes.insert(meshes.end(), sounds.begin(), sounds.end());
  try {
    if (!meshes.empty()) finder_ = std::make_unique<FieldFinder>(schema, meshes);
  } catch (const MessageError&) {
    // Another package's idea of these types: it has other fields.
  }
}

std::vector<std::string> FileReferences::find(const Bytes& bytes) const {
  std::vector<std::string> uris;
  if (!finder_) return uris;
  try {
    const std::vector<std::vector<FieldSpan>> places = finder_->find(bytes);
    for (std::size_t i = 0; i < meshes_; ++i) {
      for (const FieldSpan& span : places[i]) uris.push_back(readString(bytes, span));
    }
    for (std::size_t i = 0; i < sounds_; ++i) {
      const auto* place = &places[meshes_ + 3 * i];
      for (std::size_t n = 0; n < place[0].size(); ++n) {
        if (static_cast<std::int8_t>(bytes.at(place[0][n].offset)) != kPlayFile) continue;
        uris.push_back(
            soundUri(readString(bytes, place[1].at(n)), readString(bytes, place[2].at(n))));
      }
    }
  } catch (const MessageError&) {
    uris.clear();
  }
  uris.erase(std::remove(uris.begin(), uris.end(), std::string()), uris.end());
  return uris;
}

}  // namespace afterglow::replay
