#include "nodes/console/story_difference.hpp"

#include <algorithm>
#include <cstddef>

namespace afterglow::nodes {
namespace {

constexpr std::size_t kMostPaired = 300;

}  // namespace

std::vector<StoryPair> pairStories(const std::vector<StoryEntry>& a,
                                   const std::vector<StoryEntry>& b) {
  const std::size_t rows = std::min(a.size(), kMostPaired);
  const std::size_t columns = std::min(b.size(), kMostPaired);
  // How many pairs there are at most from [i][j] on.
  std::vector<std::vector<int>> most(rows + 1, std::vector<int>(columns + 1, 0));
  for (std::size_t i = rows; i-- > 0;) {
    for (std::size_t j = columns; j-- > 0;) {
      most[i][j] = a[i].subject == b[j].subject ? most[i + 1][j + 1] + 1
                                                : std::max(most[i + 1][j], most[i][j + 1]);
    }
  }
  std::vector<StoryPair> pairs;
  std::size_t i = 0, j = 0;
  while (i < rows || j < columns) {
    if (i < rows && j < columns && a[i].subject == b[j].subject) {
      pairs.push_back({i++, j++});
    } else if (j >= columns || (i < rows && most[i + 1][j] >= most[i][j + 1])) {
      pairs.push_back({i++, std::nullopt});
    } else {
      pairs.push_back({std::nullopt, j++});
    }
  }
  return pairs;
}

}  // namespace afterglow::nodes
