// Built in place of behavior_tree_v3_test, so that the summary says what was not tested.
#include <gtest/gtest.h>

namespace {

TEST(BehaviorTreeV3, isObservedAndRecorded) { GTEST_SKIP() << "BehaviorTree.CPP 3 was not found"; }

}  // namespace
