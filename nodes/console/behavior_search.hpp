/// \file
/// Finding behaviors as one types.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <set>
#include <string>

#include "nodes/console/behavior_index.hpp"

namespace afterglow::nodes {

struct BehaviorSearch {
  /// Words that all have to occur, capitals and accents aside, in name, outcome, tags, tree path,
  /// robot, parameters, notes or what was said. "name:pick", "outcome:", "tag:", "tree:", "robot:",
  /// "said:", "note:" and "parameter:" look there alone; "id:7" is one.
  std::string words;
  std::string name, outcome;                      ///< exactly; empty: any
  std::optional<replay::Stamp> from, to;          ///< end after, begin before
  std::optional<std::set<std::int64_t>> of_these; ///< ids
  std::optional<std::int64_t> before;             ///< only those that come after this id
  std::size_t limit = 100;
};

struct FoundBehaviors {
  std::size_t matching = 0;  ///< all, whatever `before` and `limit` say
  IndexedBehaviors behaviors;
};

FoundBehaviors searchBehaviors(const IndexedBehaviors& all, const BehaviorSearch& search);

/// Returns the text as a search compares it: in small letters and without accents, as far as Latin,
/// Greek and Cyrillic go. Bytes that are no UTF-8 are left out.
std::string foldedText(const std::string& text);
/// Returns all that a search looks at, folded.
std::string searchedText(const BehaviorSummary& one);

}  // namespace afterglow::nodes
