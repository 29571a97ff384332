#include "calib/guide/guide.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "tests/support/held_board.hpp"

namespace afterglow::calib::guide_test {
namespace {

using namespace test;

/// The same tags of the pattern for every view: their number is what counts here.
View viewOf(const std::string& name, int first_tag, int tags) {
  View view;
  view.name = name;
  for (int i = first_tag; i < first_tag + tags; ++i) {
    SeenTag tag;
    static_cast<Tag&>(tag) = smallPattern().tags[static_cast<std::size_t>(i)];
    view.projected.push_back(tag);
  }
  return view;
}

// ---------------------------------------------------------------------------------------- advice

bool has(const std::vector<std::string>& texts, const std::string& wanted) {
  return std::find(texts.begin(), texts.end(), wanted) != texts.end();
}

TEST(BoardTilt, isTheCameras) {
  EXPECT_NEAR(boardTilt(pose(0, 0, 1)).norm(), 0, 1e-12);
  EXPECT_LT(boardTilt(pose(0, 0, 1, 0, 0.3)).x(), -0.29);  // its face is turned to the left
  EXPECT_GT(boardTilt(pose(0, 0, 1, 0.3, 0)).y(), 0.29);   // downwards
}

TEST(Advice, namesTheBoardThatIsNotTheLayouts) {
  Guide guide(smallBoard(), smallPattern(), camera());
  guide.start();
  WatchedImage other;
  other.stamp_ns = 1'000'000'000'000;
  for (int id = 40; id < 60; ++id) other.unknown.insert(id);
  for (int i = 0; i < 10; ++i, other.stamp_ns += kImage_ns) guide.see(other);
  std::string said;
  for (const Utterance& utterance : guide.takeUtterances()) said += utterance.text + "\n";
  EXPECT_NE(said.find("the tags in the picture (40 to 59) are those of an A3 board; the layout "
                      "(board.yaml) describes 600 x 400 mm with tags 0 to 5"),
            std::string::npos)
      << said;
}

TEST(Advice, namesWhatLacks) {
  EXPECT_EQ(adviceFor({}, {}, {}).size(), 1u);
  const std::vector<Pose> parallel = {pose(0, 0, 1), pose(0.1, 0, 1)};
  const auto first = adviceFor(parallel, {}, pose(0, 0, 1));
  EXPECT_EQ(first.front(), "turn it: all boards were parallel so far");
  for (const char* text :
       {"tilt it more to the left", "tilt it more to the right", "tilt it more upwards",
        "tilt it more downwards", "hold it further up on the right of the light",
        "hold it in the middle of the light", "come 20 cm closer"}) {
    EXPECT_TRUE(has(first, text)) << text;
  }
  const std::vector<Pose> varied = {pose(0, 0, 1, 0, 0.3), pose(0, 0, 1.4, 0, -0.3),
                                    pose(0, 0, 1, 0.3, 0), pose(0, 0, 1, -0.3, 0)};
  Coverage full;
  std::fill(full.corners.begin(), full.corners.end(), 1);
  EXPECT_TRUE(adviceFor(varied, full, {}).empty());
  full.corners[0] = full.corners[1] = full.corners[2] = 0;
  for (int row = 0; row < 3; ++row)
    std::fill_n(full.corners.begin() + row * Coverage::kColumns, 5, 0);
  EXPECT_EQ(adviceFor(varied, full, {}),
            std::vector<std::string>{"hold it further up on the left of the light"});
}

TEST(Prompter, writesWhatLastsAndSpeaksNotOverAndOver) {
  Prompter prompter;
  std::vector<Utterance> said;
  int in_vain = 0;
  for (int i = 0; i < 200; ++i) {  // twenty seconds
    in_vain += prompter.advise("hold it still", 5'000'000'000 + i * kImage_ns);
    for (Utterance& one : prompter.take()) said.push_back(one);
  }
  ASSERT_EQ(said.size(), 2u);  // and once again after fifteen seconds
  EXPECT_EQ(in_vain, 1);
  EXPECT_TRUE(said[0].is_spoken);
  for (int i = 0; i < 20; ++i) {
    prompter.advise(i % 2 ? "tilt it" : "turn it", 26'000'000'000 + i * kImage_ns);
  }
  EXPECT_TRUE(prompter.take().empty());  // flicker
  prompter.tell("the board moved", 30'000'000'000);
  prompter.tell("the board moved", 33'000'000'000);
  said = prompter.take();
  ASSERT_EQ(said.size(), 2u);
  EXPECT_TRUE(said[0].is_spoken);
  EXPECT_FALSE(said[1].is_spoken);
}

// ----------------------------------------------------------------------------------------- guide

/// Takes one view at a pose; false if it was not taken.
bool takeView(Guide& guide, int& number, const Pose& held, const View& view) {
  Shown visible = Shown::Plain;
  for (int i = 0; i < 60; ++i) {
    const TakerAnswer answer = guide.see(image(number++, held, visible == Shown::Pattern ? 20 : 0));
    visible = answer.show;
    if (answer.is_complete) return guide.addView(view, *answer.T_camera_board);
  }
  return false;
}

std::string allText(Guide& guide) {
  std::string text;
  for (const Utterance& one : guide.takeUtterances()) text += one.text + "\n";
  return text;
}

Guide startedGuide(int views, double coverage) {
  GuideOptions options;
  options.views = views;
  options.coverage = coverage;
  Guide guide(smallBoard(), smallPattern(), camera(), options);
  guide.start();
  return guide;
}

TEST(Guide, goesFromTheFirstViewToTheCheck) {
  Guide guide = startedGuide(2, 0.2);
  EXPECT_EQ(guide.shown(), Shown::Plain);
  int number = 0;
  EXPECT_TRUE(takeView(guide, number, pose(0, 0, 1), viewOf(guide.nextName(), 0, 30)));
  EXPECT_EQ(guide.nextName(), "view_01");
  EXPECT_EQ(guide.phase(), GuidePhase::Collecting);
  EXPECT_TRUE(takeView(guide, number, pose(0, 0, 1, 0.4), viewOf(guide.nextName(), 30, 30)));
  EXPECT_EQ(guide.phase(), GuidePhase::Solving);
  EXPECT_NE(allText(guide).find("view taken: 2 of 2 views, coverage "), std::string::npos);

  Calibration calibration;
  calibration.held_out_rms_mm = 0.2;
  ViewResult spoiled;
  spoiled.name = "view_00";
  spoiled.reason = "its pictures disagree: take it again";
  calibration.views.push_back(spoiled);
  guide.solved(calibration);
  EXPECT_EQ(guide.phase(), GuidePhase::Verifying);
  const std::string said = allText(guide);
  EXPECT_NE(said.find("view_00 was left out: its pictures disagree"), std::string::npos) << said;
  EXPECT_NE(said.find("met to 0.20 mm"), std::string::npos) << said;
  guide.checked({});
  EXPECT_EQ(guide.phase(), GuidePhase::Verifying);
  ErrorSummary errors;
  errors.corners = 40;
  errors.rms_mm = 3;
  guide.checked(errors);
  EXPECT_EQ(guide.phase(), GuidePhase::Done);
  EXPECT_EQ(guide.shown(), Shown::Black);
  EXPECT_NE(allText(guide).find("have camera or projector moved?"), std::string::npos);
}

TEST(Guide, endsWithTheProjectorsDelay) {
  GuideOptions options;
  options.times_delay = true;
  Guide guide(smallBoard(), smallPattern(), camera(), options);
  guide.start();
  int number = 0;
  ASSERT_TRUE(takeView(guide, number, pose(0, 0, 1), viewOf("view_00", 0, 30)));
  ASSERT_TRUE(guide.solveNow());
  guide.timed("too early");
  guide.solved({});
  ErrorSummary errors;
  errors.corners = 40;
  guide.checked(errors);
  EXPECT_EQ(guide.phase(), GuidePhase::Timing);
  EXPECT_EQ(phaseName(guide.phase()), "timing");
  const std::string said = allText(guide);
  EXPECT_EQ(said.find("too early"), std::string::npos) << said;
  EXPECT_NE(said.find("now the projector's delay"), std::string::npos) << said;
  guide.timed("it is 40 ms");
  EXPECT_EQ(guide.phase(), GuidePhase::Done);
  EXPECT_EQ(allText(guide), "it is 40 ms\n");
}

TEST(Guide, collectsOnWhileTooLittleLightIsCovered) {
  Guide guide = startedGuide(2, 0.9);
  int number = 0;
  for (int i = 0; i < 4; ++i) {
    EXPECT_EQ(guide.phase(), GuidePhase::Collecting) << i;
    ASSERT_TRUE(
        takeView(guide, number, pose(0, 0, 1, 0.3 * i - 0.4), viewOf(guide.nextName(), 4 * i, 4)));
  }
  EXPECT_EQ(guide.phase(), GuidePhase::Solving) << "some of the light may be out of reach";
}

TEST(Guide, goesOnAfterARefusal) {
  Guide guide = startedGuide(1, 0);
  int number = 0;
  ASSERT_TRUE(takeView(guide, number, pose(0, 0, 1), viewOf("view_00", 0, 30)));
  EXPECT_EQ(guide.phase(), GuidePhase::Collecting);  // one board is parallel to itself
  ASSERT_TRUE(guide.solveNow());
  EXPECT_EQ(guide.phase(), GuidePhase::Solving);
  EXPECT_FALSE(guide.solveNow());
  allText(guide);
  guide.refused({"all boards are parallel: tilt the board"});
  EXPECT_EQ(allText(guide), "cannot calibrate yet: all boards are parallel: tilt the board\n");
  EXPECT_EQ(guide.phase(), GuidePhase::Collecting);
  EXPECT_EQ(guide.viewsWanted(), 4);
}

TEST(Guide, discardsWithAReason) {
  Guide guide = startedGuide(3, 0.2);
  int number = 0;
  View mirrored = viewOf("view_00", 0, 30);
  mirrored.faults = {"the picture is mirrored: switch that off"};
  EXPECT_FALSE(takeView(guide, number, pose(0, 0, 1), mirrored));
  EXPECT_FALSE(takeView(guide, number, pose(0, 0, 1), viewOf("view_00", 0, 1)));
  const std::string said = allText(guide);
  EXPECT_NE(said.find("view discarded: the picture is mirrored"), std::string::npos) << said;
  EXPECT_NE(said.find("only 1 tags of the pattern lie on the board"), std::string::npos) << said;
  EXPECT_EQ(guide.discarded(), 2);
  EXPECT_TRUE(guide.views().empty());
}

TEST(Guide, obeysCommands) {
  Guide guide = startedGuide(3, 0.2);
  int number = 0;
  EXPECT_FALSE(guide.discardLast());
  EXPECT_FALSE(guide.solveNow());
  ASSERT_TRUE(takeView(guide, number, pose(0, 0, 1), viewOf("view_00", 0, 30)));
  EXPECT_FALSE(takeView(guide, number, pose(0, 0, 1), viewOf("view_01", 0, 30))) << "not new";
  EXPECT_TRUE(guide.forceView());
  ASSERT_TRUE(takeView(guide, number, pose(0, 0, 1), viewOf("view_01", 0, 30)));
  EXPECT_EQ(guide.discardLast(), "view_01");
  EXPECT_EQ(guide.views().size(), 1u);
  guide.stop();
  EXPECT_EQ(guide.shown(), Shown::Black);
  EXPECT_FALSE(guide.forceView());
  EXPECT_EQ(guide.see(image(number, pose(0, 0, 1, 0.4))).show, Shown::Black);
}

}  // namespace
}  // namespace afterglow::calib::guide_test
