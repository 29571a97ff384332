// The drift watch: its configuration, the layout of known tags, what it says in /diagnostics.
#include "nodes/projector/watch_config.hpp"

#include <gtest/gtest.h>

#include <fstream>

#include "nodes/projector/drift_monitor.hpp"
#include "nodes/projector/projector_config.hpp"
#include "nodes/tools/tag_layout_file.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::nodes::watch_config_test {
namespace {

using diagnostic_msgs::DiagnosticStatus;

const std::string kHead =
    "fixed_frame: map\n"                                        // line 1
    "projector: {camera_info: p.yaml, frame: optical}\n"        // line 2
    "layers: [{topic: /m, type: visualization_msgs/Marker}]\n"  // line 3
    "watch:\n";                                                 // line 4
const std::string kWatch =
    "  image: /camera/image_raw\n"
    "  camera_info: /camera/camera_info\n"
    "  tags: floor.yaml\n";
const std::string kFloor =
    "frame: map\n"
    "tags:\n"
    "  - {id: 3, center: [1.0, 0.5], size: 0.16, yaw_deg: 90}\n"
    "  - {id: 4, corners: [[0, 0.2], [0.2, 0.2], [0.2, 0], [0, 0]]}\n";

std::string topicOf(const WatchConfig& watch) {
  const auto* topic = std::get_if<CameraTopic>(&watch.camera_info);
  return topic != nullptr ? topic->name : "a file";
}
std::string fileOf(const WatchConfig& watch) {
  const auto* file = std::get_if<CameraFile>(&watch.camera_info);
  return file != nullptr ? file->path : "a topic";
}

class WatchConfigTest : public testing::Test {
 protected:
  void SetUp() override { write("floor.yaml", kFloor); }

  void write(const std::string& name, const std::string& text) {
    std::ofstream(folder_.path(name)) << text;
  }
  ProjectorConfig load(const std::string& watch) {
    write("config.yaml", kHead + watch);
    return loadProjectorConfig(folder_.path("config.yaml"), "");
  }
  /// The message without the folder.
  template <typename Function>
  std::string faultOf(const Function& function) {
    try {
      function();
    } catch (const std::runtime_error& error) {
      return std::string(error.what()).substr(folder_.path("").size());
    }
    return "no fault";
  }
  std::string fault(const std::string& watch) {
    return faultOf([&] { load(watch); });
  }
  std::string layoutFault(const std::string& text) {
    write("other.yaml", text);
    return faultOf([&] { loadTagLayout(folder_.path("other.yaml")); });
  }

  test::TempFolder folder_;
};

TEST_F(WatchConfigTest, isAbsentUnlessConfigured) {
  std::ofstream(folder_.path("plain.yaml")) << kHead.substr(0, kHead.size() - 7);
  EXPECT_FALSE(loadProjectorConfig(folder_.path("plain.yaml"), "").watch);
}

TEST_F(WatchConfigTest, readsTopicsTagsAndLimits) {
  const auto watch = load(kWatch + "  period_s: 5\n  limit_px: 3\n").watch;
  ASSERT_TRUE(watch);
  EXPECT_EQ(watch->image_topic, "/camera/image_raw");
  EXPECT_EQ(topicOf(*watch), "/camera/camera_info");
  EXPECT_EQ(watch->period_s, 5);
  EXPECT_EQ(watch->limit_px, 3);
  EXPECT_FALSE(watch->limit_mm);
  EXPECT_EQ(watch->layout.frame, "map");
  ASSERT_EQ(watch->layout.tags.size(), 2u);
  // Turned by 90 degrees counterclockwise: the picture's top left is at the lower left.
  EXPECT_LT((watch->layout.tags[0].corners[0] - Eigen::Vector2d(0.92, 0.42)).norm(), 1e-9);
  EXPECT_EQ(load(kWatch).watch->limit_mm, 10) << "without a limit: 10 mm";
}

/// The configuration's own path is absolute here, and with it that of the file beside it.
TEST_F(WatchConfigTest, tellsACamerasFileFromATopicByWhatIsWritten) {
  const auto written = [&](const std::string& camera) {
    return *load("  image: /i\n  camera_info: " + camera + "\n  tags: floor.yaml\n").watch;
  };
  EXPECT_EQ(fileOf(written("camera.yaml")), folder_.path("camera.yaml"));
  EXPECT_EQ(fileOf(written("camera")), folder_.path("camera"));
  EXPECT_EQ(fileOf(written("../camera.yaml")), folder_.path("../camera.yaml"));
  EXPECT_EQ(fileOf(written("/no/topic/has/a.yaml")), "/no/topic/has/a.yaml");
  EXPECT_EQ(topicOf(written("/camera/info")), "/camera/info");
  write("plain", "");
  EXPECT_EQ(fileOf(written(folder_.path("plain"))), folder_.path("plain"));
}

TEST_F(WatchConfigTest, refusesTyposWithFileAndLine) {
  EXPECT_EQ(fault(kWatch + "  limit_mn: 3\n"),
            "config.yaml:8: unknown key 'limit_mn' in 'watch'; did you mean 'limit_mm'?");
  EXPECT_EQ(fault("  image: /i\n  tags: floor.yaml\n"),
            "config.yaml:5: no 'camera_info' in 'watch'");
  EXPECT_EQ(fault("  image: camera\n  camera_info: /i\n  tags: floor.yaml\n"),
            "config.yaml:5: 'image' of 'watch' is a topic: it should begin with '/'");
  EXPECT_EQ(fault(kWatch + "  period_s: 0\n"),
            "config.yaml:8: 'period_s' of 'watch' should be a number from 0.1 to 3600, not '0'");
  write("floor.yaml", kFloor.substr(11));
  EXPECT_EQ(fault(kWatch), "config.yaml:7: " + folder_.path("floor.yaml") +
                               " names no 'frame': the tf frame whose plane the tags lie on");
}

TEST_F(WatchConfigTest, refusesLayoutsThatCannotBe) {
  EXPECT_EQ(layoutFault("tags:\n  - {id: 1, centre: [0, 0], size: 0.1}\n"),
            "other.yaml:2: unknown key 'centre' in entry 1 of 'tags'; did you mean 'center'?");
  EXPECT_EQ(layoutFault("tags:\n  - {id: 1}\n"),
            "other.yaml:2: entry 1 of 'tags' needs either 'center' and 'size' or 'corners'");
  EXPECT_EQ(layoutFault("tags:\n  - {id: 1.5, center: [0, 0], size: 0.1}\n"),
            "other.yaml:2: 'id' should be a whole number");
  EXPECT_EQ(layoutFault("tags:\n  - {id: 587, center: [0, 0], size: 0.1}\n"),
            "other.yaml:2: 'id' of entry 1 of 'tags' should be a number from 0 to 586, not '587'");
  EXPECT_EQ(layoutFault("tags:\n  - {id: 1, center: [0, 0], size: 0.1}\n"
                        "  - {id: 1, center: [1, 0], size: 0.1}\n"),
            "other.yaml:3: id 1 twice");
  EXPECT_EQ(layoutFault("tags:\n  - {id: 1, center: [0, 0], size: 0.1}\n"
                        "  - {id: 2, center: [0.1, 0], size: 0.1}\n"),
            "other.yaml:3: tags 2 and 1 overlap: each needs a white rim of an eighth of its size");
  EXPECT_EQ(layoutFault("tags: [{id: 1, center: [0, 0], size: 0.1}]\n"
                        "targets: [{id: 7, center: [1, 0], size: 0.1}]\n"),
            "other.yaml:2: target 7: ids of thrown tags are from 100 on");
  EXPECT_EQ(layoutFault("tags: [{id: 1, center: [0, 0], size: 160}]\n"),
            "other.yaml:1: 'size' of entry 1 of 'tags' should be a number from 0.005 to 10, not "
            "'160'");
  // Face down: bottom left first.
  EXPECT_EQ(
      layoutFault("tags: [{id: 1, corners: [[0, 0], [0.2, 0], [0.2, 0.2], [0, 0.2]]}]\n")
          .substr(0, 60),
      std::string("other.yaml:1: 'corners' of entry 1 of 'tags' should be a square").substr(0, 60));
}

TEST_F(WatchConfigTest, takesABoardOnTheFloorForALayout) {
  write("board.yaml",
        "family: " + calib::kTagFamilies.back() + "\nsize_m: [0.594, 0.42]\nruler_m: 0.2\npicture: board.png\n"
        "tags:\n  - {id: 0, corners: [[0, 0.1, 0], [0.1, 0.1, 0], [0.1, 0, 0], [0, 0, 0]]}\n");
  const calib::TagLayout layout = loadTagLayout(folder_.path("board.yaml"));
  EXPECT_EQ(layout.family, calib::kTagFamilies.back());
  EXPECT_EQ(layout.tags.size(), 1u);
}

// ----------------------------------------------------------------------------------------- status

WatchConfig limits(std::optional<double> px, std::optional<double> mm) {
  WatchConfig config;
  config.limit_px = px;
  config.limit_mm = mm;
  return config;
}

WatchLook offBy(double px, double mm) {
  WatchLook look;
  look.drift = {5, {{3, px, mm}, {4, px, mm}}, px, mm};
  return look;
}

TEST(WatchStatus, isOkUpToTheLimitAndWarnsBeyond) {
  const WatchConfig config = limits(3, 10);
  const auto good = watchStatus("node", config, offBy(2.9, 9.9), 1);
  EXPECT_EQ(good.level, DiagnosticStatus::OK);
  EXPECT_EQ(good.name, "node: drift watch");
  EXPECT_EQ(good.message, "2 tags within 2.9 px, 9.9 mm");
  const auto far = watchStatus("node", config, offBy(2, 10.5), 1);
  EXPECT_EQ(far.level, DiagnosticStatus::WARN);
  EXPECT_EQ(far.message,
            "drift: 2 tags are off by 2.0 px, 10.5 mm (limit 3.0 px, 10.0 mm); localize the robot, "
            "or calibrate again");
  EXPECT_EQ(watchStatus("node", config, offBy(3.5, 1), 1).level, DiagnosticStatus::WARN);
  EXPECT_EQ(watchStatus("node", limits({}, 10), offBy(3.5, 1), 1).level, DiagnosticStatus::OK);
}

TEST(WatchStatus, isStaleWhereNothingCanBeCompared) {
  const WatchConfig config = limits({}, 10);
  WatchLook look;
  look.problem = "nothing on /camera for 2 s";
  auto status = watchStatus("node", config, look, 1);
  EXPECT_EQ(status.level, DiagnosticStatus::STALE);
  EXPECT_EQ(status.message, look.problem);
  look.problem.clear();
  EXPECT_EQ(watchStatus("node", config, look, 1).message,
            "no known tag should be in the camera's view now");
  look.drift.expected = 4;
  status = watchStatus("node", config, look, 1);
  EXPECT_EQ(status.level, DiagnosticStatus::STALE);
  EXPECT_EQ(status.message, "none of the 4 tags that should be in the camera's view is seen");
}

}  // namespace
}  // namespace afterglow::nodes::watch_config_test
