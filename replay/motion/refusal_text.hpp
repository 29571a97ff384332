/// \file
/// How a refusal is said: what is wrong and by how much, what helps; three short sentences at most.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace afterglow::replay {

/// The first names, and the number of the others: "a, b and 5 more".
std::string someOf(const std::vector<std::string>& names, std::size_t most = 2);

}  // namespace afterglow::replay
