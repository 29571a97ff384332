#include "replay/motion/pose_track.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "replay/motion/base/track_reader.hpp"
#include "replay/store/open/open_store.hpp"
#include "replay/store/store.hpp"
#include "tests/support/messages.hpp"
#include "tests/support/simulated_drive.hpp"

namespace afterglow::replay::pose_track_test {
namespace {

using namespace test;

void expectPose(const PlanarPose& is, const PlanarPose& should, double within = 1e-9) {
  EXPECT_NEAR(is.x, should.x, within);
  EXPECT_NEAR(is.y, should.y, within);
  EXPECT_NEAR(wrapAngle(is.yaw - should.yaw), 0, within);
}

// ------------------------------------------------------------------------------------- the track

TEST(PoseTrack, interpolatesThroughTheTurnOfTheCircle) {
  const PoseTrack track({{stampAt(0), {0, 0, 3.1}}, {stampAt(1), {1, 2, -3.1}}}, "map", true);
  expectPose(track.at(stampAt(0.5)), {0.5, 1, 3.14159265358979});
  expectPose(track.at(stampAt(-1)), {0, 0, 3.1});
  expectPose(track.at(stampAt(9)), {1, 2, -3.1});
}

TEST(PoseTrack, hasTheVelocitiesOfDrivingForwardBackwardAndTurning) {
  for (const PlanarVelocity driven :
       {PlanarVelocity{0.5, 0.7}, {-0.3, 0.2}, {0, -1.2}, {0, 0}, {0.4, -0.6, 0.3}}) {
    std::vector<PoseTrack::Sample> samples;
    PlanarPose pose{3, 1, 2.9};
    for (int i = 0; i <= 100; ++i) {
      samples.push_back({stampAt(i * 0.02), pose});
      pose = advance(pose, driven, 0.02);
    }
    const PoseTrack track(samples, "map", true);
    for (const double at : {0., 0.013, 1.007, 1.99}) {
      EXPECT_NEAR(track.velocityAt(stampAt(at)).forward, driven.forward, 1e-3) << at;
      EXPECT_NEAR(track.velocityAt(stampAt(at)).turn, driven.turn, 1e-6) << at;
      EXPECT_NEAR(track.velocityAt(stampAt(at)).left, driven.left, 1e-3) << at;
    }
    EXPECT_EQ(track.velocityAt(stampAt(2.5)).forward, 0);
    EXPECT_NEAR(track.length(), driven.speed() * 2, 1e-3);
  }
}

TEST(PoseTrack, isRefusedWithoutPosesOrWithStampsThatDoNotRise) {
  EXPECT_THROW(PoseTrack({}, "map", true), std::invalid_argument);
  EXPECT_THROW(PoseTrack({{stampAt(1), {}}, {stampAt(1), {}}}, "map", true), std::invalid_argument);
}

TEST(PoseTrack, isIncompleteWhereTheBaseMovedUnseen) {
  PoseTrack track({{stampAt(1), {}}, {stampAt(2), {0.5, 0, 0}}, {stampAt(4), {0.55, 0, 0}}}, "map",
                  true);
  EXPECT_EQ(whyIncomplete(track, stampAt(0.5), stampAt(4.5)), "");
  EXPECT_EQ(whyIncomplete(track, stampAt(0), stampAt(2)),
            "its poses were recorded only 1.0 s after its first velocity");
  EXPECT_EQ(whyIncomplete(track, stampAt(1), stampAt(5)),
            "its poses end 1.0 s before its last velocity");
  track.gaps = {{stampAt(1), stampAt(2)}, {stampAt(2), stampAt(4)}};
  EXPECT_EQ(whyIncomplete(track, stampAt(1), stampAt(4)),
            "no pose was recorded for 1.0 s in which it went 0.50 m and turned 0 deg");
  EXPECT_EQ(whyIncomplete(track, stampAt(3), stampAt(4)), "") << "it hardly moved in that one";
  PoseTrack turned({{stampAt(1), {0, 0, 1}}, {stampAt(2), {0, 0, 1.2}}, {stampAt(3), {0, 0, 1.9}}},
                   "map", true);
  turned.gaps = {{stampAt(1), stampAt(2)}};
  EXPECT_EQ(whyIncomplete(turned, stampAt(1), stampAt(3)), "") << "11 degrees";
  PoseTrack crept({{stampAt(1), {}}, {stampAt(2), {0.1, 0, 0.25}}}, "map", true);
  crept.gaps = {{stampAt(1), stampAt(2)}};
  EXPECT_EQ(whyIncomplete(crept, stampAt(1), stampAt(2)), "") << "so much is borne";
  turned.gaps.push_back({stampAt(2), stampAt(3)});
  EXPECT_EQ(whyIncomplete(turned, stampAt(1), stampAt(3)),
            "no pose was recorded for 1.0 s in which it went 0.00 m and turned 40 deg");
}

TEST(PoseTrack, knowsTheHeadingsOfABaseThatTurnedAtItsEndAndOfNoneBefore) {
  const PoseTrack track({{stampAt(0), {-1, 0, -2}},
                         {stampAt(1), {-0.04, 0, 0.5}},
                         {stampAt(2), {0, 0, -0.3}},
                         {stampAt(3), {0, 0, 0.2}}},
                        "map", true);
  EXPECT_NEAR(track.headingsAtEnd(0.05).from, -0.5, 1e-9);
  EXPECT_NEAR(track.headingsAtEnd(0.05).to, 0.3, 1e-9);
  EXPECT_NEAR(track.headingsAtEnd(0.03).to, 0, 1e-9) << "nearer than that it had turned alone";
}

// ----------------------------------------------------------------------------------- the builder

TEST(TrackBuilder, smoothsTheNoiseOfLocalization) {
  const LocalizationFaults faults{0.03, kDegree, 0.2};
  double worst = 0;
  const RecordedDrive drive = record(detour(), DriveFaults{1.01, 0.99, 0.04}, faults, 7);
  for (std::size_t i = 0; i < drive.truth.size(); ++i) {
    worst = std::max(
        worst, distance(drive.track.at(stampAt(static_cast<double>(i) * kStep)), drive.truth[i]));
  }
  EXPECT_LT(worst, 0.03);
  EXPECT_TRUE(drive.track.jumps.empty());
  EXPECT_TRUE(drive.track.remarks.empty());
  EXPECT_EQ(drive.track.frame(), "map");
  EXPECT_NEAR(drive.track.length(), 3.2, 0.15);
}

TEST(TrackBuilder, takesExactLocalizationAsItIs) {
  TrackBuilder builder({});
  builder.addLocalization(stampAt(0), {5, 5, 1});
  PlanarPose pose;
  for (int i = 0; i < 200; ++i) {
    builder.addOdometry(stampAt(i * 0.02), pose);
    pose = advance(pose, {0.4, 0.3}, 0.02);
  }
  const PoseTrack track = builder.build("map", "odom");
  const PlanarPose last = advance({}, {0.4, 0.3}, 199 * 0.02);
  expectPose(track.startPose(), {5, 5, 1}, 1e-6);
  expectPose(track.endPose(), compose({5, 5, 1}, last), 1e-6);
}

TEST(TrackBuilder, movesWhatCameBeforeAJumpAlong) {
  TrackBuilder builder({});
  const PlanarPose wrong{0.1, 0.2, 0.3}, right{0.5, -0.4, 0.55};
  PlanarPose pose;
  for (int i = 0; i < 400; ++i) {
    builder.addOdometry(stampAt(i * 0.02), pose);
    builder.addLocalization(stampAt(i * 0.02), i < 250 ? wrong : right);
    pose = advance(pose, {0.4, 0}, 0.02);
  }
  const PoseTrack track = builder.build("map", "odom");
  ASSERT_EQ(track.jumps.size(), 1u);
  EXPECT_EQ(track.jumps[0].at, stampAt(5));
  EXPECT_NEAR(track.jumps[0].distance,
              distance(compose(wrong, {2, 0, 0}), compose(right, {2, 0, 0})), 1e-6);
  EXPECT_NEAR(track.jumps[0].turn, 0.25, 1e-9);
  ASSERT_EQ(track.remarks.size(), 1u);
  EXPECT_NE(track.remarks[0].find("localization jumped by"), std::string::npos);
  expectPose(track.startPose(), right, 1e-6);
  expectPose(track.endPose(), compose(right, {399 * 0.008, 0, 0}), 1e-6);
  for (double at = 0; at < 7.9; at += 0.05) {
    EXPECT_NEAR(track.velocityAt(stampAt(at)).forward, 0.4, 1e-6) << at;
  }
}

TEST(TrackBuilder, forgivesASingleWrongMeasurement) {
  TrackBuilder builder({});
  PlanarPose pose;
  for (int i = 0; i < 200; ++i) {
    builder.addOdometry(stampAt(i * 0.02), pose);
    builder.addLocalization(stampAt(i * 0.02),
                            i == 100 ? PlanarPose{3, 3, 1} : PlanarPose{1, 0, 0});
    pose = advance(pose, {0.4, 0}, 0.02);
  }
  const PoseTrack track = builder.build("map", "odom");
  EXPECT_EQ(track.jumps.size(), 2u);
  expectPose(track.startPose(), {1, 0, 0}, 1e-6);
  expectPose(track.endPose(), {1 + 199 * 0.008, 0, 0}, 1e-6);
}

TEST(TrackBuilder, reportsGapsAndWhatIsOutOfOrder) {
  TrackBuilder builder({});
  for (const double at : {0., 0.1, 0.2, 1.0, 0.9, 1.1, 1.1}) {
    builder.addOdometry(stampAt(at), {at, 0, 0});
  }
  const PoseTrack track = builder.build("map", "odom");
  ASSERT_EQ(track.gaps.size(), 1u);
  EXPECT_EQ(track.gaps[0].from, stampAt(0.2));
  EXPECT_EQ(track.gaps[0].to, stampAt(1.0));
  ASSERT_EQ(track.remarks.size(), 3u);
  EXPECT_EQ(track.remarks[0],
            "no map -> odom was recorded: the base is followed in odom, from wherever it starts");
  EXPECT_EQ(track.remarks[1], "no base pose for 0.8 s, 0.2 s after the track's begin");
  EXPECT_EQ(track.remarks[2], "1 base poses came out of order");
  EXPECT_FALSE(track.isLocalized());
  EXPECT_EQ(track.frame(), "odom");
}

TEST(TrackBuilder, keepsAVeryLongTrackInBoundedMemory) {
  TrackBuilder builder({});
  for (int i = 0; i < 500'000; ++i) builder.addOdometry(stampAt(i * 0.02), {i * 1e-3, 0, 0});
  const PoseTrack track = builder.build("map", "odom");
  EXPECT_LE(track.sampleCount(), 200'000u);
  EXPECT_TRUE(track.gaps.empty());
  EXPECT_NEAR(track.at(stampAt(5000.003)).x, 250.00015, 1e-6);
}

// ------------------------------------------------------------------------------------ the reader

struct Transform {
  std::string parent, child;
  double at = 0;
  PlanarPose pose;
};

/// A recording of /tf messages of one transform each.
class TransformLog {
 public:
  TransformLog() {
    Recording recording;
    recording.source = "/recorder";
    behavior_.recording = store_->addRecording(recording);
    behavior_.name = "drive";
    behavior_.begin = stampAt(0);
    behavior_.end = stampAt(100);
    behavior_.topics = {"/cmd_vel"};
    channel_ = store_->addChannel(behavior_.recording, described_);
  }

  void add(const Transform& transform, double delay = 0.004) {
    Value message = blank(described_);
    Value entry = blank(schema_, "geometry_msgs/TransformStamped");
    const Stamp stamp = stampAt(transform.at);
    at(entry, "header.stamp") = RosTime{static_cast<std::uint32_t>(stamp.ns / 1000000000),
                                        static_cast<std::uint32_t>(stamp.ns % 1000000000)};
    at(entry, "header.frame_id") = transform.parent;
    at(entry, "child_frame_id") = transform.child;
    for (const char* zero : {"translation.z", "rotation.x", "rotation.y"}) {
      at(entry, std::string("transform.") + zero) = 0.0;
    }
    at(entry, "transform.translation.x") = transform.pose.x;
    at(entry, "transform.translation.y") = transform.pose.y;
    at(entry, "transform.rotation.z") = std::sin(transform.pose.yaw / 2);
    at(entry, "transform.rotation.w") = std::cos(transform.pose.yaw / 2);
    at(message, "transforms") = Array{entry};
    addBytes(encode(schema_, message), transform.at + delay);
  }
  void addBytes(const Bytes& bytes, double received) {
    store_->append({{channel_, stampAt(received), sequence_++, {}, bytes}});
  }

  std::optional<PoseTrack> read(const TrackFrames& frames = {}) {
    return readPoseTrack(*store_, behavior_, frames, {}, why);
  }
  /// Of another type, by another publisher.
  void addOther(const Channel& channel, const Bytes& bytes, double received) {
    const std::int64_t id = store_->addChannel(behavior_.recording, channel);
    store_->append({{id, stampAt(received), sequence_++, {}, bytes}});
  }
  std::string why;

 private:
  std::unique_ptr<Store> store_ = openMemoryStore();
  Channel described_ = channelOf("/tf", "tf2_msgs/TFMessage", kTfMessage);
  Schema schema_ = schemaOf(described_);
  Behavior behavior_;
  std::int64_t channel_ = 0;
  std::uint64_t sequence_ = 0;
};

TEST(TrackReader, readsTheBaseOnTheMapFromTf) {
  TransformLog log;
  for (int i = 0; i < 20; ++i) {
    log.add({"/map", "/odom", i * 0.1 + 0.01, {1, 2, 1.5707963267948966}});
    log.add({"base_link", "gripper_link", i * 0.1 + 0.02, {}});
    log.add({"odom", "base_link", i * 0.1 + 0.03, {i * 0.1, 0, 0}});
  }
  const auto track = log.read();
  ASSERT_TRUE(track) << log.why;
  EXPECT_TRUE(track->isLocalized());
  EXPECT_TRUE(track->remarks.empty());
  expectPose(track->endPose(), {1, 2 + 1.9, 1.5707963267948966}, 1e-6);
  EXPECT_NEAR(track->velocityAt(stampAt(1)).forward, 1, 1e-6);
}

TEST(TrackReader, isOnTheRecordersClockWhateverTheRobotsIs) {
  TransformLog log;
  for (int i = 0; i < 20; ++i) {
    const double jitter = i % 3 * 0.005;
    log.add({"odom", "base_link", i * 0.1, {i * 0.1, 0, 0}}, 7.5 + jitter);
  }
  const auto track = log.read();
  ASSERT_TRUE(track) << log.why;
  EXPECT_EQ(track->begin(), stampAt(7.5));
  EXPECT_EQ(track->end(), stampAt(9.4));
}

TEST(TrackReader, saysWhatThereIsWhenTheBaseIsNot) {
  TransformLog log;
  log.add({"odom", "base_footprint", 1, {}});
  log.add({"map", "odom", 1.1, {}});
  EXPECT_FALSE(log.read());
  EXPECT_EQ(log.why,
            "no odom -> base_link was recorded on /tf; there are odom -> base_footprint; perhaps "
            "--base-frame odom=odom base=base_footprint");
  TrackFrames frames;
  frames.base = "/base_footprint";
  EXPECT_TRUE(log.read(frames));
}

TEST(TrackReader, learnsWhereTheBaseEndedFromWhatComesAfterWhileItStands) {
  TransformLog log;
  log.add({"map", "odom", 98, {0.03, 0, 0}});
  log.add({"odom", "base_link", 99.9, {1, 0, 0}});
  // The behavior ends at 100 s; the base stands, then drives on.
  for (int i = 0; i < 40; ++i) {
    log.add({"odom", "base_link", 100 + i * 0.1, {1, 0, 0}});
    log.add({"map", "odom", 100.05 + i * 0.1, {i * 1e-9, 0, 0}});
  }
  log.add({"odom", "base_link", 104.5, {1.1, 0, 0}});
  for (int i = 0; i < 40; ++i) log.add({"map", "odom", 105 + i * 0.1, {0.1 + i * 1e-9, 0, 0}});
  const auto track = log.read();
  ASSERT_TRUE(track) << log.why;
  EXPECT_LT(track->end(), stampAt(100));
  EXPECT_NEAR(track->endPose().x, 1, 0.01);
}

// ------------------------------------------------------------------------- what is known of a pose

/// A drive of 3 m, localized every 0.1 m with these standard deviations.
PoseTrack localizedDrive(double position, double yaw) {
  std::mt19937 random(7);
  const auto bell = [&random] {
    double sum = 0;
    for (int i = 0; i < 12; ++i) sum += random() / 4294967296.0;
    return sum - 6;
  };
  TrackBuilder builder{LocalizationNoise()};
  for (int i = 0; i <= 300; ++i) {
    const PlanarPose odometry{i * 0.01, 0, 1};  // it looks aslant
    builder.addOdometry(stampAt(i * 0.05), odometry);
    if (i % 10 != 0) continue;
    const PlanarPose seen{odometry.x + position * bell(), position * bell(), 1 + yaw * bell()};
    builder.addLocalization(stampAt(i * 0.05), compose(seen, inverse(odometry)));
  }
  return builder.build("map", "odom");
}

TEST(TrackBuilder, judgesLocalizationByHowFarItMovesTheBaseEachTime) {
  const PoseTrack amcl = localizedDrive(0.02, 0.01);
  EXPECT_NEAR(amcl.measured_error.position, 0.02, 0.006);
  EXPECT_NEAR(amcl.measured_error.yaw, 0.01, 0.003);
  for (const PoseError& error : {amcl.begin_error, amcl.end_error}) {
    EXPECT_GT(error.position, 0.002);
    EXPECT_LT(error.position, 0.015) << "of many measurements";
  }
  const PoseTrack part = amcl.part(stampAt(1), stampAt(2));
  EXPECT_EQ(part.end_error.position, amcl.end_error.position);
  const PoseTrack exact = localizedDrive(0, 0);
  EXPECT_LT(exact.end_error.position, 1e-6);
}

TEST(TrackBuilder, takesTheNoiseThatIsAssumedForALocalizationThatWasHardlySeen) {
  TrackBuilder builder{LocalizationNoise()};
  builder.addLocalization(stampAt(0), {});
  for (int i = 0; i <= 20; ++i) builder.addOdometry(stampAt(i * 0.05), {});
  const PoseError measured = builder.build("map", "odom").measured_error;
  EXPECT_NEAR(measured.position, 0.03, 1e-9);
  EXPECT_NEAR(measured.yaw, 0.0175, 1e-9);
}

TEST(TrackBuilder, tellsAJumpsSizeByTheMeanOfWhatLocalizationSaidAroundIt) {
  TrackBuilder builder({});
  const PlanarPose wrong{0.1, 0.2, 0.3}, right{0.5, -0.4, 0.55};
  for (int i = 0; i < 20; ++i) {
    builder.addOdometry(stampAt(i * 0.1), {});
    // The odd ones of five: in the mean 0.01.
    const double off = i % 5 == 0 ? 0.05 : 0;
    const PlanarPose& seen = i < 10 ? wrong : right;
    const double sign = i < 10 ? 1 : -1;
    builder.addLocalization(stampAt(i * 0.1), {seen.x + sign * off + 1e-9 * i, seen.y - sign * off,
                                               seen.yaw + sign * off});
  }
  const PoseTrack track = builder.build("map", "odom");
  ASSERT_EQ(track.jumps.size(), 1u);
  EXPECT_NEAR(track.jumps[0].distance, std::hypot(0.4 - 0.02, -0.6 + 0.02), 1e-6);
  EXPECT_NEAR(track.jumps[0].turn, 0.25 - 0.02, 1e-6);
  EXPECT_NE(track.remarks[0].find(" and 13.2 deg, "), std::string::npos) << track.remarks[0];
}

TEST(BaseLocalizer, jumpsToWhereFiveLooksInARowSeeIt) {
  const LocalizationNoise noise;
  EXPECT_FALSE(isJump({}, {0.2, 0, 0.1745}, noise));
  EXPECT_TRUE(isJump({}, {0.201, 0, 0}, noise));
  EXPECT_TRUE(isJump({}, {0, 0, -0.175}, noise));
  BaseLocalizer localizer(noise, {}, {}, stampAt(0));
  const auto see = [&](int look, double x) {
    localizer.correct({x, 1e-9 * look, 0}, stampAt(look));
  };
  for (int look = 1; look <= 4; ++look) see(look, 2);
  EXPECT_EQ(localizer.pose().x, 0);
  see(5, 0);
  for (int look = 6; look <= 9; ++look) see(look, 2);
  EXPECT_NEAR(localizer.pose().x, 0, 1e-6) << "four again";
  see(10, 2);
  EXPECT_NEAR(localizer.pose().x, 2, 1e-6);
}

/// The mean of two looks that are independent, the first of which was taken as it is.
TEST(BaseLocalizer, weighsMeasurementsByHowMuchTheyTell) {
  const LocalizationNoise noise;
  BaseLocalizer apart(noise, {}, {}, stampAt(0));
  apart.correct({0.03, 0.06, 0.012}, stampAt(0.4));
  EXPECT_NEAR(apart.pose().x, 0.015, 1e-9);
  EXPECT_NEAR(apart.pose().y, 0.03, 1e-9);
  EXPECT_NEAR(apart.pose().yaw, 0.006, 1e-9);
  EXPECT_NEAR(apart.positionError(), 0.03 / std::sqrt(2), 1e-9);
  EXPECT_NEAR(apart.yawError(), 0.0175 / std::sqrt(2), 1e-9);
  EXPECT_NEAR(apart.error({0.02, 0.01}).position, 0.02 / std::sqrt(2), 1e-9);
  EXPECT_NEAR(apart.error({0.02, 0.01}).yaw, 0.01 / std::sqrt(2), 1e-9);
  BaseLocalizer near(noise, {}, {}, stampAt(0));
  near.correct({0.03, 0.06, 0.012}, stampAt(0.2));
  EXPECT_NEAR(near.pose().x, 0.01, 1e-9) << "worth half a look";
  EXPECT_NEAR(near.pose().y, 0.02, 1e-9);
  EXPECT_NEAR(near.pose().yaw, 0.004, 1e-9);
}

TEST(BaseLocalizer, learnsItsYawFromWhereItGotTo) {
  struct Case {
    double yaw;
    PlanarPose step, seen;  ///< seen: as if it had been turned to the left by a little more
  };
  for (const Case& it : {Case{0, {1, 0, 0}, {0, 0.05, 0}},
                         {0, {0, 1, 0}, {-0.05, 0, 0}},
                         {kPi / 2, {1, 0, 0}, {-0.05, 0, 0}},
                         {kPi / 2, {0, 1, 0}, {0, -0.05, 0}}}) {
    BaseLocalizer localizer({}, {0, 0, it.yaw}, {}, stampAt(0));
    localizer.move(it.step);
    const PlanarPose base = localizer.pose();
    const PlanarPose seen{base.x + it.seen.x, base.y + it.seen.y, base.yaw};
    localizer.correct(compose(seen, inverse(it.step)), stampAt(2));
    EXPECT_GT(wrapAngle(localizer.pose().yaw - it.yaw), 0.001) << it.yaw << " " << it.step.x;
  }
}

/// Wheels that go 3 % farther than they say, and 3 % further round.
TEST(BaseLocalizer, learnsTheScaleOfItsOdometryInEveryDirection) {
  for (const PlanarPose& direction : {PlanarPose{0.1, 0, 0}, {0, 0.1, 0}, {0.06, 0.08, 0.1}}) {
    BaseLocalizer localizer({}, {}, {}, stampAt(0));
    PlanarPose truth, odometry;
    const PlanarPose step{direction.x * 1.03, direction.y * 1.03, direction.yaw * 1.03};
    for (int i = 1; i <= 120; ++i) {
      odometry = compose(odometry, direction);
      truth = compose(truth, step);
      localizer.move(odometry);
      if (i <= 100) localizer.correct(compose(truth, inverse(odometry)), stampAt(i));
    }
    EXPECT_LT(distance(localizer.pose(), truth), 0.02) << "without localization on the last 2 m";
    EXPECT_LT(std::abs(wrapAngle(localizer.pose().yaw - truth.yaw)), 0.02);
  }
}

TEST(BaseLocalizer, isNoSurerThanItsOneMeasurementWhileItStands) {
  BaseLocalizer localizer({}, {}, {}, stampAt(0));
  EXPECT_NEAR(localizer.error({0.02, 0.01}).position, 0.02, 1e-9);
  localizer.correct({}, stampAt(1));
  EXPECT_NEAR(localizer.error({0.02, 0.01}).position, 0.02, 1e-9) << "it tells nothing new";
  localizer.move({0.3, 0, 0});
  EXPECT_NEAR(localizer.goneSinceCorrection(), 0.3, 1e-9);
  localizer.correct({0.01, 0, 0}, stampAt(2));
  EXPECT_EQ(localizer.goneSinceCorrection(), 0);
  EXPECT_LT(localizer.error({0.02, 0.01}).position, 0.017);
}

TEST(TrackReader, leavesOutAndCountsWhatIsNoTransform) {
  TransformLog log;
  log.add({"odom", "base_link", 1, {1, 0, 0}});
  log.add({"odom", "base_link", 1.1, {std::numeric_limits<double>::quiet_NaN(), 0, 0}});
  log.addBytes({1, 2, 3}, 1.2);
  log.add({"odom", "base_link", 1.3, {2, 0, 0}});
  const auto track = log.read();
  ASSERT_TRUE(track) << log.why;
  EXPECT_EQ(track->sampleCount(), 2u);
  EXPECT_EQ(track->remarks.back(), "2 messages or transforms on /tf could not be read");
}

TEST(TrackReader, leavesOutTurnsThatAreNoneAndMessagesOfOtherTypes) {
  TransformLog log;
  log.add({"odom", "base_link", 1, {1, 0, 0}});
  log.add({"odom", "base_link", 1.1, {1, 0, std::numeric_limits<double>::infinity()}});
  log.addOther(textChannel("/tf"), text("x"), 1.2);
  log.addOther(textChannel("/tf"), text("y"), 1.3);
  std::string single = kTfMessage;
  for (std::size_t at = 0; (at = single.find("float64", at)) != std::string::npos;) {
    single.replace(at, 7, "float32");
  }
  const Channel singles = channelOf("/tf", "tf2_msgs/TFMessage", single);
  Value message = blank(singles);
  Value entry = blank(schemaOf(singles), "geometry_msgs/TransformStamped");
  for (const char* zero : {"translation.x", "translation.y", "translation.z", "rotation.x",
                           "rotation.y", "rotation.z", "rotation.w"}) {
    at(entry, std::string("transform.") + zero) = 0.F;
  }
  at(entry, "header.frame_id") = std::string("odom");
  at(entry, "child_frame_id") = std::string("base_link");
  at(message, "transforms") = Array{entry};
  log.addOther(singles, encode(schemaOf(singles), message), 1.4);
  const auto track = log.read();
  ASSERT_TRUE(track) << log.why;
  EXPECT_EQ(track->sampleCount(), 1u);
  EXPECT_EQ(track->remarks.back(), "4 messages or transforms on /tf could not be read");
}

TEST(TrackReader, namesTheBasesOfSeveralRobotsAndNotEveryPairOfALargeTree) {
  TransformLog silent;
  EXPECT_FALSE(silent.read());
  EXPECT_EQ(silent.why, "no odom -> base_link was recorded on /tf");
  TransformLog log;
  for (int i = 0; i < 30; ++i) {
    log.add({"a/link" + std::to_string(10 + i), "a/tool", 1 + i * 0.01, {}});
  }
  log.add({"a/odom", "a/base_link", 2, {}});
  log.add({"b/odom_combined", "b/base_footprint", 2.1, {}});
  EXPECT_FALSE(log.read());
  EXPECT_NE(log.why.find("a/link21 -> a/tool"), std::string::npos) << log.why;
  EXPECT_EQ(log.why.find("a/link22 -> a/tool"), std::string::npos) << log.why;
  EXPECT_NE(log.why.find("; perhaps --base-frame odom=a/odom base=a/base_link or "
                         "odom=b/odom_combined base=b/base_footprint"),
            std::string::npos)
      << log.why;
}

}  // namespace
}  // namespace afterglow::replay::pose_track_test
