/// \file
/// What a replay did, measured.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "replay/play/goal_book.hpp"
#include "replay/play/lateness.hpp"
#include "replay/play/play_plan.hpp"

namespace afterglow::replay {

struct TopicReport {
  std::uint64_t published = 0;
  std::uint64_t skipped = 0;  ///< too late, and overtaken or dangerous
  std::uint64_t refused = 0;  ///< not publishable: the text says why
  std::string problem;        ///< of the last refused one
  bool was_heard = false;     ///< somebody listened when the last message went out
  Lateness lateness;
};

struct PlayReport {
  bool is_complete = false;
  std::string reason;  ///< why it ended early; empty if it did not
  std::vector<std::string> notes;
  std::string scheduling;       ///< of the thread that played, if the caller says so
  std::int64_t planned_ns = 0;  ///< the behavior's length, at the rate
  std::int64_t actual_ns = 0;   ///< from the first deadline to the end, without pauses
  std::vector<std::pair<PlannedTopic, TopicReport>> topics;
  GoalBook::Counts goals;
};

/// Stable keys: completed, reason, notes, scheduling, planned_s, actual_s, goals {sent, succeeded,
/// failed, canceled}, topics {name: {type, modality, planned, published, skipped, refused, problem,
/// heard, lateness_ms {p50, p99, max}, drift_ms, rewritten [{field, rule, count}]}, or {type,
/// count, not_played}}.
nlohmann::ordered_json toJson(const PlayReport& report);
/// The plan alone, as `afterglow play --dry-run` shows it.
nlohmann::ordered_json toJson(const PlayPlan& plan);

}  // namespace afterglow::replay
