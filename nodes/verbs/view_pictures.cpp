#include "nodes/verbs/view_pictures.hpp"

#include <algorithm>
#include <filesystem>
#include <map>
#include <stdexcept>

#include "replay/messages/text.hpp"

namespace afterglow::nodes {
namespace {

namespace fs = std::filesystem;
const std::string kPlain = "_plain";

bool isPicture(const fs::path& path) {
  const std::string ending = path.extension().string();
  return ending == ".png" || ending == ".jpg" || ending == ".jpeg";
}

}  // namespace

std::vector<ViewFiles> findViews(const std::string& folder) {
  std::error_code error;
  std::map<std::string, ViewFiles> views;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error)) {
    std::string name = entry.path().stem().string();
    if (!isPicture(entry.path()) || name.rfind("view_", 0) != 0) continue;
    const bool is_plain = replay::endsWith(name, kPlain);
    if (is_plain) name.resize(name.size() - kPlain.size());
    ViewFiles& view = views[name];
    view.name = name;
    (is_plain ? view.plain : view.pattern) = entry.path().string();
  }
  if (error) throw std::runtime_error(folder + ": cannot be read: " + error.message());
  if (views.empty()) {
    throw std::runtime_error(folder +
                             ": no photographs: expected view_00.png, view_00_plain.png "
                             "and so on");
  }
  std::vector<ViewFiles> list;
  for (const auto& [name, view] : views) {
    if (view.pattern.empty()) {
      throw std::runtime_error(view.plain + ": there is no " + name + ".png of the pattern to it");
    }
    list.push_back(view);
  }
  return list;
}

calib::Photographs loadPhotographs(const ViewFiles& files) {
  calib::Photographs photographs;
  photographs.name = files.name;
  photographs.pattern = calib::loadPicture(files.pattern);
  if (!files.plain.empty()) photographs.plain = calib::loadPicture(files.plain);
  return photographs;
}

}  // namespace afterglow::nodes
