// Built in place of behavior_tree_v4_test, so that the summary says what was not tested.
#include <gtest/gtest.h>

namespace {

TEST(BehaviorTreeV4, isObservedAndRecorded) { GTEST_SKIP() << "BehaviorTree.CPP 4 was not found"; }

}  // namespace
