#include "replay/plan/modality_options.hpp"

#include <cstdlib>
#include <functional>
#include <iterator>
#include <stdexcept>

#include "replay/messages/text.hpp"

namespace afterglow::replay {
namespace {

constexpr double kLongestLatency = 5;  // s

/// Calls the function with each "modality=value".
void eachSetting(const std::vector<std::string>& texts,
                 const std::function<void(Modality, const std::string&)>& take) {
  for (const std::string& text : texts) {
    for (const std::string& part : splitAt(',', text)) {
      const std::size_t sign = part.find('=');
      const auto modality = modalityCalled(part.substr(0, sign));
      if (!modality || sign == std::string::npos) {
        throw std::invalid_argument("'" + part + "': write body=, ar= or speech=");
      }
      take(*modality, part.substr(sign + 1));
    }
  }
}

}  // namespace

std::set<Modality> parseModalities(const std::string& text) {
  std::set<Modality> chosen;
  for (const std::string& word : splitAt(',', text)) {
    const auto modality = modalityCalled(word);
    if (!modality)
      throw std::invalid_argument("'" + word + "' is no modality (body, light or ar, speech)");
    chosen.insert(*modality);
  }
  return chosen.empty() ? std::set<Modality>(std::begin(kModalities), std::end(kModalities))
                        : chosen;
}

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
