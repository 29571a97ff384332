#include "replay/clock/worker_thread.hpp"

#include <gtest/gtest.h>

#include <future>
#include <vector>

namespace afterglow::replay::worker_thread_test {
namespace {

/// A thread that is held by its first task until it may go.
class HeldTasks : public ::testing::Test {
 protected:
  HeldTasks() {
    thread_.post([this] {
      has_begun_.set_value();
      may_go_.get_future().wait();
    });
    has_begun_.get_future().wait();
  }

  std::promise<void> has_begun_, may_go_;
  TaskThread thread_{4};
};

TEST_F(HeldTasks, areDoneInTheirOrder) {
  std::vector<int> done;
  std::promise<void> are_done;
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(thread_.post([&done, i] { done.push_back(i); }));
  EXPECT_TRUE(thread_.post([&] { are_done.set_value(); }));
  may_go_.set_value();
  are_done.get_future().wait();
  EXPECT_EQ(done, (std::vector<int>{0, 1, 2}));
}

TEST_F(HeldTasks, leaveRoomForWhatMayWaitLonger) {
  EXPECT_TRUE(thread_.post([] {}, 2));
  EXPECT_TRUE(thread_.post([] {}, 2));
  EXPECT_FALSE(thread_.post([] {}, 2));
  EXPECT_TRUE(thread_.post([] {}));
  EXPECT_TRUE(thread_.post([] {}));
  EXPECT_FALSE(thread_.post([] {}));
  may_go_.set_value();
}

}  // namespace
}  // namespace afterglow::replay::worker_thread_test
