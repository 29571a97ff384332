#include "nodes/projector/fault_log.hpp"

namespace afterglow::nodes {

void FaultLog::add(std::vector<std::string>& lines, const std::string& what,
                   const std::map<std::string, std::uint64_t>& reasons, std::int64_t now_ns) {
  for (const auto& [reason, count] : reasons) {
    const std::string line = what + reason;
    const auto [said, is_new] = counted_.try_emplace(line, Said{0, now_ns});
    if (count <= said->second.count) continue;
    if (!is_new && now_ns - said->second.at_ns < kAgainNs) continue;
    const std::uint64_t since = count - said->second.count;
    lines.push_back(since == 1 ? line : line + " (" + std::to_string(since) + " times)");
    said->second = {count, now_ns};
  }
}

std::vector<std::string> FaultLog::news(const std::vector<std::string>& problems,
                                        const std::vector<LayerStatus>& layers,
                                        std::int64_t now_ns) {
  std::vector<std::string> lines;
  for (auto it = standing_.begin(); it != standing_.end();) {
    it = now_ns - it->second >= kAgainNs ? standing_.erase(it) : std::next(it);
  }
  for (const std::string& problem : problems) {
    if (standing_.try_emplace(problem, now_ns).second) lines.push_back(problem);
  }
  for (const LayerStatus& layer : layers) {
    add(lines, layer.topic + ": dropped: ", layer.dropped, now_ns);
    add(lines, layer.topic + ": shown, but odd: ", layer.remarks, now_ns);
  }
  return lines;
}

}  // namespace afterglow::nodes
