// Why the floor is dark, in words: what the diagnostics say of layers, topics and frames.
#include "nodes/projector/projector_diagnostics.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "nodes/projector/dark_reasons.hpp"
#include "nodes/projector/transform_listener.hpp"

namespace afterglow::nodes::projector_diagnostics_test {
namespace {

using diagnostic_msgs::DiagnosticStatus;

LayerStatus layerOf(std::size_t shown) {
  LayerStatus layer;
  layer.topic = "/cloud";
  layer.received = shown;
  layer.shown = shown;
  layer.type = "sensor_msgs/PointCloud2";
  layer.source = TopicSource{{"/camera"}, "sensor_msgs/PointCloud2"};
  return layer;
}

render::LayerCensus censusOf(std::size_t lit, std::size_t outside = 0, std::size_t behind = 0) {
  render::LayerCensus census;
  census.name = "/cloud";
  census.drawables = lit + outside + behind;
  census.lit = lit;
  census.outside = outside;
  census.behind = behind;
  return census;
}

/// One projector and one layer.
ProjectorState stateOf(LayerStatus layer, render::LayerCensus census) {
  ProjectorState state;
  state.name = "node";
  state.outputs.push_back({"", "by hand", {}, {std::move(census)}});
  if (layer.received > 0) state.silent_s["/cloud"] = 3;
  state.layers.push_back(std::move(layer));
  return state;
}

/// The first projector's value of this key; empty: it has none.
std::string valueOf(const ProjectorState& state, const std::string& key) {
  const auto values = toDiagnostics(state).status.front().values;
  const auto found = std::find_if(values.begin(), values.end(),
                                  [&](const auto& value) { return value.key == key; });
  return found == values.end() ? "" : found->value;
}

/// The level and the message of the projector, or of the layer.
std::string saidOf(const ProjectorState& state, const std::string& name) {
  for (const DiagnosticStatus& status : toDiagnostics(state).status) {
    if (status.name == "node: " + name) return std::to_string(status.level) + " " + status.message;
  }
  return "nothing";
}

TEST(ProjectorDiagnostics, sayHowFarLightMayBeOffWhileTheProjectorMoves) {
  ProjectorState state = stateOf(layerOf(4), censusOf(4));
  state.outputs[0].light_off_mm = 4;
  EXPECT_EQ(saidOf(state, "projector"), "0 projecting");
  EXPECT_EQ(valueOf(state, "light may be off"), "4.0 mm at 2 m");
  state.outputs[0].light_off_mm = 33;
  EXPECT_EQ(saidOf(state, "projector"), "1 projecting; it moves: light may be off by 33 mm");
}

TEST(ProjectorDiagnostics, sayThatContentLiesBesideTheLight) {
  const ProjectorState state = stateOf(layerOf(4), censusOf(0, 3, 1));
  const std::string words =
      "0 of 4 drawables inside the light (3 beside it, 1 behind the projector)";
  EXPECT_EQ(saidOf(state, "projector"), "1 dark: " + words);
  EXPECT_EQ(saidOf(state, "/cloud"), "1 4 shown, " + words);
}

TEST(ProjectorDiagnostics, areWellWhileSomethingIsLit) {
  const ProjectorState state = stateOf(layerOf(2), censusOf(1, 1));
  EXPECT_EQ(saidOf(state, "projector"), "0 projecting");
  EXPECT_EQ(saidOf(state, "/cloud"),
            "0 2 shown, 1 of 2 drawables inside the light (1 beside it)");
}

TEST(ProjectorDiagnostics, nameEachReasonForWhatIsNotLit) {
  LayerStatus layer = layerOf(5);
  layer.dropped = {{"a point is not finite or absurdly far", 7}};
  layer.nothing = "a path of one pose";
  layer.missing = "no transform from 'arm' to 'map'";
  layer.waiting_for = "arm";
  render::LayerCensus census = censusOf(1);
  census.drawables = 4;
  census.flat = census.blank = census.transparent = 1;
  layer.invisible = 1;
  EXPECT_EQ(saidOf(stateOf(layer, census), "/cloud"),
            "1 5 shown, no transform from 'arm' to 'map', 1 of 5 drawables inside the light (2 of "
            "alpha 0, 1 without extent, as the projector sees it, 1 of blank text), its newest "
            "message shows nothing: a path of one pose, 7 dropped (a point is not finite or "
            "absurdly far)");
  layer.dropped = {{"a", 1}, {"b", 2}, {"c", 3}};
  EXPECT_EQ(saidOf(stateOf(layer, censusOf(1)), "/cloud").substr(0, 13), "1 5 shown, no");
  EXPECT_NE(saidOf(stateOf(layer, censusOf(1)), "/cloud").find(", and 2 other reasons"),
            std::string::npos);
}

TEST(DarkReasons, areTheSameForARecordedPictureAndNamedOnce) {
  LayerStatus good = layerOf(1), bad = layerOf(0);
  bad.topic = "/strip";
  bad.dropped = {{"a point is not finite or absurdly far", 1}};
  bad.missing = "no transform from 'arm' to 'map'";
  EXPECT_EQ(darkReasons({"/strip: no transform from 'arm' to 'map'"}, {good, bad}, {censusOf(1)}),
            (std::vector<std::string>{
                "/strip: no transform from 'arm' to 'map'",
                "/strip: 1 dropped (a point is not finite or absurdly far)"}));
  EXPECT_TRUE(darkReasons({}, {good}, {censusOf(1)}).empty());
}

TEST(ProjectorDiagnostics, warnWhileDrawingTakesLongerThanItHas) {
  ProjectorState state = stateOf(layerOf(2), censusOf(2));
  state.wanted_hz = 30;
  state.drawn_hz = 20.4;
  state.drawing_ms = 48;
  EXPECT_EQ(saidOf(state, "projector"),
            "1 projecting; drawing takes 48 ms: 20 of 30 images a second");
  state.drawing_ms = 33;
  EXPECT_EQ(saidOf(state, "projector"), "0 projecting");
}

TEST(ProjectorDiagnostics, tellTheTimesOfTheStages) {
  ProjectorState state = stateOf(layerOf(2), censusOf(2));
  state.stages = {{"drawn", "p50 8.0, p99 9.0 ms"}};
  EXPECT_EQ(valueOf(state, "time: drawn"), "p50 8.0, p99 9.0 ms");
}

TEST(ProjectorDiagnostics, tellWhatBecomesOfLightOnTexturedSurfaces) {
  ProjectorState state = stateOf(layerOf(2), censusOf(2));
  state.outputs[0].textures = {{"floor", 0.3, 0.75, 2000, 30, 50}, {"table", 0.2, 0.5, 0, 0, 0}};
  EXPECT_EQ(valueOf(state, "texture: floor"),
            "white is dimmed to 75 % of what half of the surface could show, to be even; 1.5 % of "
            "its light is out of reach; 2.5 % falls where it was not photographed");
  EXPECT_EQ(valueOf(state, "texture: table"), "") << "nothing is lit there";
  state.outputs[0].textures = {{"floor", 0, 0, 10, 0, 10}};
  EXPECT_EQ(valueOf(state, "texture: floor"),
            "nothing of what is lit was photographed: sent as drawn");
  EXPECT_EQ(valueOf(state, "blending"), "");
  state.outputs[0].blending = "40 % of its picture is shared";
  EXPECT_EQ(valueOf(state, "blending"), "40 % of its picture is shared");
}

TEST(ProjectorDiagnostics, sayHowMuchIsKeptDarkAndWarnOfAll) {
  ProjectorState state = stateOf(layerOf(2), censusOf(2));
  EXPECT_EQ(valueOf(state, "kept dark"), "");
  state.outputs[0].avoided_share = 0.001;
  EXPECT_EQ(valueOf(state, "kept dark"), "0.1 %");
  EXPECT_EQ(saidOf(state, "projector"), "0 projecting");
  state.outputs[0].avoided_share = 0.3;
  EXPECT_EQ(saidOf(state, "projector"), "0 projecting; 30 % of the picture is kept dark ('avoid')");
  state.outputs[0].avoided_share = 1;
  EXPECT_EQ(saidOf(state, "projector"),
            "1 projecting; 100 % of the picture is kept dark ('avoid')");
}

TEST(ProjectorDiagnostics, takeTheProjectorThatShowsMostOfALayer) {
  ProjectorState state = stateOf(layerOf(2), censusOf(0, 2));
  state.outputs.push_back({"other", "", {}, {censusOf(2)}});
  EXPECT_EQ(saidOf(state, "projector"), "1 dark: 0 of 2 drawables inside the light (2 beside it)");
  EXPECT_EQ(saidOf(state, "projector other"), "0 projecting");
  EXPECT_EQ(saidOf(state, "/cloud"), "0 2 shown");
}

TEST(ProjectorDiagnostics, nameBothTypesOfATopicThatHasAnother) {
  LayerStatus layer = layerOf(0);
  layer.source->type = "sensor_msgs/LaserScan";
  EXPECT_EQ(saidOf(stateOf(layer, censusOf(0)), "/cloud"),
            "1 0 shown, /camera publishes sensor_msgs/LaserScan, the configuration says "
            "sensor_msgs/PointCloud2");
}

TEST(ProjectorDiagnostics, sayWhyALayerHasNothingToShow) {
  LayerStatus layer = layerOf(0);
  EXPECT_EQ(saidOf(stateOf(layer, censusOf(0)), "/cloud"), "0 0 shown, no message yet");
  layer.source->publishers.clear();
  EXPECT_EQ(saidOf(stateOf(layer, censusOf(0)), "/cloud"), "0 0 shown, nobody publishes it");
  EXPECT_EQ(saidOf(stateOf(layer, censusOf(0)), "projector"),
            "0 projecting nothing: no layer has anything to show");
  layer = layerOf(0);
  layer.received = 7;
  EXPECT_EQ(saidOf(stateOf(layer, censusOf(0)), "/cloud"), "0 0 shown, silent for 3 s");
  layer.expired = 7;
  EXPECT_EQ(saidOf(stateOf(layer, censusOf(0)), "/cloud"),
            "0 0 shown, silent for 3 s, lifetimes are over");
}

TEST(ProjectorDiagnostics, tellBlackAndInvisibleContent) {
  LayerStatus layer = layerOf(3);
  layer.invisible = 1;
  render::LayerCensus census = censusOf(0);
  census.drawables = 2;
  census.black = census.clipped = 1;
  EXPECT_EQ(saidOf(stateOf(layer, census), "/cloud"),
            "1 3 shown, 0 of 3 drawables inside the light (1 beside the surface's outline or in "
            "its shade, 1 black, 1 of alpha 0)");
}

TEST(ProjectorDiagnostics, countNothingWhileTheProjectorsPlaceIsUnknown) {
  ProjectorState state = stateOf(layerOf(1), censusOf(0, 1));
  state.outputs[0].census.clear();
  state.outputs[0].problems = {"projector: no transform from 'p' to 'map'"};
  EXPECT_EQ(saidOf(state, "projector"), "2 projector: no transform from 'p' to 'map'");
  EXPECT_EQ(saidOf(state, "/cloud"), "0 1 shown");
}

TEST(FaultLog, saysOnceWhatCountsSeconds) {
  FaultLog log;
  const std::string stale = "/a: the transform from 'a' to 'map' is stale: 'a' in 'map' is ";
  EXPECT_EQ(log.news({stale + "2 s old"}, {}, 0).size(), 1u);
  EXPECT_TRUE(log.news({stale + "3 s old"}, {}, 1'000'000'000).empty());
  EXPECT_EQ(log.news({"/a: stamped 29 s after it came"}, {}, 0).size(), 1u);
  EXPECT_TRUE(log.news({"/a: stamped 30 s after it came"}, {}, 0).empty());
}

// -------------------------------------------------------------------------------------- parents
constexpr std::int64_t kSecond = 1'000'000'000;

TEST(ParentMonitor, namesParentsInConflictAndWhoPublishesThem) {
  ParentMonitor watch;
  watch.note("arm", "map", "/a", false, 0);
  watch.note("hand", "arm", "/a", false, 0);
  EXPECT_TRUE(watch.conflicts(0).empty());
  watch.note("arm", "odom", "/b", false, kSecond);
  EXPECT_EQ(watch.conflicts(kSecond),
            std::vector<std::string>{"frame 'arm' has two parents: 'map' (published by /a) and "
                                     "'odom' (published by /b)"});
}

TEST(ParentMonitor, forgetsAParentThatWasLeft) {
  ParentMonitor watch;
  watch.note("arm", "map", "/a", false, 0);
  watch.note("arm", "odom", "/a", false, 6 * kSecond);
  EXPECT_TRUE(watch.conflicts(6 * kSecond).empty());
}

TEST(ParentMonitor, remembersStaticOnesUntilTheirPublisherSaysOtherwise) {
  ParentMonitor watch;
  watch.note("arm", "map", "/a", true, 0);
  watch.note("arm", "odom", "/b", false, 60 * kSecond);
  EXPECT_EQ(watch.conflicts(60 * kSecond).size(), 1u);
  watch.note("arm", "odom", "/a", true, 61 * kSecond);
  EXPECT_TRUE(watch.conflicts(61 * kSecond).empty());
}

}  // namespace
}  // namespace afterglow::nodes::projector_diagnostics_test
