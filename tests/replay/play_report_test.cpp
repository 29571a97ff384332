#include "replay/play/play_report.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/support/made_up_replay.hpp"

namespace afterglow::replay::play_report_test {
namespace {

std::vector<std::string> keysOf(const nlohmann::ordered_json& json) {
  std::vector<std::string> keys;
  for (const auto& [key, value] : json.items()) keys.push_back(key);
  return keys;
}

TEST(PlayReport, keepsItsKeys) {
  using Keys = std::vector<std::string>;
  const auto json = toJson(test::madeUpReplay());
  EXPECT_EQ(keysOf(json), (Keys{"behavior_id", "name", "completed", "reason", "notes", "scheduling",
                                "begin_s", "rate", "planned_s", "actual_s", "goals", "in_step",
                                "body", "failures", "dropped", "refused", "topics"}));
  EXPECT_EQ(keysOf(json["in_step"]), (Keys{"gated", "waits", "waited_s", "skew_ms"}));
  EXPECT_EQ(keysOf(json["in_step"]["skew_ms"]["speech"]), (Keys{"messages", "p50", "p95", "max"}));
  EXPECT_EQ(keysOf(json["body"]), (Keys{"joints", "worst", "not_known", "base"}));
  EXPECT_EQ(keysOf(json["body"]["base"]),
            (Keys{"distance_m", "turn_deg", "topic", "closed_loop", "localized", "length_m",
                  "drives", "largest_deviation_m", "drift_m", "drift_deg", "corrections", "delay_s",
                  "waited_for_poses_s"}));
  EXPECT_EQ(keysOf(json["topics"]["/points"]),
            (Keys{"type", "count", "class", "why", "modality", "rewritten", "published", "skipped",
                  "refused", "problem", "heard", "lateness_ms", "drift_ms"}));
  EXPECT_EQ(keysOf(json["topics"]["/joint_states"]),
            (Keys{"type", "count", "class", "why", "not_played"}));
}

TEST(PlayReport, saysWhatWentWrongAndHowFarOffItEnded) {
  const auto json = toJson(test::madeUpReplay());
  EXPECT_EQ(json["failures"]["speech"]["first"], "nobody was there for /robotsound");
  EXPECT_EQ(
      json["dropped"].dump(),
      R"([{"topic":"/projection/markers","count":3,"why":"too late, and overtaken or dangerous"}])");
  EXPECT_EQ(json["refused"].dump(),
            R"([{"topic":"/points","count":2,"why":"points: 12 bytes are missing"}])");
  EXPECT_EQ(json["body"]["worst"]["joint"], "elbow_flex_joint");
  EXPECT_NEAR(json["body"]["base"]["turn_deg"].get<double>(), 0.3, 1e-9);
  EXPECT_NEAR(json["body"]["base"]["distance_m"].get<double>(), 0.008, 1e-9);
  EXPECT_EQ(json["in_step"]["waits"], 1);
}

TEST(PlayReport, takesTheBaseFromTfWhenNoDriveFoundIt) {
  PlayReport report = test::madeUpReplay();
  report.base->driven->drives.back().state = BaseState::Lost;
  EXPECT_FALSE(baseEnd(report)) << "a base that was lost ended anywhere";
  report.body_end->base = BodyEnd::Base{0.4, 0.1};
  EXPECT_EQ(baseEnd(report).value().distance, 0.4);
}

TEST(PlayReport, tellsWhatNobodyHeardFromWhatWasNotSent) {
  PlayReport report;
  for (const char* topic : {"/points", "/path", "/robotsound"}) {
    PlannedTopic planned;
    planned.output.topic = topic;
    report.topics.emplace_back(planned, TopicReport{});
  }
  const std::vector<std::string> unheard{"/points", "/path"};
  using Notes = std::vector<std::string>;
  EXPECT_EQ(unheardNotes(unheard, report), Notes{"nothing was sent"});
  EXPECT_EQ(unheardNotes({}, report), Notes{"nothing was sent"}) << "stopped before its first message";
  report.topics[0].second.published = 3;
  EXPECT_EQ(unheardNotes(unheard, report),
            (Notes{"nobody listened on /points at the start", "nothing was sent on /path"}));
  EXPECT_EQ(unheardNotes({}, report), Notes());
}

TEST(Samples, keepFewAsTheyAre) {
  Samples samples;
  for (int i = 0; i < 5; ++i) samples.add({0, double(i), double(i % 2)});
  ASSERT_EQ(samples.kept().size(), 5u);
  EXPECT_EQ(samples.kept()[3].played_s, 3);
}

TEST(Samples, thinManyButKeepPeaksAndOrder) {
  Samples samples;
  for (int i = 0; i < 1'000'000; ++i) {
    samples.add({0, i * 1e-3, i == 123'457 ? -9.0 : i == 999'999 ? 8.0 : 0.5});
  }
  const std::vector<Sample>& kept = samples.kept();
  EXPECT_EQ(samples.count(), 1'000'000u);
  EXPECT_LE(kept.size(), Samples::kMost);
  EXPECT_GE(kept.size(), Samples::kMost / 2 - 100);
  int lows = 0, highs = 0;
  for (std::size_t i = 0; i < kept.size(); ++i) {
    lows += kept[i].value == -9.0;
    highs += kept[i].value == 8.0;
    if (i > 0) {
      EXPECT_LT(kept[i - 1].played_s, kept[i].played_s);
    }
  }
  EXPECT_EQ(lows, 1);
  EXPECT_EQ(highs, 1);
}

}  // namespace
}  // namespace afterglow::replay::play_report_test
