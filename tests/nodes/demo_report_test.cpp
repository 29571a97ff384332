#include "nodes/kitting/demo_report.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

namespace afterglow::nodes::demo_report_test {
namespace {

nlohmann::json playerReport() {
  return {{"topics",
           {{"/a", {{"lateness_ms", {{"p50", 0.1}, {"p99", 2.0}, {"max", 2.5}}}}},
            {"/b", {{"lateness_ms", {{"p50", 0.3}, {"p99", 1.0}, {"max", 9.0}}}}},
            {"/c", {{"not_played", "nobody may"}}}}},
          {"in_step", {{"waited_s", 1.25}, {"skew_ms", {{"ar", {{"p95", 4.44}}}}}}},
          {"body",
           {{"worst", {{"joint", "elbow_flex_joint"}, {"error", -0.1}}},
            {"base", {{"distance_m", 0.0123}, {"turn_deg", 0.5}, {"drift_m", 0.05}}}}}};
}

DemoReport report() {
  MeasuredBehavior measured;
  measured.behavior.id = 7;
  measured.behavior.name = "pick";
  measured.behavior.tree_path = "kitting/pick";
  measured.behavior.outcome = "success";
  measured.behavior.begin = replay::Stamp{1'000'000'000};
  measured.behavior.end = replay::Stamp{13'500'000'000};
  measured.topics.resize(1);
  measured.topics[0].topic = "/cmd_vel";
  measured.topics[0].type = "geometry_msgs/Twist";
  measured.topics[0].count = 42;
  measured.messages = 42;
  measured.says = "<Ok> & \"done\"";
  measured.key_frames = {{"perceive", 1.25, "pick_live", "pick_replay"}};
  measured.live_end.base = {1, 2, 3.1};
  measured.replay_end.base = {1.03, 2.04, -3.1};
  measured.replay_end.p_gripper = {0.02, 0, 0};
  measured.player_report = playerReport();
  DemoReport result;
  result.behaviors = {measured};
  result.video = "demo.mp4";
  result.store = "demo.db";
  result.folder = "out/demo";
  result.command = "build/bin/afterglow";
  return result;
}

DemoStory story() {
  DemoStory result;
  result.title = "A title";
  result.behaviors = {
      {"pick", "Picking", "caption", "What?", "Why & how", "", {{"perceive", "It looks."}}}};
  return result;
}

TEST(DemoReport, endErrorIsMeasuredTheShortWayRound) {
  const MeasuredBehavior measured = report().behaviors[0];
  const EndError error = endError(measured.live_end, measured.replay_end);
  EXPECT_NEAR(error.base_cm, 5, 1e-9);
  EXPECT_NEAR(error.heading_deg, (2 * M_PI - 6.2) * 180 / M_PI, 1e-9);
  EXPECT_NEAR(error.gripper_cm, 2, 1e-9);
}

TEST(DemoReport, latenessIsTheWorstTopics) {
  const ReplayLateness late = latenessOf(playerReport());
  EXPECT_EQ(late.median_ms, 0.3);
  EXPECT_EQ(late.p99_ms, 2.0);
  EXPECT_EQ(late.max_ms, 9.0);
  EXPECT_THROW(latenessOf({{"what", "ever"}}), std::runtime_error);
}

TEST(DemoReport, summaryTellsWhatWasMeasured) {
  const nlohmann::json json = summaryJson(report());
  const nlohmann::json& pick = json.at("behaviors").at(0);
  EXPECT_EQ(pick.at("id"), 7);
  EXPECT_EQ(pick.at("duration_s"), 12.5);
  EXPECT_EQ(pick.at("topics").at("/cmd_vel").at("count"), 42);
  EXPECT_EQ(pick.at("replay").at("end_error").at("base_cm"), 5.0);
  EXPECT_EQ(pick.at("replay").at("lateness_ms").at("p99"), 2.0);
  EXPECT_EQ(pick.at("replay").at("player"), playerReport());
}

TEST(DemoReport, pageShowsPicturesAndNumbersAndEscapesWords) {
  const std::string page = reportHtml(report(), story());
  const auto shows = [&](const std::string& text) { return page.find(text) != std::string::npos; };
  EXPECT_TRUE(shows("src=\"frames/pick_live.png\""));
  EXPECT_TRUE(shows("src=\"frames/pick_replay.png\""));
  EXPECT_TRUE(shows("src=\"demo.mp4\""));
  EXPECT_TRUE(shows("&lt;Ok&gt; &amp; &quot;done&quot;"));
  EXPECT_TRUE(shows("Why &amp; how"));
  EXPECT_TRUE(shows("5.0 cm"));
  EXPECT_TRUE(shows("build/bin/afterglow show 7"));
  EXPECT_FALSE(shows("http"));
  EXPECT_FALSE(shows("<script"));
}

TEST(DemoReport, pageSaysWhatThePlayerMeasured) {
  DemoReport measured = report();
  const std::string row =
      "<td class=\"n\">1.2 s</td><td class=\"n\">4.4 ms</td><td class=\"n\">-</td>"
      "<td class=\"n\">5.0 cm</td><td class=\"n\">1.2 cm, 0.5°</td>"
      "<td class=\"n\">elbow_flex_joint -5.73°</td>";
  EXPECT_NE(reportHtml(measured, story()).find(row), std::string::npos)
      << reportHtml(measured, story());
  measured.behaviors[0].player_report.erase("body");
  measured.behaviors[0].player_report.erase("in_step");
  std::string nothing = "<tr><td>pick</td>";
  for (int i = 0; i < 6; ++i) nothing += "<td class=\"n\">-</td>";
  EXPECT_NE(reportHtml(measured, story()).find(nothing), std::string::npos);
}

TEST(DemoReport, everyPictureHasWords) {
  const std::string page = reportHtml(report(), story());
  std::size_t pictures = 0;
  for (std::size_t at = page.find("<img"); at != std::string::npos;
       at = page.find("<img", at + 1)) {
    const std::string tag = page.substr(at, page.find('>', at) - at);
    EXPECT_NE(tag.find("It looks."), std::string::npos) << tag;
    ++pictures;
  }
  EXPECT_EQ(pictures, 2u);
}

TEST(DemoStory, shippedStoryNamesEveryBehaviorOfTheTask) {
  const DemoStory shipped = loadDemoStory("assets/demo/story.yaml");
  ASSERT_EQ(shipped.behaviors.size(), 3u);
  EXPECT_EQ(shipped.behaviors[0].name, "pick");
  EXPECT_EQ(shipped.behaviors[1].name, "drive");
  EXPECT_EQ(shipped.behaviors[2].name, "place");
  for (const BehaviorStory& behavior : shipped.behaviors) EXPECT_GE(behavior.moments.size(), 2u);
}

}  // namespace
}  // namespace afterglow::nodes::demo_report_test
