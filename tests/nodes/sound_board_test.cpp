#include "nodes/speaker/sound_board.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

namespace afterglow::nodes::sound_board_test {
namespace {

constexpr int kSay = -3;

/// Writes down what it is asked to play.
class Notes : public SoundOutput {
 public:
  void start(const PlayingSound& playing) override { add("start ", playing); }
  void stop(const PlayingSound& playing) override { add("stop ", playing); }
  std::vector<std::string> lines;

 private:
  void add(const std::string& what, const PlayingSound& playing) {
    lines.push_back(what + std::to_string(playing.id));
  }
};

SoundTime at(double seconds) {
  const auto steady = static_cast<std::int64_t>(std::llround(seconds * 1e9));
  return {steady + 1'000'000'000'000, steady};
}

std::shared_ptr<const Sound> sound(double seconds) {
  return std::make_shared<Sound>(
      Sound{1000, 1, std::vector<std::int16_t>(static_cast<std::size_t>(seconds * 1000))});
}

struct Board : ::testing::Test {
  Notes notes;
  std::vector<PlayingSound> started;
  std::vector<std::pair<int, double>> ended;  // id, seconds heard
  SoundBoard board{notes, [this](const PlayingSound& playing) { started.push_back(playing); },
                   [this](const PlayingSound& playing, double heard_s) {
                     ended.emplace_back(playing.id, heard_s);
                   }};
  const SoundKey hello{kSay, "Hello.", ""}, bye{kSay, "Bye.", ""};
};
using SoundBoardTest = Board;

TEST_F(SoundBoardTest, endsASoundWhenItsTimeIsOver) {
  board.play(hello, sound(2), false, 1, at(10));
  board.advance(at(11.999));
  EXPECT_EQ(board.playing().size(), 1u);
  board.advance(at(12.01));
  EXPECT_TRUE(board.playing().empty());
  ASSERT_EQ(ended.size(), 1u);
  EXPECT_DOUBLE_EQ(ended[0].second, 2) << "a late look does not make it longer";
  EXPECT_EQ(started[0].onset.ros_ns, at(10).ros_ns);
}

TEST_F(SoundBoardTest, letsSoundsOverlap) {
  board.play(hello, sound(2), false, 1, at(0));
  board.play(bye, sound(1), false, 1, at(0.5));
  EXPECT_EQ(board.playing().size(), 2u);
  board.advance(at(1.6));
  ASSERT_EQ(board.playing().size(), 1u);
  EXPECT_EQ(board.playing()[0].key.arg, "Hello.");
}

TEST_F(SoundBoardTest, restartsASoundThatIsPlaying) {
  board.play(hello, sound(2), false, 1, at(0));
  board.play(hello, sound(2), false, 1, at(0.5));
  EXPECT_EQ(notes.lines, (std::vector<std::string>{"start 1", "stop 1", "start 2"}));
  ASSERT_EQ(ended.size(), 1u);
  EXPECT_DOUBLE_EQ(ended[0].second, 0.5);
  board.advance(at(2.1));
  EXPECT_EQ(board.playing().size(), 1u) << "the new one lasts until 2.5";
}

TEST_F(SoundBoardTest, loopsUntilStoppedWithoutDrift) {
  board.play(hello, sound(1), true, 1, at(0));
  board.advance(at(1.3));
  EXPECT_EQ(board.playing()[0].pass_end_ns, at(2).steady_ns);
  board.advance(at(2.0));
  EXPECT_EQ(notes.lines,
            (std::vector<std::string>{"start 1", "stop 1", "start 1", "stop 1", "start 1"}));
  board.stop(hello, at(2.25));
  EXPECT_TRUE(board.playing().empty());
  ASSERT_EQ(ended.size(), 1u);
  EXPECT_DOUBLE_EQ(ended[0].second, 2.25);
}

TEST_F(SoundBoardTest, stopsTheNamedSoundOnly) {
  board.play(hello, sound(2), false, 1, at(0));
  board.play(bye, sound(2), false, 1, at(0));
  board.stop({kSay, "Hello.", "another voice"}, at(1));
  EXPECT_EQ(board.playing().size(), 2u);
  board.stop(bye, at(1));
  ASSERT_EQ(board.playing().size(), 1u);
  EXPECT_EQ(board.playing()[0].key.arg, "Hello.");
}

TEST_F(SoundBoardTest, stopsAll) {
  board.play(hello, sound(2), false, 1, at(0));
  board.play(bye, sound(2), true, 1, at(0));
  board.stopAll(at(1));
  EXPECT_TRUE(board.playing().empty());
  EXPECT_EQ(ended.size(), 2u);
}

TEST_F(SoundBoardTest, keepsVolumesBetweenMuteAndFull) {
  for (const double volume : {-1.0, 0.0, 0.3, 7.0})
    board.play(hello, sound(1), false, volume, at(0));
  ASSERT_EQ(started.size(), 4u);
  EXPECT_EQ(started[0].volume, 0);
  EXPECT_EQ(started[1].volume, 0);
  EXPECT_EQ(started[2].volume, 0.3);
  EXPECT_EQ(started[3].volume, 1);
}

}  // namespace
}  // namespace afterglow::nodes::sound_board_test
