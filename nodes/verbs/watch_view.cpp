#include "nodes/verbs/watch_view.hpp"

#include <diagnostic_msgs/DiagnosticStatus.h>
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <set>

namespace afterglow::nodes {
namespace {

using diagnostic_msgs::DiagnosticStatus;

constexpr std::size_t kMostLines = 1000;

/// Returns the figures that a recorder's message leaves out.
std::string recorderFigures(const HeardStatus& status) {
  std::string text =
      fmt::format(", {} messages/s, {:.2f} MB/s, queue {} %", status.value("messages_per_s"),
                  status.number("bytes_per_s") * 1e-6, status.value("queue_percent"));
  if (status.number("dropped") > 0) text += ", " + status.value("dropped") + " lost in all";
  if (status.number("unsent_behaviors") > 0) {
    text += ", " + status.value("unsent_behaviors") + " behaviors not sent yet";
  }
  return text + ", into " + status.value("store");
}

/// Returns the figures that a projector's or a layer's message leaves out.
std::string projectorFigures(const HeardStatus& status) {
  if (status.values.count("drawn_hz") > 0) {
    return ", " + status.value("drawn_hz") + " of " + status.value("wanted_hz") + " Hz";
  }
  const bool is_known = status.values.count("received") > 0 && status.received_hz >= 0;
  return is_known ? fmt::format(", {:.1f} messages/s", status.received_hz) : "";
}

WatchLine::Level levelOf(const HeardStatus& status) {
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

WatchView::WatchView() : statuses_(kMostLines) {}

WatchView::Said* WatchView::find(const std::string& name) {
  if (said_.size() >= kMostLines && said_.count(name) == 0) return nullptr;
  return &said_[name];
}

void WatchView::take(const diagnostic_msgs::DiagnosticArray& message, std::int64_t now_ns) {
  for (const DiagnosticStatus& status : message.status) {
    const HeardStatus* heard = isOurs(status) ? statuses_.take(status, now_ns) : nullptr;
    Said* said = heard != nullptr ? find(status.name) : nullptr;
    if (said == nullptr) continue;
    const std::string figures =
        heard->hardware == "recorder" ? recorderFigures(*heard) : projectorFigures(*heard);
    *said = {{heard->name, levelOf(*heard), heard->message + figures, heard->values}, now_ns};
  }
}

void WatchView::take(const std::string& node, const ReplayStatus& status, std::int64_t now_ns) {
  Said* said = find(node + ": player");
  if (said == nullptr) return;
  const bool is_idle = status.state == ReplayStatus::IDLE;
  std::string text = "idle";
  if (!is_idle) {
    text = fmt::format("{} behavior {} '{}', {:.1f} of {:.1f} s at rate {:.2f}",
                       status.state == ReplayStatus::PAUSED     ? "paused in"
                       : status.state == ReplayStatus::TO_START ? "on its way to the start of"
                                                                : "playing",
                       status.behavior_id, status.behavior_name, status.position, status.duration,
                       status.rate);
  }
  if (!status.message.empty()) text += (is_idle ? "; the last replay: " : "; ") + status.message;
  const bool waits = !is_idle && !status.message.empty();
  const auto level = waits ? WatchLine::Level::Warning : WatchLine::Level::Ok;
  *said = {{node + ": player", level, text, {}}, now_ns, !is_idle};
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
