// Headers, transforms and times as broken as they come: nothing is drawn where nobody knows where
// it belongs, what cannot be is counted and logged once, and everything else is still drawn.
#include <cmath>
#include <limits>
#include <string>

#include "nodes/projector/transform_listener.hpp"
#include "tests/support/faulty_scene.hpp"

namespace afterglow::nodes::frame_faults_test {
namespace {

constexpr std::uint32_t kLastSecond = std::numeric_limits<std::uint32_t>::max();

class FrameFaults : public test::FaultyScene {
 protected:
  static geometry_msgs::TransformStamped stamped(const std::string& frame, double x,
                                                 ros::Time stamp) {
    geometry_msgs::TransformStamped message;
    message.header.frame_id = "map";
    message.child_frame_id = frame;
    message.header.stamp = stamp;
    message.transform.translation.x = x;
    message.transform.rotation.w = 1;
    return message;
  }
  std::string take(const geometry_msgs::TransformStamped& message, ros::Time now,
                   bool is_static = false) {
    const StoredTransform taken = storeTransform(buffer_, message, "test", is_static, now);
    EXPECT_EQ(taken.is_stored,
              taken.reason.empty() || taken.reason.find(": has jumped") != std::string::npos);
    return taken.reason;
  }

  /// Shown never; given up after the patience of a layer, in words that name the frame.
  void expectNeverPlaced(const Marker& lost, const std::string& frame,
                         const std::string& other_reason = "") {
    SCOPED_TRACE(frame);
    startAgain();
    add({cube(1), lost, cube(2)}, at(0));
    EXPECT_EQ(drawn(at(0)).size(), 2u);
    EXPECT_EQ(scene_->status()[kMarkers].waiting_for, frame);
    EXPECT_EQ(drawn(at(11)).size(), 2u);
    const std::string reason =
        other_reason.empty() ? "no transform from '" + frame + "' to 'map'" : other_reason;
    EXPECT_EQ(dropped(), (std::map<std::string, std::uint64_t>{{reason, 1}}));
    EXPECT_EQ(logged(0), std::vector<std::string>{"/markers: dropped: " + reason});
    EXPECT_TRUE(logged(1).empty());
  }
};

// 38
TEST_F(FrameFaults, aFrameWithoutANameIsRefused) {
  expectRefused(cube(7, ""), "frame_id is empty");
  expectRefused(cube(7, "/"), "frame_id is empty");
}

TEST_F(FrameFaults, aLeadingSlashIsNoPartOfAName) {
  transform("arm", 2, at(0), true);
  EXPECT_DOUBLE_EQ(expectDrawn(cube(7, "/arm")).pose.matrix().translation().x(), 2);
}

TEST_F(FrameFaults, unknownFramesAreNamedAndNothingIsDrawnInTheirStead) {
  expectNeverPlaced(cube(7, "nowhere"), "nowhere");
  expectNeverPlaced(cube(7, "h\xc3\xa4nd\n\x1b[2J"), "h??nd??[2J");
  expectNeverPlaced(cube(7, std::string(65536, 'x')), std::string(80, 'x') + "...");
  expectNeverPlaced(cube(7, std::string("a\0b", 3)), "a?b");
}

/// tf2 itself writes a warning each time that it is asked for such a name.
TEST_F(FrameFaults, namesThatTf2RefusesAreRefusedBeforeItIsAsked) {
  testing::internal::CaptureStderr();
  for (const std::string name : {"//map", "///", "//"}) {
    expectRefused(cube(7, name), "frame_id '" + name + "' begins with more than one '/'");
  }
  FrameLookup frames(buffer_, "map");
  for (const std::string name : {"/map", "", "/"}) {
    EXPECT_FALSE(frames.newest(name)) << name;
    EXPECT_FALSE(FrameLookup(buffer_, name).at("map", at(0))) << name;
  }
  auto message = stamped("//arm", 1, at(0));
  EXPECT_EQ(take(message, at(0)),
            "transform of '/arm': a frame's name begins with more than one '/'");
  message = stamped("arm", 1, at(0));
  message.header.frame_id = "//map";
  EXPECT_EQ(take(message, at(0)),
            "transform of 'arm': a frame's name begins with more than one '/'");
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST_F(FrameFaults, transformsThatAreRepeatedAreTakenInSilence) {
  testing::internal::CaptureStderr();
  for (int i = 0; i < 3; ++i) EXPECT_EQ(take(stamped("arm", 1, at(0)), at(0)), "");
  EXPECT_EQ(take(stamped("arm", 1, at(20)), at(20)), "");
  EXPECT_EQ(take(stamped("arm", 1, at(0)), at(20)), "");  // older than tf2 remembers
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

// 39
TEST_F(FrameFaults, aLoopOfFramesHidesWhatHangsOnIt) {
  transform("b", 1, at(0), false, "a");
  transform("a", 1, at(0), false, "b");
  expectNeverPlaced(cube(7, "a"), "a");
}

TEST_F(FrameFaults, aFrameWithTwoParentsIsWhereItWasPutLast) {
  transform("table", 3, at(0), true);
  transform("arm", 1, at(0));
  transform("arm", 1, at(1), false, "table");
  EXPECT_DOUBLE_EQ(expectDrawn(cube(7, "arm")).pose.matrix().translation().x(), 4);
}

TEST_F(FrameFaults, transformsThatAreNoneAreRefusedByName) {
  auto bad = stamped("arm", 1, at(0));
  bad.transform.translation.y = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(take(bad, at(0)), "transform of 'arm': not finite or absurdly far");
  bad = stamped("arm", 1e300, at(0));
  EXPECT_EQ(take(bad, at(0), true), "transform of 'arm': not finite or absurdly far");
  for (const double w : {0.0, 5.0, std::numeric_limits<double>::infinity()}) {
    bad = stamped("arm", 1, at(0));
    bad.transform.rotation.w = w;
    EXPECT_EQ(take(bad, at(0)), "transform of 'arm': rotation is not normalized") << w;
  }
  bad = stamped("", 1, at(0));
  EXPECT_EQ(take(bad, at(0)), "transform of '': a frame without a name");
  EXPECT_EQ(take(stamped("/map", 1, at(0)), at(0)), "transform of 'map': its own parent");
  EXPECT_EQ(take(stamped("arm", 1, at(0)), at(0)), "");
  EXPECT_DOUBLE_EQ(expectDrawn(cube(7, "arm")).pose.matrix().translation().x(), 1);
}

TEST_F(FrameFaults, aChainThatEndsAbsurdlyFarLeadsNowhere) {
  transform("far", 9e5, at(0), true);
  transform("farther", 9e5, at(0), true, "far");
  expectNeverPlaced(cube(7, "farther"), "farther");
}

TEST_F(FrameFaults, aStampTfDoesNotReachIsWaitedForAndGivenUp) {
  transform("arm", 1, at(0));
  transform("arm", 2, at(1));
  const std::string way_out = ": set its sender's clock by tf's (chrony, ntp), or stamp it 0";
  const std::string old = " s before it came, older than what tf has (10 s at most)" + way_out;
  const std::string ahead = " s after it came, ahead of tf" + way_out;
  const std::map<ros::Time, std::string> reasons = {
      {at(-5), "stamped 5" + old},
      {at(500), "stamped 500" + ahead},
      {ros::Time(1), "stamped 999" + old},
      {ros::Time(kLastSecond, 999'999'999), "stamped 4294966295" + ahead}};
  for (const auto& [stamp, reason] : reasons) {
    Marker m = cube(7, "arm");
    m.header.stamp = stamp;
    expectNeverPlaced(m, "arm", reason);
  }
}

// 40
TEST_F(FrameFaults, aFrameThatJumpsIsWhereItWasAndThenWhereItIsAndFlagged) {
  EXPECT_EQ(take(stamped("arm", 1, at(0)), at(0)), "");
  Marker locked = cube(7, "arm");
  locked.frame_locked = 1;
  add({locked}, at(0));
  EXPECT_EQ(take(stamped("arm", 1.4, at(0.1)), at(0.1)), "");  // as a fast robot does
  EXPECT_EQ(take(stamped("arm", 50, at(0.2)), at(0.2)), "transform of 'arm': has jumped");
  EXPECT_EQ(take(stamped("arm", 50, at(0.3)), at(0.3)), "");
  EXPECT_DOUBLE_EQ(drawn(at(0.3)).at(0).pose.matrix().translation().x(), 50);
  Marker between = cube(7, "arm");  // not halfway, in some wall
  between.header.stamp = at(0.15);
  startAgain();
  add({between}, at(0.3));
  EXPECT_DOUBLE_EQ(drawn(at(0.3)).at(0).pose.matrix().translation().x(), 1.4);
  EXPECT_EQ(take(stamped("arm", 60, at(5)), at(5)), "");  // nobody knows how it came there
}

TEST_F(FrameFaults, aProjectorPutElsewhereIsNotThoughtToFly) {
  ProjectorConfig config;
  config.fixed_frame = "map";
  config.projectors.resize(1);
  config.projectors[0].frame = "projector";
  config.projectors[0].latency_ns = 100'000'000;
  ProjectorScene scene(config, buffer_);
  for (int i = 0; i < 10; ++i) take(stamped("projector", 1, at(0.02 * i)), at(0.02 * i));
  take(stamped("projector", 5, at(0.2)), at(0.2));
  const auto T_projector_world = scene.snapshot(at(0.2)).T_projector_world;
  ASSERT_TRUE(T_projector_world);
  EXPECT_DOUBLE_EQ(T_projector_world->inverse().matrix().translation().x(), 5);
}

// 41
TEST_F(FrameFaults, stampsThatAreNoTimeAreRefusedAndZeroMeansNow) {
  Marker m = cube(7);
  for (const std::uint32_t nsec : {1'000'000'000u, 0xffffffffu}) {
    m.header.stamp.sec = 5;
    m.header.stamp.nsec = nsec;
    expectRefused(m, "stamp is no time");
  }
  m = cube(7, "arm");
  transform("arm", 1, at(0));
  transform("arm", 2, at(1));
  m.header.stamp = ros::Time(0);
  EXPECT_DOUBLE_EQ(expectDrawn(m).pose.matrix().translation().x(), 2);
}

TEST_F(FrameFaults, sequenceNumbersMeanNothing) {
  Marker m = cube(7);
  m.header.seq = 0xffffffffu;
  expectDrawn(m);
}

// 42
TEST_F(FrameFaults, aClockThatStandsStillEndsNothing) {
  Marker m = cube(7);
  m.lifetime = ros::Duration(1);
  add({m}, at(0));
  for (int i = 0; i < 100; ++i) EXPECT_EQ(drawn(at(0.5)).size(), 1u);
}

// 43
TEST_F(FrameFaults, theEndOfRosTimeIsLivedThrough) {
  const ros::Time end(kLastSecond, 999'999'999);
  Marker m = cube(7);
  m.lifetime = ros::Duration(5);
  m.header.stamp = end;
  scene_->add(kRest, cube(1), end);
  add({m}, end);
  EXPECT_EQ(drawn(end).size(), 1u);
}

TEST_F(FrameFaults, aTransformFromTheEndOfTimeIsRefusedBeforeItShadowsAllOthers) {
  for (const ros::Time& stamp :
       {ros::Time(kLastSecond, 999'999'999), ros::Time(kLastSecond, 0), at(61)}) {
    EXPECT_EQ(take(stamped("arm", 9, stamp), at(0)),
              "transform of 'arm': stamp lies in the future");
  }
  EXPECT_EQ(take(stamped("arm", 9, ros::Time(kLastSecond, 0)), ros::Time(0)),
            "transform of 'arm': stamp lies in the future");  // tf2 would throw
  auto odd = stamped("arm", 9, at(0));
  odd.header.stamp.nsec = 2'000'000'000u;
  EXPECT_EQ(take(odd, at(0)), "transform of 'arm': stamp is no time");
  EXPECT_EQ(take(stamped("arm", 1, at(0)), at(0)), "");
  EXPECT_DOUBLE_EQ(expectDrawn(cube(7, "arm")).pose.matrix().translation().x(), 1);
  EXPECT_EQ(take(stamped("wall", 1, ros::Time(kLastSecond, 0)), at(0), true), "");  // means nothing
}

TEST(FaultLog, saysEachProblemWhenItIsNewAndNowAndThen) {
  FaultLog log;
  const std::vector<std::string> problems = {"projector: no transform from 'p' to 'map'"};
  EXPECT_EQ(log.news(problems, {}, 0), problems);
  EXPECT_TRUE(log.news(problems, {}, FaultLog::kAgainNs - 1).empty());
  EXPECT_EQ(log.news(problems, {}, FaultLog::kAgainNs), problems);
  EXPECT_TRUE(log.news({}, {}, FaultLog::kAgainNs + 1).empty());
}

}  // namespace
}  // namespace afterglow::nodes::frame_faults_test
