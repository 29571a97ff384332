#include <diagnostic_msgs/DiagnosticArray.h>
#include <gtest/gtest.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <tf2_msgs/TFMessage.h>
#include <visualization_msgs/Marker.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <memory>
#include <mutex>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "nodes/tools/program.hpp"
#include "render/light_output.hpp"
#include "tests/support/cloud_messages.hpp"
#include "tests/support/gl_context.hpp"
#include "tests/support/node_process.hpp"
#include "tests/support/projected_cloud.hpp"
#include "tests/support/ros_graph.hpp"

namespace afterglow::nodes::projector_node_ros_test {
namespace {

using test::eventually;

const std::string kProgram = AFTERGLOW_TEST_PROJECTOR_NODE;

std::string configText(const std::string& projector_frame) {
  return "fixed_frame: map\n"
         "projector: {camera_info: projector.yaml, frame: " +
         projector_frame +
         "}\n"
         "layers:\n"
         "  - {topic: /cloud, type: sensor_msgs/PointCloud2, style: points, size: 3}\n"
         "  - {topic: /marker, type: visualization_msgs/Marker}\n";
}

/// A running projector_node; ended, if it still runs, with the test.
class Node : public test::NodeProcess {
 public:
  Node(const std::string& name, const std::string& config, const test::ProjectedCloud& cloud,
       const std::vector<std::string>& options = {})
      : NodeProcess(arguments({kProgram, "__name:=" + name, "_config:=" + config,
                               "_calibration:=" + cloud.calibration(), "_window:=false"},
                              options)) {}

 private:
  static std::vector<std::string> arguments(std::vector<std::string> all,
                                            const std::vector<std::string>& options) {
    all.insert(all.end(), options.begin(), options.end());
    return all;
  }
};

/// The same points again and again, of one color: more than any machine draws 240 times a second.
sensor_msgs::PointCloud2 manyPoints(const test::ProjectedCloud& cloud, std::uint32_t rgb) {
  constexpr std::size_t kMany = 600'000;
  std::vector<Eigen::Vector3f> points;
  while (points.size() < kMany) points.push_back(cloud.points[points.size() % cloud.points.size()]);
  sensor_msgs::PointCloud2 message = test::cloudMessage("base_link", points, 16);
  for (std::size_t i = 0; i < points.size(); ++i) {
    std::memcpy(message.data.data() + 16 * i + 12, &rgb, 4);
  }
  sensor_msgs::PointField field;
  field.name = "rgb";
  field.offset = 12;
  field.datatype = sensor_msgs::PointField::FLOAT32;
  field.count = 1;
  message.fields.push_back(field);
  return message;
}

/// Of a channel: r, g, b are 0, 1, 2.
std::uint8_t brightest(const render::Image& image, std::size_t channel) {
  std::uint8_t most = 0;
  for (std::size_t i = channel; i < image.rgb.size(); i += 3) most = std::max(most, image.rgb[i]);
  return most;
}

/// Listens to one node.
class Audience {
 public:
  explicit Audience(const std::string& node) {
    image_ = nh_.subscribe<sensor_msgs::Image>("/" + node + "/image", 1,
                                               [this](const sensor_msgs::ImageConstPtr& message) {
                                                 const std::lock_guard<std::mutex> lock(mutex_);
                                                 newest_ = message;
                                                 ++images_;
                                               });
    info_ = nh_.subscribe<sensor_msgs::CameraInfo>(
        "/" + node + "/camera_info", 1, [this](const sensor_msgs::CameraInfoConstPtr& message) {
          const std::lock_guard<std::mutex> lock(mutex_);
          camera_info_ = message;
        });
    diagnostics_ = nh_.subscribe<diagnostic_msgs::DiagnosticArray>(
        "/diagnostics", 10, [this](const diagnostic_msgs::DiagnosticArrayConstPtr& message) {
          const std::lock_guard<std::mutex> lock(mutex_);
          for (const auto& status : message->status) {
            std::ostringstream text;
            text << int{status.level} << " " << status.message;
            for (const auto& value : status.values)
              text << " | " << value.key << "=" << value.value;
            statuses_[status.name] = text.str();
          }
        });
  }

  render::Image image() {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!newest_) return {};
    return {static_cast<int>(newest_->width), static_cast<int>(newest_->height), newest_->data};
  }
  std::uint64_t images() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return images_;
  }
  sensor_msgs::ImageConstPtr message() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return newest_;
  }
  sensor_msgs::CameraInfoConstPtr cameraInfo() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return camera_info_;
  }
  std::string status(const std::string& name) {
    const std::lock_guard<std::mutex> lock(mutex_);
    return statuses_[name];
  }
  bool isSaid(const std::string& name, const std::string& text) {
    return eventually([&] { return status(name).find(text) != std::string::npos; });
  }
  /// All is well, but that a slow machine may take longer for a picture than it has.
  bool isProjecting(const std::string& name) {
    return eventually([&] {
      const std::string said = status(name);
      return said.find("0 projecting") != std::string::npos ||
             said.find("1 projecting; drawing takes") != std::string::npos;
    });
  }

 private:
  std::mutex mutex_;
  sensor_msgs::ImageConstPtr newest_;
  sensor_msgs::CameraInfoConstPtr camera_info_;
  std::uint64_t images_ = 0;
  std::map<std::string, std::string> statuses_;
  ros::NodeHandle nh_;
  ros::Subscriber image_, info_, diagnostics_;
};

class ProjectorNodeTest : public test::RosGraph<test::GlTest>,
                          public testing::WithParamInterface<test::Source> {
 protected:
  std::string writeConfig(const std::string& text) {
    const std::string path = folder_.path("config.yaml");
    std::ofstream(path) << text;
    return path;
  }
  /// Latched, as tf2_ros sends them.
  static ros::Publisher publishTransforms(const test::ProjectedCloud& cloud) {
    auto publisher = nh_->advertise<tf2_msgs::TFMessage>("/tf_static", 1, true);
    tf2_msgs::TFMessage message;
    message.transforms = cloud.transforms();
    publisher.publish(message);
    return publisher;
  }

  test::TempFolder folder_;
};

TEST_P(ProjectorNodeTest, lightsThePixelsThatOpenCvNames) {
  const test::ProjectedCloud cloud(GetParam());
  const ros::Publisher transforms = publishTransforms(cloud);
  auto clouds = nh_->advertise<sensor_msgs::PointCloud2>("/cloud", 1, true);
  clouds.publish(test::cloudMessage("base_link", cloud.points, 32));
  Audience audience("lit");
  Node node("lit", writeConfig(configText("projector_optical_frame")), cloud);
  ASSERT_TRUE(eventually([&] { return test::litPixels(audience.image()) > 0; }))
      << audience.status("lit: projector");
  cloud.expectLit(audience.image());

  const auto message = audience.message();
  EXPECT_EQ(message->encoding, "rgb8");
  EXPECT_EQ(message->header.frame_id, "projector_optical_frame");
  EXPECT_LT(std::abs((ros::Time::now() - message->header.stamp).toSec()), 5);
  ASSERT_TRUE(eventually([&] { return audience.cameraInfo() != nullptr; }));
  EXPECT_EQ(audience.cameraInfo()->K[5], 817);  // K's, which is meant, and not P's
  EXPECT_TRUE(audience.isProjecting("lit: projector"));
  EXPECT_TRUE(audience.isSaid("lit: projector", "time: published=p50 "));

  clouds.publish(sensor_msgs::PointCloud2());  // empty: clears
  EXPECT_TRUE(eventually([&] { return test::litPixels(audience.image()) == 0; }));

  clouds.publish(test::cloudMessage("base_link", cloud.points));
  ASSERT_TRUE(eventually([&] { return test::litPixels(audience.image()) > 0; }));
  node.interrupt();
  EXPECT_EQ(node.exitStatus(), 0);
  EXPECT_TRUE(eventually([&] { return test::litPixels(audience.image()) == 0; }))
      << "the last picture is not black";
}

TEST_P(ProjectorNodeTest, saysWhichFramesAndMessagesItLacks) {
  const test::ProjectedCloud cloud(GetParam());
  const ros::Publisher transforms = publishTransforms(cloud);
  auto clouds = nh_->advertise<sensor_msgs::PointCloud2>("/cloud", 1, true);
  auto message = test::cloudMessage("base_link", cloud.points);
  message.data.pop_back();
  clouds.publish(message);
  auto markers = nh_->advertise<visualization_msgs::Marker>("/marker", 1, true);
  visualization_msgs::Marker marker;
  marker.header.frame_id = "no_such_frame";
  marker.scale.x = marker.scale.y = marker.scale.z = marker.color.a = 1;
  markers.publish(marker);
  Audience audience("lacking");
  Node node("lacking", writeConfig(configText("projector_optical_frame")), cloud);
  EXPECT_TRUE(audience.isSaid("lacking: /marker", "no transform from 'no_such_frame' to 'map'"));
  EXPECT_TRUE(audience.isSaid("lacking: /cloud", "dropped: data is shorter than declared=1"));
  EXPECT_TRUE(audience.isSaid("lacking: projector",
                              "/marker: no transform from 'no_such_frame' to 'map'"));
  EXPECT_EQ(test::litPixels(audience.image()), 0);
}

TEST_P(ProjectorNodeTest, staysDarkWhileItsOwnPlaceIsUnknown) {
  const test::ProjectedCloud cloud(GetParam());
  const ros::Publisher transforms = publishTransforms(cloud);
  auto clouds = nh_->advertise<sensor_msgs::PointCloud2>("/cloud", 1, true);
  clouds.publish(test::cloudMessage("base_link", cloud.points));
  Audience audience("lost");
  Node node("lost", writeConfig(configText("no_such_frame")), cloud);
  EXPECT_TRUE(audience.isSaid("lost: /cloud", "1 shown"));
  EXPECT_TRUE(audience.isSaid("lost: projector",
                              "2 projector: no transform from 'no_such_frame' to 'map'"));
  const std::uint64_t before = audience.images();
  ASSERT_TRUE(eventually([&] { return audience.images() > before; }));
  EXPECT_EQ(test::litPixels(audience.image()), 0);
}

TEST_P(ProjectorNodeTest, servesSeveralProjectorsFromOneScene) {
  const test::ProjectedCloud cloud(GetParam());
  const ros::Publisher transforms = publishTransforms(cloud);
  auto clouds = nh_->advertise<sensor_msgs::PointCloud2>("/cloud", 1, true);
  clouds.publish(test::cloudMessage("base_link", cloud.points));
  const std::string lens = "{camera_info: projector.yaml, frame: ";
  Audience left("pair/left"), right("pair/right"), whole("pair");
  Node node("pair", writeConfig("fixed_frame: map\n"
                                "projectors:\n"
                                "  left: " +
                                lens +
                                "projector_optical_frame}\n"
                                "  right: " +
                                lens +
                                "projector_optical_frame, mirror: horizontal,"
                                " max_brightness: 0.5}\n"
                                "  lost: " +
                                lens +
                                "no_such_frame}\n"
                                "layers:\n"
                                "  - {topic: /cloud, type: sensor_msgs/PointCloud2, style: points,"
                                " size: 3}\n"),
            cloud);
  ASSERT_TRUE(eventually(
      [&] { return test::litPixels(left.image()) > 0 && test::litPixels(right.image()) > 0; }));
  cloud.expectLit(left.image());
  render::Image image = right.image();
  EXPECT_EQ(*std::max_element(image.rgb.begin(), image.rgb.end()), 188);  // half of white's light
  render::LightSettings mirror;
  mirror.mirror = render::Mirror::Horizontal;
  render::LightOutput(mirror).apply(image);
  cloud.expectLit(image);
  ASSERT_TRUE(eventually([&] { return left.cameraInfo() && right.cameraInfo(); }));
  // The mirrored picture's lens: x' = 1279 - x.
  EXPECT_EQ(right.cameraInfo()->K[0], -left.cameraInfo()->K[0]);
  EXPECT_EQ(right.cameraInfo()->K[2], 1279 - left.cameraInfo()->K[2]);
  EXPECT_EQ(right.cameraInfo()->K[4], left.cameraInfo()->K[4]);
  EXPECT_TRUE(whole.isProjecting("pair: projector left"));
  EXPECT_TRUE(whole.isSaid("pair: projector lost",
                           "2 projector: no transform from 'no_such_frame' to 'map'"));
  EXPECT_EQ(whole.images(), 0u);
}

TEST_P(ProjectorNodeTest, sharesTheLightOfSeveralProjectorsWhereTheyMeet) {
  const test::ProjectedCloud cloud(GetParam());
  const ros::Publisher transforms = publishTransforms(cloud);
  auto clouds = nh_->advertise<sensor_msgs::PointCloud2>("/cloud", 1, true);
  clouds.publish(test::cloudMessage("base_link", cloud.points));
  const std::string lens = "{camera_info: projector.yaml, frame: ";
  Audience left("shared/left"), right("shared/right"), whole("shared");
  Node node("shared",
            writeConfig("fixed_frame: map\n"
                        "projectors:\n"
                        "  left: " +
                        lens +
                        "projector_optical_frame}\n"
                        "  right: " +
                        lens +
                        "projector_optical_frame, gamma: 2}\n"
                        "  lost: " +
                        lens +
                        "no_such_frame}\n"
                        "blend: true\n"
                        "surfaces: {floor: {frame: base_link}}\n"
                        "layers:\n"
                        "  - {topic: /cloud, type: sensor_msgs/PointCloud2, style: points,"
                        " size: 3}\n"),
            cloud);
  ASSERT_TRUE(eventually(
      [&] { return test::litPixels(left.image()) > 0 && test::litPixels(right.image()) > 0; }));
  EXPECT_EQ(brightest(left.image(), 0), 188);   // half of white's light
  EXPECT_EQ(brightest(right.image(), 0), 180);  // the same by the power of 2
  cloud.expectLit(left.image());
  EXPECT_TRUE(whole.isSaid("shared: projector left", "blending=100 % of its picture is shared"));
  EXPECT_TRUE(whole.isSaid("shared: projector left", "time: blended=p50 "));
  EXPECT_TRUE(whole.isSaid("shared: projector lost", "blending=dark: others give its light"));
}

TEST_P(ProjectorNodeTest, showsTheNewestWholeAndTellsOfItWhereThereIsMoreToDrawThanTime) {
  const test::ProjectedCloud cloud(GetParam());
  const ros::Publisher transforms = publishTransforms(cloud);
  const sensor_msgs::PointCloud2 red = manyPoints(cloud, 0xff0000), blue = manyPoints(cloud, 0xff);
  Audience audience("busy");
  Node node("busy", writeConfig(configText("projector_optical_frame") +
                                "  - {topic: /crowd, type: sensor_msgs/PointCloud2,"
                                " style: points, size: 3, color: rgb8}\n"),
            cloud, {"_rate:=240"});
  auto clouds = nh_->advertise<sensor_msgs::PointCloud2>("/crowd", 1);
  ASSERT_TRUE(eventually([&] { return clouds.getNumSubscribers() > 0; })) << node.log();

  // Twice as many clouds as it draws.
  bool was_red = false, was_blue = false;
  for (int shown = 0; shown < 60; ++shown) {
    clouds.publish(red);
    clouds.publish(blue);
    if (shown % 2 == 0) clouds.publish(red);
    const std::uint64_t before = audience.images();
    ASSERT_TRUE(eventually([&] { return audience.images() > before; })) << node.log();
    const render::Image image = audience.image();
    const bool is_red = brightest(image, 0) > 0, is_blue = brightest(image, 2) > 0;
    EXPECT_FALSE(is_red && is_blue) << "torn: of two clouds, picture " << shown;
    was_red = was_red || is_red;
    was_blue = was_blue || is_blue;
  }
  EXPECT_TRUE(was_red && was_blue);
  EXPECT_TRUE(audience.isSaid("busy: projector", "1 projecting; drawing takes "));
  EXPECT_TRUE(audience.isSaid("busy: projector", " of 240 images a second"));

  clouds.publish(red);
  clouds.publish(sensor_msgs::PointCloud2());  // clears
  const std::uint64_t before = audience.images();
  ASSERT_TRUE(eventually([&] { return test::litPixels(audience.image()) == 0; }));
  EXPECT_LT(audience.images() - before, 12u) << "clouds had waited to be drawn";
}

TEST_P(ProjectorNodeTest, refusesInOneLine) {
  const auto run = [](const std::vector<std::string>& arguments) {
    std::vector<std::string> all = {kProgram, "__name:=refusing"};
    all.insert(all.end(), arguments.begin(), arguments.end());
    return runProgram(all);
  };
  const std::string typo = writeConfig("fixed_frame: map\nprojektor: {}\n");
  ProgramResult result = run({"_config:=" + typo});
  EXPECT_EQ(result.status, 1);
  EXPECT_EQ(result.output, "projector_node: " + typo +
                               ":2: unknown key 'projektor' in the configuration; did you mean "
                               "'projector'?\n");
  result = run({"_config:="});
  EXPECT_EQ(result.output,
            "projector_node: parameter ~config is missing: the path of the configuration\n");
  const std::string good = writeConfig(configText("projector_optical_frame"));
  result = run({"_config:=" + good, "_calibration:=" + folder_.path("nowhere")});
  EXPECT_EQ(result.status, 1);
  EXPECT_NE(result.output.find("nowhere/projector.yaml"), std::string::npos)
      << result.output;
  const test::ProjectedCloud cloud(GetParam());
  result = run({"_config:=" + good, "_calibration:=" + cloud.calibration(), "_window:=true",
                "__name:=windowless"});
  if (std::getenv("DISPLAY") == nullptr) {
    EXPECT_EQ(result.status, 1);
    EXPECT_NE(result.output.find("no display: DISPLAY is not set"), std::string::npos)
        << result.output;
  }
}

INSTANTIATE_TEST_SUITE_P(On, ProjectorNodeTest, test::sources(), test::sourceName);

}  // namespace
}  // namespace afterglow::nodes::projector_node_ros_test
