#include "nodes/verbs/watch_view.hpp"

#include <diagnostic_msgs/DiagnosticStatus.h>
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <set>

namespace afterglow::nodes {
namespace {

using diagnostic_msgs::DiagnosticStatus;
using Values = std::map<std::string, std::string>;

constexpr std::size_t kMostLines = 1000;

std::string valueOf(const Values& values, const std::string& key) {
  const auto found = values.find(key);
  return found == values.end() ? "" : found->second;
}

double numberOf(const Values& values, const std::string& key) {
  return std::strtod(valueOf(values, key).c_str(), nullptr);
}

/// Returns the figures that a recorder's message leaves out.
std::string recorderFigures(const Values& values) {
  std::string text = fmt::format(", {} messages/s, {:.2f} MB/s, queue {} %",
                                 valueOf(values, "messages_per_s"),
                                 numberOf(values, "bytes_per_s") * 1e-6,
                                 valueOf(values, "queue_percent"));
  if (numberOf(values, "dropped") > 0) text += ", " + valueOf(values, "dropped") + " lost in all";
  if (numberOf(values, "unsent_behaviors") > 0) {
    text += ", " + valueOf(values, "unsent_behaviors") + " behaviors not sent yet";
  }
  return text + ", into " + valueOf(values, "store");
}

/// Returns the figures that a projector's or a layer's message leaves out; `per_second`: messages,
/// unknown below 0.
std::string projectorFigures(const Values& values, double per_second) {
  if (values.count("drawn_hz") > 0) {
    return ", " + valueOf(values, "drawn_hz") + " of " + valueOf(values, "wanted_hz") + " Hz";
  }
  const bool is_known = values.count("received") > 0 && per_second >= 0;
  return is_known ? fmt::format(", {:.1f} messages/s", per_second) : "";
}

WatchLine::Level levelOf(const DiagnosticStatus& status) {
  return status.level == DiagnosticStatus::OK     ? WatchLine::Level::Ok
         : status.level == DiagnosticStatus::WARN ? WatchLine::Level::Warning
                                                  : WatchLine::Level::Error;
}

bool isOurs(const DiagnosticStatus& status) {
  static const std::set<std::string> kOwn = {"projector", "recorder"};
  return kOwn.count(status.hardware_id) > 0 && status.name.find(": ") != std::string::npos;
}

}  // namespace

std::string WatchLine::words() const {
  static const char* const kLevels[] = {"ok     ", "warning", "ERROR  "};
  return std::string(kLevels[static_cast<int>(level)]) + "  " + name + ": " + text;
}

std::string WatchLine::kind() const {
  std::string kind = words();
  const auto isFigure = [](unsigned char c) { return std::isdigit(c) != 0 || c == '.'; };
  kind.erase(std::remove_if(kind.begin(), kind.end(), isFigure), kind.end());
  return kind;
}

WatchView::Said* WatchView::find(const std::string& name) {
  if (said_.size() >= kMostLines && said_.count(name) == 0) return nullptr;
  return &said_[name];
}

void WatchView::take(const diagnostic_msgs::DiagnosticArray& message, std::int64_t now_ns) {
  for (const DiagnosticStatus& status : message.status) {
    Said* said = isOurs(status) ? find(status.name) : nullptr;
    if (said == nullptr) continue;
    Values values;
    for (const auto& value : status.values) values[value.key] = value.value;
    const double received = numberOf(values, "received");
    const double seconds = static_cast<double>(now_ns - said->at_ns) * 1e-9;
    const bool is_counted = said->at_ns > 0 && seconds > 0 && received >= said->received;
    const double per_second = is_counted ? (received - said->received) / seconds : -1;
    const std::string figures = status.hardware_id == "recorder"
                                    ? recorderFigures(values)
                                    : projectorFigures(values, per_second);
    said->line = {status.name, levelOf(status), status.message + figures, std::move(values)};
    said->at_ns = now_ns;
    said->received = received;
  }
}

void WatchView::take(const std::string& node, const ReplayStatus& status, std::int64_t now_ns) {
  Said* said = find(node + ": player");
  if (said == nullptr) return;
  const bool is_idle = status.state == ReplayStatus::IDLE;
  std::string text = "idle";
  if (!is_idle) {
    text = fmt::format("{} behavior {} '{}', {:.1f} of {:.1f} s at rate {:.2f}",
                       status.state == ReplayStatus::PAUSED ? "paused in" : "playing",
                       status.behavior_id, status.behavior_name, status.position, status.duration,
                       status.rate);
  }
  if (!status.message.empty()) text += (is_idle ? "; the last replay: " : "; ") + status.message;
  const bool waits = !is_idle && !status.message.empty();
  const auto level = waits ? WatchLine::Level::Warning : WatchLine::Level::Ok;
  *said = {{node + ": player", level, text, {}}, now_ns, !is_idle, 0};
}

std::vector<WatchLine> WatchView::lines(std::int64_t now_ns) const {
  std::vector<WatchLine> all;
  for (const auto& [name, said] : said_) {
    all.push_back(said.line);
    const std::int64_t silent_ns = now_ns - said.at_ns;
    if (!said.is_regular || silent_ns <= kSilenceNs) continue;
    all.back().level = WatchLine::Level::Error;
    all.back().text =
        fmt::format("silent for {} s; before: {}", silent_ns / 1'000'000'000, said.line.text);
  }
  return all;
}

}  // namespace afterglow::nodes
