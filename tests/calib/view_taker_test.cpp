#include "calib/guide/view_taker.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "calib/detection/board_pose.hpp"
#include "tests/support/held_board.hpp"

namespace afterglow::calib::view_taker_test {
namespace {

using namespace test;
using Keep = TakerAnswer::Keep;
using Lack = TakerAnswer::Lack;

/// A taker and a camera that shows what is projected so many images late.
class Photographer {
 public:
  explicit Photographer(int lag_images) : taker_(smallBoard(), camera()) {
    shown_.assign(static_cast<std::size_t>(lag_images) + 1, Shown::Plain);
  }
  TakerAnswer next(const Pose& T_camera_board) {
    const Shown visible = shown_.front();
    shown_.erase(shown_.begin());
    const int tags = visible == Shown::Pattern ? tags_of_pattern : 0;
    TakerAnswer answer = taker_.see(image(number_++, T_camera_board, tags), taken);
    shown_.push_back(answer.show);
    last_visible = visible;
    if (!answer.discarded.empty()) discarded = answer.discarded;
    return answer;
  }
  /// Frames until it keeps something, at most so many.
  TakerAnswer until(Keep keep, const Pose& T_camera_board, int at_most = 60) {
    TakerAnswer answer;
    for (int i = 0; i < at_most && answer.keep != keep; ++i) answer = next(T_camera_board);
    return answer;
  }

  int tags_of_pattern = 20;
  std::vector<Pose> taken;
  Shown last_visible = Shown::Black;
  std::string discarded;

 private:
  ViewTaker taker_;
  std::vector<Shown> shown_;
  int number_ = 0;
};

// ------------------------------------------------------------------------------------------ pose

TEST(BoardPose, isFoundThroughTheLensToAMicrometer) {
  const Pose truth = pose(0.05, -0.1, 1.2, 0.3, -0.4);
  auto tags = seen(truth);
  tags.push_back(square(77, 10, 10, 20));  // of some other board
  const auto found = boardPose(tags, smallBoard().tags, camera());
  ASSERT_TRUE(found);
  EXPECT_TRUE(found->T_camera_board.matrix().isApprox(truth.matrix(), 1e-6));
  EXPECT_FALSE(boardPose({tags.front()}, smallBoard().tags, camera()));
}

TEST(BoardPose, leavesOutTagsThatLieElsewhere) {
  const Pose truth = pose(0, 0, 1, 0.3);
  auto tags = seen(truth);
  for (auto& corner : tags.front().corners) corner.x() += 15;
  const auto found = boardPose(tags, smallBoard().tags, camera());
  ASSERT_TRUE(found);
  EXPECT_TRUE(found->T_camera_board.matrix().isApprox(truth.matrix(), 1e-6));
  EXPECT_EQ(found->ids.count(tags.front().id), 0u);
  EXPECT_EQ(found->ids.size(), tags.size() - 1);
}

TEST(BoardPose, leavesOutTagsSeenTwice) {
  const Pose truth = pose(0, 0, 1);
  auto tags = seen(truth);
  tags.push_back(square(0, 500, 400, 30));
  const auto found = boardPose(tags, smallBoard().tags, camera());
  ASSERT_TRUE(found);
  EXPECT_TRUE(found->T_camera_board.matrix().isApprox(truth.matrix(), 1e-6));
}

// ---------------------------------------------------------------------------------------- taking

TEST(ViewTaker, waitsForStillness) {
  Photographer photographer(0);
  for (int i = 0; i < 20; ++i) {
    const TakerAnswer answer = photographer.next(pose(0.002 * i, 0, 1));  // 14 px a second
    EXPECT_EQ(answer.lack, Lack::Stillness);
    EXPECT_EQ(answer.show, Shown::Plain);
  }
  int images = 0;
  while (photographer.next(pose(0.05, 0, 1)).show == Shown::Plain) ASSERT_LT(++images, 20);
  EXPECT_GE(images, 4);  // half a second
}

class LaggingCamera : public testing::TestWithParam<int> {};

TEST_P(LaggingCamera, photographsOnlyWhatIsReallyShown) {
  Photographer photographer(GetParam());
  const Pose held = pose(0, 0, 1);
  EXPECT_EQ(photographer.until(Keep::Pattern, held).keep, Keep::Pattern);
  EXPECT_EQ(photographer.last_visible, Shown::Pattern);
  const TakerAnswer plain = photographer.until(Keep::Plain, held);
  EXPECT_TRUE(plain.is_complete);
  EXPECT_EQ(photographer.last_visible, Shown::Plain);
  EXPECT_EQ(photographer.discarded, "");
  ASSERT_TRUE(plain.T_camera_board);
  EXPECT_TRUE(plain.T_camera_board->matrix().isApprox(held.matrix(), 1e-6));
}
INSTANTIATE_TEST_SUITE_P(Frames, LaggingCamera, testing::Values(0, 1, 2, 7));

TEST(ViewTaker, discardsABoardThatMovedInBetween) {
  Photographer photographer(1);
  ASSERT_EQ(photographer.until(Keep::Pattern, pose(0, 0, 1)).keep, Keep::Pattern);
  photographer.until(Keep::Plain, pose(0.004, 0, 1), 8);
  EXPECT_EQ(photographer.discarded,
            "the board moved while it was photographed: hold it still, or lean it against "
            "something");
}

TEST(ViewTaker, discardsABoardOutsideTheLight) {
  Photographer photographer(0);
  photographer.tags_of_pattern = 1;
  photographer.until(Keep::Pattern, pose(0, 0, 1), 55);
  EXPECT_NE(photographer.discarded.find("hold the board in the projector's light"),
            std::string::npos)
      << photographer.discarded;
}

TEST(ViewTaker, discardsACameraThatRepeatsThePattern) {
  Photographer photographer(60);
  ASSERT_EQ(photographer.until(Keep::Pattern, pose(0, 0, 1), 50).keep, Keep::Nothing);
  EXPECT_FALSE(photographer.discarded.empty());
  ViewTaker taker(smallBoard(), camera());
  std::string discarded;
  for (int i = 0; i < 100 && discarded.empty(); ++i) {
    const int tags = i > 7 ? 20 : 0;  // and so for ever
    discarded = taker.see(image(i, pose(0, 0, 1), tags), {}).discarded;
  }
  EXPECT_NE(discarded.find("goes on showing the pattern"), std::string::npos) << discarded;
}

TEST(ViewTaker, takesNoViewTwiceUnlessForced) {
  Photographer photographer(0);
  photographer.taken = {pose(0, 0, 1)};
  for (int i = 0; i < 10; ++i) EXPECT_EQ(photographer.next(pose(0.05, 0, 1)).lack, Lack::News);
  EXPECT_EQ(photographer.until(Keep::Pattern, pose(0, 0, 1, 0.2)).keep, Keep::Pattern);

  ViewTaker taker(smallBoard(), camera());
  taker.force();
  EXPECT_EQ(taker.see(image(0, pose(0, 0, 1)), photographer.taken).show, Shown::Pattern);
}

TEST(ViewTaker, waitsForTheCamerasExposure) {
  ViewTaker taker(smallBoard(), camera());
  taker.force();
  int number = 0;
  ASSERT_EQ(taker.see(image(number++, pose(0, 0, 1)), {}).show, Shown::Pattern);
  for (int i = 0; i < 20; ++i) {  // fades
    WatchedImage fading = image(number++, pose(0, 0, 1), 20);
    fading.mean_level = 200 - 5 * i;
    EXPECT_EQ(taker.see(fading, {}).keep, Keep::Nothing);
  }
}

TEST(ViewTaker, saysWhichPartOfTheBoardItSees) {
  ViewTaker taker(smallBoard(), camera());
  WatchedImage some = image(0, pose(0, 0, 1));
  some.board.resize(2);
  EXPECT_EQ(taker.see(some, {}).lack, Lack::WholeBoard);
  some.stamp_ns += kImage_ns;
  some.board.clear();
  EXPECT_EQ(taker.see(some, {}).lack, Lack::Board);
  EXPECT_EQ(taker.see(image(2, pose(0, 0, 1), 5), {}).lack, Lack::Light);
}

}  // namespace
}  // namespace afterglow::calib::view_taker_test
