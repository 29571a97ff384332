/// \file
/// The wishes for a replay modality by modality: how much earlier its messages go out, and what
/// becomes of the replay when it fails.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "replay/plan/topic_role.hpp"

namespace afterglow::replay {

/// "body,ar,speech", any of them; empty: all. Throws std::invalid_argument naming an unknown word.
std::set<Modality> parseModalities(const std::string& text);

/// Stop: the whole replay ends, the robot stands, the light is cleared. GoOn: without it; told in
/// the report.
enum class OnFailure { Stop, GoOn };

/// Real seconds, at any rate. No modality: 0.
using ModalityLatency = std::map<Modality, double>;
/// No modality: the body stops, light and speech go on.
using FailurePolicy = std::map<Modality, OnFailure>;

/// "ar=0.05,speech=0.2": how long after its message something is seen, heard or moves, 0 to 5 s.
/// Several texts together. Throws std::invalid_argument, one line.
ModalityLatency parseLatency(const std::vector<std::string>& texts);

double latencyOf(const ModalityLatency& latency, Modality modality);

/// "speech=stop,body=go_on". Throws std::invalid_argument, one line.
FailurePolicy parseOnFailure(const std::vector<std::string>& texts);

OnFailure policyOf(const FailurePolicy& policy, Modality modality);

}  // namespace afterglow::replay
