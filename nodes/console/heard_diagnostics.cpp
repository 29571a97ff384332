#include "nodes/console/heard_diagnostics.hpp"

#include <algorithm>
#include <cmath>

namespace afterglow::nodes {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kSilent = 3;  // diagnostic_msgs' STALE

std::int64_t steadyTime() {
  return std::chrono::nanoseconds(std::chrono::steady_clock::now().time_since_epoch()).count();
}

bool isFresh(const HeardStatus& status, std::int64_t now_ns) {
  return now_ns - status.at_ns <= std::chrono::nanoseconds(HeardDiagnostics::kFresh).count();
}

/// "/layer" of "projector_node: /layer"; empty for others.
std::string layerOf(const HeardStatus& status) {
  const std::size_t at = status.name.find(": /");
  return at == std::string::npos ? "" : status.name.substr(at + 2);
}

}  // namespace

HeardDiagnostics::HeardDiagnostics() {
  subscriber_ = node_.subscribe<diagnostic_msgs::DiagnosticArray>(
      "/diagnostics", 50, [this](const auto& array) { hear(*array); });
}

void HeardDiagnostics::hear(const diagnostic_msgs::DiagnosticArray& array) {
  const std::int64_t now = steadyTime();
  const std::lock_guard<std::mutex> lock(mutex_);
  statuses_.forgetBefore(now - std::chrono::nanoseconds(kKept).count());
  for (const auto& status : array.status) statuses_.take(status, now);
}

Json HeardDiagnostics::all() const {
  const std::int64_t now = steadyTime();
  const std::lock_guard<std::mutex> lock(mutex_);
  auto list = Json::array();
  for (const auto& [name, status] : statuses_.all()) {
    const bool is_fresh = isFresh(status, now);
    const std::string words = (is_fresh ? "" : "not heard any more; last: ") + status.message;
    list.push_back(
        {{"name", name}, {"level", is_fresh ? status.level : kSilent}, {"words", words}});
  }
  return list;
}

Json HeardDiagnostics::projector() const {
  const std::int64_t now = steadyTime();
  const std::lock_guard<std::mutex> lock(mutex_);
  std::string words;
  auto layers = Json::array();
  for (const auto& [name, status] : statuses_.all()) {
    if (status.hardware != "projector" || !isFresh(status, now)) continue;
    const std::string layer = layerOf(status);
    if (layer.empty()) {
      words += (words.empty() ? "" : "; ") + status.message;
    } else {
      layers.push_back({{"topic", layer},
                        {"hz", std::round(std::max(0.0, status.received_hz) * 10) / 10},
                        {"shown", status.number("shown") > 0},
                        {"words", status.message}});
    }
  }
  if (words.empty() && layers.empty()) words = "no projector is heard";
  return {{"layers", layers}, {"words", words}};
}

Json HeardDiagnostics::recorder() const {
  const std::int64_t now = steadyTime();
  const std::lock_guard<std::mutex> lock(mutex_);
  for (const auto& [name, status] : statuses_.all()) {
    if (status.hardware != "recorder" || !isFresh(status, now)) continue;
    return {{"words", status.message + "; " + status.value("messages_per_s") +
                          " messages a second, " + status.value("dropped") + " lost"},
            {"recording", status.number("behaviors") > 0},
            {"messages", status.number("messages")},
            {"lost", status.number("dropped")},
            {"store", status.value("store")}};
  }
  return Json::object();
}

}  // namespace afterglow::nodes
