#include "replay/query/outcome.hpp"

#include <gtest/gtest.h>

#include <string>

namespace afterglow::replay::outcome_test {
namespace {

TEST(Outcome, isBadOnlyWhereItsWordSaysSo) {
  for (const char* word : {"failure", "failed", "FAILURE", "aborted", "exception", "rejected", "lost",
                           "collision_detected", "timeout", "unsuccessful"}) {
    EXPECT_EQ(lookOf(word), OutcomeLook::Bad) << word;
  }
  for (const char* word : {"success", "succeeded", "Success"}) {
    EXPECT_EQ(lookOf(word), OutcomeLook::Good) << word;
  }
}

TEST(Outcome, isNotBadWhereSomebodyEndedItOrNobodySays) {
  // Ctrl-C of record, a behavior tree's halt, an action's cancel, the recorder's own words.
  for (const char* word : {"stopped", "halted", "canceled", "preempted", "recalled", "interrupted",
                           "incomplete", "imported", "tuesday's"}) {
    EXPECT_EQ(lookOf(word), OutcomeLook::Other) << word;
  }
  EXPECT_EQ(lookOf(""), OutcomeLook::Open) << "it still runs";
}

}  // namespace
}  // namespace afterglow::replay::outcome_test
