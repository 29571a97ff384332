/// \file
/// The wording of a refusal: what is wrong and by how much, what helps; three short sentences at
/// most.
#pragma once

#include <cstddef>
#include <stdexcept>
#include <string>
#include <vector>

namespace afterglow::replay {

/// Motion that may not begin, or go on. `why`: a clause.
struct MotionRefused : std::runtime_error {
  explicit MotionRefused(const std::string& clause)
      : std::runtime_error("motion is refused: " + clause), why(clause) {}
  std::string why;
};

/// The first names, and the number of the others: "a, b and 5 more".
std::string someOf(const std::vector<std::string>& names, std::size_t most = 2);

}  // namespace afterglow::replay
