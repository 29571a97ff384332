#include "nodes/tools/diagnostics.hpp"

#include <cmath>
#include <cstdlib>
#include <utility>

namespace afterglow::nodes {
namespace {

/// A rate over less than that says little.
constexpr std::int64_t kShortest_ns = 100'000'000;

double rateSince(const HeardStatus& before, const HeardStatus& now) {
  const std::int64_t passed_ns = now.at_ns - before.at_ns;
  if (before.at_ns == 0) return -1;
  if (passed_ns < kShortest_ns) return before.received_hz;
  const double received = now.number("received") - before.number("received");
  return received < 0 ? -1 : received * 1e9 / static_cast<double>(passed_ns);
}

}  // namespace

void addValue(diagnostic_msgs::DiagnosticStatus& status, const std::string& key,
              const std::string& value) {
  diagnostic_msgs::KeyValue entry;
  entry.key = key;
  entry.value = value;
  status.values.push_back(entry);
}

HeardStatus::HeardStatus(const diagnostic_msgs::DiagnosticStatus& status)
    : name(status.name),
      hardware(status.hardware_id),
      level(status.level),
      message(status.message) {
  for (const auto& entry : status.values) values.emplace(entry.key, entry.value);
}

std::string HeardStatus::value(const std::string& key) const {
  const auto found = values.find(key);
  return found == values.end() ? "" : found->second;
}

double HeardStatus::number(const std::string& key) const {
  const double number = std::strtod(value(key).c_str(), nullptr);
  return std::isfinite(number) ? number : 0;
}

const HeardStatus* HeardStatuses::take(const diagnostic_msgs::DiagnosticStatus& status,
                                       std::int64_t now_ns) {
  if (heard_.size() >= most_ && heard_.count(status.name) == 0) return nullptr;
  HeardStatus now(status);
  now.at_ns = now_ns;
  HeardStatus& kept = heard_[status.name];
  now.received_hz = rateSince(kept, now);
  kept = std::move(now);
  return &kept;
}

void HeardStatuses::forgetBefore(std::int64_t time_ns) {
  for (auto heard = heard_.begin(); heard != heard_.end();) {
    heard = heard->second.at_ns < time_ns ? heard_.erase(heard) : std::next(heard);
  }
}

}  // namespace afterglow::nodes
