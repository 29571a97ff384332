/// \file
/// What a replay might have measured: an arm that takes longer than recorded, a drive, light and
/// speech that wait for them.
#pragma once

#include <cmath>
#include <string>
#include <utility>

#include "replay/play/play_report.hpp"

namespace afterglow::test {

inline void addTopic(replay::PlayReport& report, const std::string& topic,
                     replay::Modality modality, double hz, double from_s, double to_s) {
  replay::PlannedTopic planned;
  planned.channel.topic = topic;
  planned.channel.type = "std_msgs/String";
  planned.output = planned.channel;
  planned.modality = modality;
  planned.rewrites = {{"header.stamp", replay::RewriteRule::ShiftStamp, 7}};
  replay::TopicReport played;
  for (int i = 0; from_s + i / hz < to_s; ++i) {
    const double recorded_s = from_s + i / hz, waited_s = recorded_s > 6 ? 2.5 : 0;
    const double late_ms = 0.02 + 0.03 * std::abs(std::sin(i * 12.9898)) + (i % 97 == 50 ? 1.2 : 0);
    played.moments.add({recorded_s, recorded_s + waited_s + late_ms / 1000, late_ms});
    played.lateness.add(static_cast<std::int64_t>(late_ms * 1e6));
    ++planned.count;
    ++played.published;
  }
  report.topics.emplace_back(planned, played);
}

inline void addSkew(replay::PlayReport& report, replay::Modality modality, double hz) {
  replay::ModalitySkew& skew = report.in_step.skew[modality];
  for (int i = 0; i < 12 * hz; ++i) {
    const double recorded_s = i / hz, ms = 9 * std::sin(i * 3.7);
    skew.size.add(static_cast<std::int64_t>(std::abs(ms) * 1e6));
    skew.samples.add({recorded_s, recorded_s + (recorded_s > 6 ? 2.5 : 0), ms});
  }
}

inline void addDrive(replay::PlayReport& report) {
  replay::DriveReport drive;
  drive.state = replay::BaseState::Done;
  drive.base.end_distance = 0.008;
  drive.base.end_turn = -0.3 / replay::kDegreesPerRadian;
  drive.base.largest_distance = 0.043;
  drive.base.drift_distance = 0.12;
  drive.base.drift_turn = 0.06;
  drive.base.corrections = 1;
  replay::BaseDriveReport driven;
  driven.topic = "/cmd_vel";
  driven.frame = "map";
  driven.is_localized = true;
  driven.length = 3.2;
  driven.drives = {drive};
  driven.delay = 0.7;
  report.base.emplace();
  report.base->topic = "/cmd_vel";
  report.base->driven = driven;
  for (int i = 0; i < 200; ++i) {
    const double at = 9.5 + i * 0.02;
    report.base->deviation.add({at - 2.5, at, 0.043 * std::abs(std::sin(i * 0.03))});
  }
}

inline replay::PlayReport madeUpReplay() {
  using replay::Modality;
  replay::PlayReport report;
  report.behavior_id = 7;
  report.behavior_name = "pick <the> \"red\" & the 'blue'";
  report.is_complete = true;
  report.scheduling = "SCHED_FIFO";
  report.planned_ns = 12'000'000'000;
  report.actual_ns = 14'500'000'000;
  addTopic(report, "/cmd_vel", Modality::Body, 30, 7, 11);
  addTopic(report, "/arm_controller/follow_joint_trajectory/goal", Modality::Body, 0.25, 2, 6);
  addTopic(report, "/projection/markers", Modality::Ar, 10, 0.5, 12);
  addTopic(report, "/points", Modality::Ar, 30, 0, 12);
  addTopic(report, "/robotsound", Modality::Speech, 0.2, 1, 12);
  replay::TopicReport& driven = report.topics[0].second;
  driven.moments = {};
  driven.lateness = {};
  driven.replaced = 120;
  driven.published = 200;
  report.topics[2].second.skipped = 3;
  report.topics[3].second.refused = 2;
  report.topics[3].second.problem = "points: 12 bytes are missing";
  replay::PlannedTopic state;
  state.channel.topic = "/joint_states";
  state.count = 1200;
  state.why_not = "states are never replayed";
  report.topics.emplace_back(state, replay::TopicReport());
  report.goals = {1, 1, 0, 0};
  report.goal_spans = {{"/arm_controller/follow_joint_trajectory/goal", 2, 2, 6, 8.5,
                        replay::GoalOutcome::Succeeded}};
  report.in_step.add({5.95, 5.95, 2.5, "/arm_controller/follow_joint_trajectory/goal"});
  addSkew(report, Modality::Ar, 20);
  addSkew(report, Modality::Speech, 0.2);
  addDrive(report);
  report.failures[Modality::Speech] = {1, "nobody was there for /robotsound"};
  report.notes = {"the robot was moved to the start by /arm_controller/follow_joint_trajectory"};
  report.body_end.emplace();
  report.body_end->joints = {{"elbow_flex_joint", -0.012}, {"torso_lift_joint", 0.002}};
  report.body_end->sliding = {"torso_lift_joint"};
  return report;
}

}  // namespace afterglow::test
