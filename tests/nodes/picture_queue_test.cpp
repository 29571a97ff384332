// In which order pictures are drawn.
#include "nodes/console/picture_queue.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <future>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "replay/store/open/open_store.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::nodes::picture_queue_test {
namespace {

/// Requests wait behind a first one until they are released. They name no stored behavior, so that
/// each is answered 404 in its turn, without OpenGL.
class Queue : public testing::Test {
 protected:
  Queue() {
    auto released = release_.get_future().share();
    std::promise<void> begun;
    queue_.draw({1, 0, PictureView::Projector, 640, "first"}, [&begun, released](const auto&) {
      begun.set_value();
      released.wait();
    });
    begun.get_future().wait();
  }

  void ask(const std::string& viewer, int width) {
    queue_.draw({1, 0, PictureView::Projector, width, viewer}, [this, viewer](const auto& drawn) {
      order_.push_back({viewer, drawn.status});
    });
  }

  std::vector<std::string> answered() {
    release_.set_value();
    std::promise<void> last;
    queue_.draw({1, 0, PictureView::Projector, 64, "last"},
                [&last](const auto&) { last.set_value(); });
    last.get_future().wait();
    std::vector<std::string> viewers;
    for (const auto& [viewer, status] : order_) {
      EXPECT_EQ(status, 404);
      viewers.push_back(viewer);
    }
    return viewers;
  }

 private:
  static PictureSettings settings() {
    PictureSettings made;
    made.config.projectors.resize(1);
    return made;
  }

  test::TempFolder folder_;
  std::unique_ptr<replay::Store> store_ =
      replay::openStore(folder_.path("empty.db"), replay::OpenMode::ReadWrite);
  std::promise<void> release_;
  std::vector<std::pair<std::string, int>> order_;
  PictureQueue queue_{*store_, settings()};
};

TEST_F(Queue, drawsLargePicturesBeforeSmallOnesThatWereRequestedJustBefore) {
  ask("list", 160);
  ask("moments", 320);
  ask("room", 640);
  ask("projector", 640);
  EXPECT_EQ(answered(), (std::vector<std::string>{"room", "projector", "list", "moments"}));
}

TEST_F(Queue, drawsASmallPictureThoughLargeOnesAreRequestedAgainAndAgain) {
  ask("list", 160);
  for (const char* viewer : {"a", "b", "c", "d", "e", "f", "g", "h"}) ask(viewer, 640);
  const auto order = answered();
  EXPECT_EQ(std::find(order.begin(), order.end(), "list") - order.begin(), 4);
}

}  // namespace
}  // namespace afterglow::nodes::picture_queue_test
