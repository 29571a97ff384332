#include "replay/query/outcome.hpp"

#include <algorithm>
#include <iterator>

#include "replay/query/nearest.hpp"

namespace afterglow::replay {

OutcomeLook lookOf(const std::string& outcome) {
  // Within words, as "failed", "a timeout", "collision_detected".
  constexpr const char* kGood[] = {"succe", "done"};
  constexpr const char* kBad[] = {"fail",  "abort", "excep",     "error", "reject", "drop",
                                  "lost",  "crash", "collision", "timeout", "timed out",
                                  "unsucce"};
  if (outcome.empty()) return OutcomeLook::Open;
  const std::string words = lowerCase(outcome);
  const auto holds = [&](const auto& parts) {
    return std::any_of(std::begin(parts), std::end(parts), [&](const char* part) {
      return words.find(part) != std::string::npos;
    });
  };
  if (holds(kBad)) return OutcomeLook::Bad;
  return holds(kGood) ? OutcomeLook::Good : OutcomeLook::Other;
}

const char* nameOf(OutcomeLook look) {
  switch (look) {
    case OutcomeLook::Open:
      return "open";
    case OutcomeLook::Good:
      return "good";
    case OutcomeLook::Bad:
      return "bad";
    case OutcomeLook::Other:
      break;
  }
  return "other";
}

}  // namespace afterglow::replay
