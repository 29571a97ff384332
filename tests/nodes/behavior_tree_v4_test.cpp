// The adapter for BehaviorTree.CPP 4, and what only 4 has.
#include "afterglow/behavior_tree_v4.hpp"

#include <algorithm>
#include <regex>
#include <string>

namespace afterglow::test {

/// Model names may hold no spaces since 4.8.4.
inline std::string modelId(std::string id) {
  std::replace(id.begin(), id.end(), ' ', '_');
  return id;
}

/// Trees of version 3: a name that the model cannot have any more is the node's.
inline std::string document(const std::string& trees) {
  static const std::regex id("<(Action|SubTree|BehaviorTree) ID=\"([^\"]* [^\"]*)\"");
  std::string text;
  auto begin = trees.begin();
  for (std::sregex_iterator match(trees.begin(), trees.end(), id), end; match != end; ++match) {
    text.append(begin, trees.begin() + match->position());
    text += "<" + match->str(1) + " ID=\"" + modelId(match->str(2)) + "\"";
    text += match->str(1) == "BehaviorTree" ? "" : " name=\"" + match->str(2) + "\"";
    begin = trees.begin() + match->position() + match->length();
  }
  text.append(begin, trees.end());
  return R"(<root BTCPP_format="4" main_tree_to_execute="MainTree">)" + text + "</root>";
}

inline std::string parallel(const std::string& children) {
  return R"(<Parallel success_count="2" failure_count="1">)" + children + "</Parallel>";
}

inline BT::NodeStatus tickOnce(BT::Tree& tree) { return tree.tickExactlyOnce(); }

}  // namespace afterglow::test

#include "tests/support/behavior_tree_cases.hpp"

namespace afterglow::nodes {

TEST_F(RecordBehaviorDecorator, endsAsSkippedWithASkippedChild) {
  BT::Tree skipped = tree(
      R"(<Sequence><RecordBehavior name="pick"><Action ID="reach" _skipIf="true"/></RecordBehavior>
         <Action ID="grasp"/></Sequence>)");
  EXPECT_EQ(tickToEnd(skipped), Status::SUCCESS);
  EXPECT_EQ(recorder->calls(2), (Calls{"start pick #1", "stop pick skipped"}));
  EXPECT_EQ(world.ticked, Calls{"grasp"});
}

}  // namespace afterglow::nodes
