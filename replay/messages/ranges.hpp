/// \file
/// The standard's questions about all elements, of a whole range.
#pragma once

#include <algorithm>
#include <iterator>

namespace afterglow::replay {

template <typename Range, typename Predicate>
bool anyOf(const Range& range, const Predicate& holds) {
  return std::any_of(std::begin(range), std::end(range), holds);
}

template <typename Range, typename Predicate>
bool allOf(const Range& range, const Predicate& holds) {
  return std::all_of(std::begin(range), std::end(range), holds);
}

template <typename Range, typename Value>
bool contains(const Range& range, const Value& value) {
  return std::find(std::begin(range), std::end(range), value) != std::end(range);
}

}  // namespace afterglow::replay
