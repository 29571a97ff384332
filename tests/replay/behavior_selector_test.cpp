#include "replay/query/behavior_selector.hpp"

#include <gtest/gtest.h>

#include "replay/store/open/open_store.hpp"
#include "tests/support/store_samples.hpp"

namespace afterglow::replay::behavior_selector_test {
namespace {

/// Ids count up in time.
class BehaviorSelector : public testing::Test {
 protected:
  BehaviorSelector() {
    const auto recording = store_->addRecording({0, "", "test", ""});
    for (const auto& [name, outcome] :
         std::vector<std::pair<std::string, std::string>>{{"pick", "failure"},
                                                          {"pick", "success"},
                                                          {"Place", "success"},
                                                          {"pick", "failure"},
                                                          {"open gripper", "stopped"},
                                                          {"close gripper", "incomplete"},
                                                          {"last supper", "success"},
                                                          {"pick", "success"}}) {
      Behavior behavior = test::sampleBehavior(recording, {}, now_ns_ * 100, now_ns_ * 100 + 50);
      ++now_ns_;
      behavior.name = name;
      behavior.outcome = outcome;
      behavior.key = now_ns_ == 3 ? std::string(32, 'b') : "";
      store_->addBehavior(behavior);
    }
  }

  std::int64_t id(const std::string& text) const { return selectBehavior(*store_, text).id; }
  std::string error(const std::string& text) const {
    try {
      selectBehavior(*store_, text);
    } catch (const StoreError& refused) {
      return refused.what();
    }
    return "";
  }

  std::unique_ptr<Store> store_ = openMemoryStore();
  std::int64_t now_ns_ = 0;
};

TEST_F(BehaviorSelector, takesIdsAndKeys) {
  EXPECT_EQ(id("5"), 5);
  EXPECT_EQ(id(std::string(32, 'b')), 3);
  EXPECT_EQ(error("9"), "there is no behavior 9");
}

TEST_F(BehaviorSelector, takesNames) {
  EXPECT_EQ(id("pick"), 8);
  EXPECT_EQ(id("place"), 3);
  EXPECT_EQ(id("open"), 5);
  EXPECT_EQ(id("last supper"), 7);
}

TEST_F(BehaviorSelector, takesOrderAndOutcome) {
  EXPECT_EQ(id("last pick"), 8);
  EXPECT_EQ(id("the last failed pick"), 4);
  EXPECT_EQ(id("first pick"), 1);
  EXPECT_EQ(id("second last pick"), 4);
  EXPECT_EQ(id("3rd latest pick"), 2);
  EXPECT_EQ(id("second pick"), 2);
  EXPECT_EQ(id("last failure"), 4);
  EXPECT_EQ(id("failed pick"), 4);
  EXPECT_EQ(id("first succeeded pick"), 2);
  EXPECT_EQ(id("second last failed one"), 1);
  EXPECT_EQ(id("stopped"), 5);
  EXPECT_EQ(id("The Last incomplete behavior"), 6);
  EXPECT_EQ(id("last"), 8);
}

TEST_F(BehaviorSelector, saysWhatThereIs) {
  EXPECT_EQ(error("pikc"), "there is no behavior \"pikc\"; did you mean pick?");
  EXPECT_EQ(error("gripper"), "\"gripper\" could be any of: close gripper, open gripper");
  EXPECT_EQ(error("the last failed Place"),
            "there is no \"the last failed Place\": the store has no behavior \"Place\" with "
            "outcome failure");
  EXPECT_EQ(error("fifth pick"), "there is no \"fifth pick\": the store has 4 behaviors \"pick\"");
  EXPECT_EQ(
      error("last dance now"),
      "there is no behavior \"dance now\"; there are: Place, close gripper, last supper, open "
      "gripper, pick");
  EXPECT_EQ(error(" "), "no behavior is named: give its id or its name");
}

}  // namespace
}  // namespace afterglow::replay::behavior_selector_test
