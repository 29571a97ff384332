#include "replay/record/snapshot.hpp"

#include <nlohmann/json.hpp>

namespace afterglow::replay {

std::string Snapshot::toJson() const {
  nlohmann::json json = nlohmann::json::object();
  if (!begin.empty()) json["frames"]["begin"] = begin;
  if (!end.empty()) json["frames"]["end"] = end;
  if (!urdf.empty()) json["urdf"] = urdf;
  if (!files.empty()) json["files"] = files;
  return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace afterglow::replay
