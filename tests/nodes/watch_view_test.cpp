// What `afterglow watch` makes of what nodes say of themselves.
#include "nodes/verbs/watch_view.hpp"

#include <gtest/gtest.h>

#include "nodes/tools/diagnostics.hpp"

namespace afterglow::nodes::watch_view_test {
namespace {

using diagnostic_msgs::DiagnosticStatus;
using Level = WatchLine::Level;

constexpr std::int64_t kSecond = 1'000'000'000, kStart = 100 * kSecond;

DiagnosticStatus statusOf(const std::string& name, int level, const std::string& message,
                          const std::string& hardware = "projector") {
  DiagnosticStatus status;
  status.name = name;
  status.hardware_id = hardware;
  status.level = static_cast<std::int8_t>(level);
  status.message = message;
  return status;
}

diagnostic_msgs::DiagnosticArray arrayOf(const std::vector<DiagnosticStatus>& statuses) {
  diagnostic_msgs::DiagnosticArray array;
  array.status = statuses;
  return array;
}

std::vector<std::string> wordsOf(const WatchView& view, std::int64_t now_ns) {
  std::vector<std::string> words;
  for (const WatchLine& line : view.lines(now_ns)) words.push_back(line.words());
  return words;
}

TEST(WatchView, saysOfAProjectorHowFastItDrawsAndOfALayerWhatItLacks) {
  DiagnosticStatus projector = statusOf("p: projector", DiagnosticStatus::OK, "projecting");
  addValue(projector, "drawn_hz", "29.9");
  addValue(projector, "wanted_hz", "30.0");
  DiagnosticStatus layer = statusOf("p: /cloud", DiagnosticStatus::WARN, "1 shown, 7 dropped (too large)");
  addValue(layer, "received", "10");
  WatchView view;
  view.take(arrayOf({projector, layer}), kStart);
  layer.values[0].value = "15";
  view.take(arrayOf({projector, layer}), kStart + kSecond);
  EXPECT_EQ(wordsOf(view, kStart + kSecond),
            (std::vector<std::string>{
                "warning  p: /cloud: 1 shown, 7 dropped (too large), 5.0 messages/s",
                "ok       p: projector: projecting, 29.9 of 30.0 Hz"}));
}

TEST(WatchView, saysWhatARecorderLoses) {
  DiagnosticStatus recorder =
      statusOf("r: recorder", DiagnosticStatus::OK, "recording 1 behavior", "recorder");
  addValue(recorder, "messages_per_s", "120.0");
  addValue(recorder, "bytes_per_s", "2500000");
  addValue(recorder, "queue_percent", "4");
  addValue(recorder, "dropped", "3");
  addValue(recorder, "store", "sqlite:/tmp/a.db");
  WatchView view;
  view.take(arrayOf({recorder}), kStart);
  EXPECT_EQ(view.lines(kStart).at(0).words(),
            "ok       r: recorder: recording 1 behavior, 120.0 messages/s, 2.50 MB/s, queue 4 %, 3 "
            "lost in all, into sqlite:/tmp/a.db");
}

TEST(WatchView, passesOverWhatIsNotAfterglows) {
  WatchView view;
  view.take(arrayOf({statusOf("battery: left", DiagnosticStatus::ERROR, "empty", "battery")}),
            kStart);
  EXPECT_TRUE(view.lines(kStart).empty());
}

TEST(WatchView, takesSilenceForAFaultOfWhoOughtToSpeak) {
  WatchView view;
  view.take(arrayOf({statusOf("projector_node: projector", DiagnosticStatus::OK, "projecting")}),
            kStart);
  ReplayStatus idle;
  idle.message = "played to its end";
  view.take("player_node", idle, kStart);
  EXPECT_EQ(view.lines(kStart + WatchView::kSilenceNs).at(1).level, Level::Ok);
  const auto lines = view.lines(kStart + 9 * kSecond);
  EXPECT_EQ(lines.at(0).words(),
            "ok       player_node: player: idle; the last replay: played to its end");
  EXPECT_EQ(lines.at(1).level, Level::Error);
  EXPECT_EQ(lines.at(1).text.find("silent for 9 s; before: projecting"), 0u) << lines.at(1).text;
}

TEST(WatchView, saysWhatAPlayerWaitsFor) {
  ReplayStatus status;
  status.state = ReplayStatus::PLAYING;
  status.behavior_id = 3;
  status.behavior_name = "pick";
  status.position = 1.5;
  status.duration = 7;
  status.rate = 1;
  status.message = "the base waits: something is in its way";
  WatchView view;
  view.take("player_node", status, kStart);
  EXPECT_EQ(view.lines(kStart).at(0).words(),
            "warning  player_node: player: playing behavior 3 'pick', 1.5 of 7.0 s at rate 1.00; "
            "the base waits: something is in its way");
  status.state = ReplayStatus::TO_START;
  status.message.clear();
  view.take("player_node", status, kStart);
  const std::string text = view.lines(kStart).at(0).text;
  EXPECT_EQ(text.find("on its way to the start of behavior 3 'pick'"), 0u) << text;
}

TEST(WatchLine, isOfTheSameKindWhileOnlyItsNumbersChange) {
  const WatchLine a{"p: projector", Level::Ok, "projecting, 29.9 of 30.0 Hz", {}};
  WatchLine b = a;
  b.text = "projecting, 7 of 30.0 Hz";
  EXPECT_EQ(a.kind(), b.kind());
  b.level = Level::Error;
  EXPECT_NE(a.kind(), b.kind());
}

}  // namespace
}  // namespace afterglow::nodes::watch_view_test
