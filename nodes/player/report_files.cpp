#include "nodes/player/report_files.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "nodes/player/replay_page.hpp"
#include "nodes/tools/calibration_folder.hpp"

namespace afterglow::nodes {

void writeText(const std::string& path, const std::string& text) {
  errno = 0;
  std::ofstream file(path, std::ios::trunc);
  file << text;
  if (!file.flush()) {
    throw std::runtime_error(path + ": cannot be written" +
                             (errno != 0 ? std::string(": ") + std::strerror(errno) : ""));
  }
}

std::string reportJson(const replay::PlayReport& report, int indent) {
  return toJson(report).dump(indent, ' ', false, nlohmann::json::error_handler_t::replace);
}

void saveReport(const std::string& folder, const replay::PlayReport& report) {
  std::filesystem::create_directories(folder);
  const std::string now = dateNow();
  std::string compact = now;
  compact.erase(std::remove_if(compact.begin(), compact.end(),
                               [](char letter) { return letter == '-' || letter == ':'; }),
                compact.end());
  const std::string name = folder + "/" + std::to_string(report.behavior_id) + "_" + compact;
  std::string free_name = name;
  for (int i = 2; std::filesystem::exists(free_name + ".json"); ++i) {
    free_name = name + "_" + std::to_string(i);
  }
  writeText(free_name + ".json", reportJson(report, 2) + "\n");
  writeText(free_name + ".html", replayPage({report}, now));
}

}  // namespace afterglow::nodes
