#include "replay/plan/refusal_text.hpp"

#include <fmt/format.h>

namespace afterglow::replay {

std::string someOf(const std::vector<std::string>& names, std::size_t most) {
  if (names.size() <= most) return fmt::format("{}", fmt::join(names, ", "));
  const auto end = names.begin() + static_cast<std::ptrdiff_t>(most);
  return fmt::format("{} and {} more", fmt::join(names.begin(), end, ", "), names.size() - most);
}

}  // namespace afterglow::replay
