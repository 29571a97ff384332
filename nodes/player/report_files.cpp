#include "nodes/player/report_files.hpp"

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "calib/file_replacement.hpp"
#include "nodes/pages/replay_page.hpp"
#include "replay/query/time_text.hpp"

namespace afterglow::nodes {

std::string reportJson(const replay::PlayReport& report, int indent) {
  return toJson(report).dump(indent, ' ', false, nlohmann::json::error_handler_t::replace);
}

void saveReport(const std::string& folder, const replay::PlayReport& report) {
  const std::string now = replay::dateNow();
  std::string compact = now;
  compact.erase(std::remove_if(compact.begin(), compact.end(),
                               [](char letter) { return letter == '-' || letter == ':'; }),
                compact.end());
  const std::string name = folder + "/" + std::to_string(report.behavior_id) + "_" + compact;
  std::string free_name = name;
  for (int i = 2; std::filesystem::exists(free_name + ".json"); ++i) {
    free_name = name + "_" + std::to_string(i);
  }
  calib::FileReplacement files;
  files.add(free_name + ".json", reportJson(report, 2) + "\n");
  files.add(free_name + ".html", replayPage({report}, replay::timeText(replay::wallNow())));
  files.commit();
}

}  // namespace afterglow::nodes
