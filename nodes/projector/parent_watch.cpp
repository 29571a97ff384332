#include "nodes/projector/parent_watch.hpp"

#include <iterator>
#include <limits>

#include "nodes/conversion/geometry_conversion.hpp"

namespace afterglow::nodes {
namespace {

constexpr std::size_t kMostChildren = 10'000, kMostParents = 8;
constexpr std::int64_t kStatic = std::numeric_limits<std::int64_t>::max();

}  // namespace

void ParentWatch::note(const std::string& child, const std::string& parent,
                       const std::string& publisher, bool is_static, std::int64_t now_ns) {
  if (links_.size() >= kMostChildren && links_.count(child) == 0) return;
  auto& parents = links_[child];
  if (parents.size() >= kMostParents && parents.count(parent) == 0) return;
  for (auto it = parents.begin(); is_static && it != parents.end();) {
    const bool is_replaced = it->second.at_ns == kStatic && it->second.publisher == publisher;
    it = is_replaced ? parents.erase(it) : std::next(it);
  }
  parents[parent] = {publisher, is_static ? kStatic : now_ns};
}

std::vector<std::string> ParentWatch::conflicts(std::int64_t now_ns) const {
  std::vector<std::string> all;
  for (const auto& [child, parents] : links_) {
    std::string words;
    int count = 0;
    for (const auto& [parent, link] : parents) {
      if (link.at_ns < now_ns - kMemoryNs) continue;
      words += std::string(++count > 1 ? " and '" : "'") + printable(parent) + "' (published by " +
               printable(link.publisher) + ")";
    }
    if (count < 2) continue;
    all.push_back("frame '" + printable(child) + "' has " +
                  (count == 2 ? "two" : std::to_string(count)) + " parents: " + words);
  }
  return all;
}

}  // namespace afterglow::nodes
