#include "nodes/console/heard_diagnostics.hpp"

#include <cmath>
#include <cstdlib>
#include <utility>

namespace afterglow::nodes {
namespace {

using Json = nlohmann::ordered_json;
using diagnostic_msgs::DiagnosticStatus;

constexpr int kSilent = 3;  // diagnostic_msgs' STALE

std::string valueOf(const DiagnosticStatus& status, const std::string& key) {
  for (const auto& value : status.values) {
    if (value.key == key) return value.value;
  }
  return "";
}

/// 0 for what is none.
double numberOf(const DiagnosticStatus& status, const std::string& key) {
  const double number = std::strtod(valueOf(status, key).c_str(), nullptr);
  return std::isfinite(number) ? number : 0;
}

/// "/layer" of "projector_node: /layer"; empty for others.
std::string layerOf(const DiagnosticStatus& status) {
  const std::size_t at = status.name.find(": /");
  return at == std::string::npos ? "" : status.name.substr(at + 2);
}

}  // namespace

HeardDiagnostics::HeardDiagnostics() {
  subscriber_ = node_.subscribe<diagnostic_msgs::DiagnosticArray>(
      "/diagnostics", 50, [this](const auto& array) { hear(*array); });
}

void HeardDiagnostics::hear(const diagnostic_msgs::DiagnosticArray& array) {
  const Time now = std::chrono::steady_clock::now();
  const std::lock_guard<std::mutex> lock(mutex_);
  for (auto heard = heard_.begin(); heard != heard_.end();) {
    heard = now - heard->second.at > kKept ? heard_.erase(heard) : std::next(heard);
  }
  for (const DiagnosticStatus& status : array.status) {
    if (heard_.size() >= kMost && heard_.count(status.name) == 0) continue;
    Heard& heard = heard_[status.name];
    const double received = numberOf(status, "received");
    const double seconds = std::chrono::duration<double>(now - heard.at).count();
    const bool is_next = heard.at != Time() && received >= heard.received && seconds > 0.1;
    if (is_next) heard.hz = std::round((received - heard.received) / seconds * 10) / 10;
    heard.received = received;
    heard.status = status;
    heard.at = now;
  }
}

Json HeardDiagnostics::all() const {
  const Time now = std::chrono::steady_clock::now();
  const std::lock_guard<std::mutex> lock(mutex_);
  auto list = Json::array();
  for (const auto& [name, heard] : heard_) {
    const bool is_fresh = now - heard.at <= kFresh;
    const std::string words = (is_fresh ? "" : "not heard any more; last: ") + heard.status.message;
    list.push_back({{"name", name},
                    {"level", is_fresh ? static_cast<int>(heard.status.level) : kSilent},
                    {"words", words}});
  }
  return list;
}

Json HeardDiagnostics::projector() const {
  const Time now = std::chrono::steady_clock::now();
  const std::lock_guard<std::mutex> lock(mutex_);
  std::string words;
  auto layers = Json::array();
  for (const auto& [name, heard] : heard_) {
    const DiagnosticStatus& status = heard.status;
    if (status.hardware_id != "projector" || now - heard.at > kFresh) continue;
    const std::string layer = layerOf(status);
    if (layer.empty()) {
      words += (words.empty() ? "" : "; ") + status.message;
    } else {
      layers.push_back({{"topic", layer},
                        {"hz", heard.hz},
                        {"shown", numberOf(status, "shown") > 0},
                        {"words", status.message}});
    }
  }
  if (words.empty() && layers.empty()) words = "no projector is heard";
  return {{"layers", layers}, {"words", words}};
}

Json HeardDiagnostics::recorder() const {
  const Time now = std::chrono::steady_clock::now();
  const std::lock_guard<std::mutex> lock(mutex_);
  for (const auto& [name, heard] : heard_) {
    const DiagnosticStatus& status = heard.status;
    if (status.hardware_id != "recorder" || now - heard.at > kFresh) continue;
    const std::string dropped = valueOf(status, "dropped");
    return {{"words", status.message + "; " + valueOf(status, "messages_per_s") +
                          " messages a second, " + dropped + " lost"},
            {"recording", numberOf(status, "behaviors") > 0},
            {"messages", numberOf(status, "messages")},
            {"lost", numberOf(status, "dropped")},
            {"store", valueOf(status, "store")}};
  }
  return Json::object();
}

}  // namespace afterglow::nodes
