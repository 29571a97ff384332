#include "replay/plan/modality_options.hpp"

#include <cstdlib>
#include <functional>
#include <sstream>
#include <stdexcept>

namespace afterglow::replay {
namespace {

constexpr double kLongestLatency = 5;  // s

Modality modalityNamed(const std::string& word, const std::string& part) {
  for (const Modality modality : {Modality::Body, Modality::Ar, Modality::Speech}) {
    if (word == name(modality)) return modality;
  }
  throw std::invalid_argument("'" + part + "': write body=, ar= or speech=");
}

/// Calls the function with each "modality=value".
void eachSetting(const std::vector<std::string>& texts,
                 const std::function<void(Modality, const std::string&)>& take) {
  for (const std::string& text : texts) {
    std::istringstream parts(text);
    for (std::string part; std::getline(parts, part, ',');) {
      const std::size_t sign = part.find('=');
      const bool is_setting = sign != std::string::npos;
      take(modalityNamed(is_setting ? part.substr(0, sign) : "", part),
           is_setting ? part.substr(sign + 1) : "");
    }
  }
}

}  // namespace

ModalityLatency parseLatency(const std::vector<std::string>& texts) {
  ModalityLatency latency;
  eachSetting(texts, [&](Modality modality, const std::string& value) {
    char* end = nullptr;
    const double seconds = std::strtod(value.c_str(), &end);
    if (value.empty() || *end != 0 || !(seconds >= 0 && seconds <= kLongestLatency)) {
      throw std::invalid_argument("'" + value + "' is no latency, 0 to 5 s");
    }
    latency[modality] = seconds;
  });
  return latency;
}

FailurePolicy parseOnFailure(const std::vector<std::string>& texts) {
  FailurePolicy policy;
  eachSetting(texts, [&](Modality modality, const std::string& value) {
    if (value != "stop" && value != "go_on") {
      throw std::invalid_argument("'" + value + "' is not what a failure does (stop, go_on)");
    }
    policy[modality] = value == "stop" ? OnFailure::Stop : OnFailure::GoOn;
  });
  return policy;
}

double latencyOf(const ModalityLatency& latency, Modality modality) {
  const auto given = latency.find(modality);
  return given == latency.end() ? 0 : given->second;
}

OnFailure policyOf(const FailurePolicy& policy, Modality modality) {
  const auto found = policy.find(modality);
  if (found != policy.end()) return found->second;
  return modality == Modality::Body ? OnFailure::Stop : OnFailure::GoOn;
}

}  // namespace afterglow::replay
