// The adapter for BehaviorTree.CPP 3.
#include "afterglow/behavior_tree_v3.hpp"

#include <string>

namespace afterglow::test {

inline std::string modelId(const std::string& id) { return id; }

inline std::string document(const std::string& trees) {
  return R"(<root main_tree_to_execute="MainTree">)" + trees + "</root>";
}

inline std::string parallel(const std::string& children) {
  return R"(<Parallel success_threshold="2" failure_threshold="1">)" + children + "</Parallel>";
}

inline BT::NodeStatus tickOnce(BT::Tree& tree) { return tree.tickRoot(); }

}  // namespace afterglow::test

#include "tests/support/behavior_tree_cases.hpp"
