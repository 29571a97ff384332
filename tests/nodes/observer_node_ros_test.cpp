#include <gtest/gtest.h>
#include <ros/ros.h>
#include <rosgraph_msgs/Clock.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <std_msgs/String.h>
#include <std_srvs/Trigger.h>
#include <tf2_ros/static_transform_broadcaster.h>
#include <visualization_msgs/MarkerArray.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <opencv2/imgcodecs.hpp>
#include <string>

#include "calib/lens.hpp"
#include "nodes/conversion/camera_messages.hpp"
#include "nodes/observer/room_view.hpp"
#include "nodes/tools/program.hpp"
#include "tests/support/gl_context.hpp"
#include "tests/support/image_measures.hpp"
#include "tests/support/node_process.hpp"
#include "tests/support/ros_master.hpp"

namespace afterglow::nodes::observer_node_ros_test {
namespace {

using test::eventually;

const std::string kProgram = AFTERGLOW_TEST_OBSERVER_NODE;
constexpr const char* kView =
    "fixed_frame: map\n"
    "eye: [0.3, -2.2, 1.6]\n"
    "target: [0.2, 0, 0]\n"
    "vertical_fov: 50\n"
    "size: [320, 240]\n"
    "others: {near: {eye: [0.3, -1.2, 0.9], target: [0.3, 0.1, 0], vertical_fov: 50}}\n"
    "floor: {center: [0, 0], size: [6, 6], color: \"#ffffff\", tile: 6, joint_color: \"#ffffff\"}\n"
    "walls: []\n";
/// The lens looks straight down from 2 m; the one lit square's center and where that lies.
const Eigen::Vector2d kLitPixel(420, 200);
const Eigen::Vector3d kLitPoint(2.0 * (420 - 320) / 600, -2.0 * (200 - 240) / 600, 0);

calib::Lens lens() {
  Eigen::Matrix3d K;
  K << 600, 0, 320, 0, 600, 240, 0, 0, 1;
  return calib::makeLens(640, 480, K, {});
}

render::Image litSquare() {
  render::Image image{640, 480, std::vector<std::uint8_t>(640 * 480 * 3)};
  for (int v = 190; v <= 210; ++v) {
    for (int u = 410; u <= 430; ++u) {
      std::fill_n(image.rgb.begin() + 3 * (640 * v + u), 3, std::uint8_t{255});
    }
  }
  return image;
}

Eigen::Vector2d pixelOf(const Eigen::Vector3d& p_world, const Look& look) {
  const render::ObserverView view = viewFrom(look, 320, 240);
  const Eigen::Vector3d p = view.T_world_observer.inverse() * p_world;
  const double focal = view.height / 2.0 / std::tan(view.vertical_fov / 2);
  return {159.5 + focal * p.x() / p.z(), 119.5 + focal * p.y() / p.z()};
}

/// Center of what is nearly white; empty if nothing is.
std::optional<Eigen::Vector2d> centerOfLight(const render::Image& image) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  int count = 0;
  for (int v = 0; v < image.height; ++v) {
    for (int u = 0; u < image.width; ++u) {
      if (test::brightness(image, u, v) < 550) continue;
      sum += Eigen::Vector2d(u, v);
      ++count;
    }
  }
  if (count == 0) return std::nullopt;
  return Eigen::Vector2d(sum / count);
}

render::Image readPng(const std::string& path) {
  const cv::Mat bgr = cv::imread(path);
  render::Image image{bgr.cols, bgr.rows, {}};
  for (int v = 0; v < bgr.rows; ++v) {
    for (int u = 0; u < bgr.cols; ++u) {
      const auto& pixel = bgr.at<cv::Vec3b>(v, u);
      image.rgb.insert(image.rgb.end(), {pixel[2], pixel[1], pixel[0]});
    }
  }
  return image;
}

/// A running program; ended, if it still runs, with the test.
class Running : public test::NodeProcess {
 public:
  explicit Running(std::vector<std::string> arguments)
      : NodeProcess(behindProgram(std::move(arguments))) {}

 private:
  static std::vector<std::string> behindProgram(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), kProgram);
    return arguments;
  }
};

/// Projector, room and a spectator of observer_node's pictures.
class Room {
 public:
  Room() {
    geometry_msgs::TransformStamped down;
    down.header.frame_id = "map";
    down.header.stamp = ros::Time::now();
    down.child_frame_id = "projector_optical_frame";
    down.transform.translation.z = 2;
    down.transform.rotation.x = 1;  // half a turn about x
    static_tf_.sendTransform(down);
    visualization_msgs::MarkerArray solids;
    solids.markers.emplace_back();
    solids.markers[0].header.frame_id = "map";
    solids.markers[0].type = visualization_msgs::Marker::CUBE;
    solids.markers[0].pose.position.x = -1;
    solids.markers[0].scale.x = solids.markers[0].scale.y = solids.markers[0].scale.z = 0.2;
    solids.markers[0].color.a = 1;
    solids_.publish(solids);
    timer_ = node_.createSteadyTimer(ros::WallDuration(0.05),
                                     [this](const ros::SteadyTimerEvent&) { project(); });
  }

  void turnOff() { on_ = false; }
  render::Image seen() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return seen_;
  }
  void say(const std::string& topic, const std::string& text) {
    ros::Publisher& publisher = publishers_[topic];
    if (!publisher) publisher = node_.advertise<std_msgs::String>("/observer_node/" + topic, 10);
    ASSERT_TRUE(eventually([&] { return publisher.getNumSubscribers() > 0; }));
    std_msgs::String message;
    message.data = text;
    publisher.publish(message);
  }
  /// Whether the light is seen within a pixel and a half of there.
  bool isLitAt(const Eigen::Vector2d& pixel) {
    return eventually([&] {
      const auto center = centerOfLight(seen());
      return center && (*center - pixel).norm() < 1.5;
    });
  }

 private:
  void project() {
    if (!on_) return;
    sensor_msgs::Image image = toImage(litSquare());
    image.header.stamp = ros::Time::now();
    image.header.frame_id = "projector_optical_frame";
    sensor_msgs::CameraInfo info = toCameraInfo(lens());
    info.header = image.header;
    camera_info_.publish(info);
    image_.publish(image);
  }
  void onPicture(const sensor_msgs::Image& image) {
    const std::lock_guard<std::mutex> lock(mutex_);
    seen_ = {static_cast<int>(image.width), static_cast<int>(image.height), image.data};
  }

  ros::NodeHandle node_;
  std::atomic<bool> on_{true};
  std::mutex mutex_;
  render::Image seen_;
  tf2_ros::StaticTransformBroadcaster static_tf_;
  ros::Publisher solids_ =
      node_.advertise<visualization_msgs::MarkerArray>("/room/solids", 1, true);
  ros::Publisher image_ = node_.advertise<sensor_msgs::Image>("/projector/image", 1);
  ros::Publisher camera_info_ =
      node_.advertise<sensor_msgs::CameraInfo>("/projector/camera_info", 1);
  ros::Subscriber picture_ = node_.subscribe("/observer_node/image", 1, &Room::onPicture, this);
  std::map<std::string, ros::Publisher> publishers_;
  ros::SteadyTimer timer_;
};

struct ObserverNodeTest : test::GlTest {
  test::TempFolder folder;
  const std::string view = folder.path("view.yaml"), video = folder.path("film.mp4");

  void SetUp() override {
    test::GlTest::SetUp();
    std::ofstream(view) << kView;
  }
  std::vector<std::string> arguments() const {
    return {"__name:=observer_node",
            "_view:=" + view,
            "_video:=" + video,
            "_inset:=false",
            "_folder:=" + folder.path("pictures"),
            "_fps:=10"};
  }
};

TEST_F(ObserverNodeTest, showsTheLightWhereTheGeometrySays) {
  Room room;
  Running observer({"__name:=observer_node", "_view:=" + view, "_inset:=false"});
  const RoomView configured = loadRoomView(view);
  ASSERT_TRUE(room.isLitAt(pixelOf(kLitPoint, configured.look)));
  room.say("look", "near");
  EXPECT_TRUE(room.isLitAt(pixelOf(kLitPoint, configured.others.at("near"))));
}

// While it films, a busy machine's live picture lags behind: it is of the image drawn last.
TEST_F(ObserverNodeTest, filmsInRosTime) {
  if (!hasProgram("ffmpeg")) GTEST_SKIP() << "ffmpeg is not installed";
  const ros::Time begin = ros::Time::now();
  Room room;
  Running observer(arguments());
  const RoomView configured = loadRoomView(view);
  ASSERT_TRUE(room.isLitAt(pixelOf(kLitPoint, configured.look)));
  room.say("key_frame", "lit");
  const std::string pictures = folder.path("pictures");
  ASSERT_TRUE(eventually([&] { return std::filesystem::exists(pictures + "/lit_projector.png"); }));
  room.turnOff();
  const ros::Time off = ros::Time::now();
  ASSERT_TRUE(eventually([&] { return (ros::Time::now() - off).toSec() > 2.5; }));

  std_srvs::Trigger finish;  // waits for the images that are still to be drawn
  ASSERT_TRUE(ros::service::call("/observer_node/finish", finish));
  EXPECT_TRUE(finish.response.success) << finish.response.message;
  EXPECT_TRUE(eventually([&] { return !centerOfLight(room.seen()); })) << "dark after two seconds";
  const double filmed = std::stod(runProgram({"ffprobe", "-v", "error", "-show_entries",
                                              "format=duration", "-of", "csv=p=0", video})
                                      .output);
  EXPECT_GT(filmed, 2) << "it was dark for so long";
  EXPECT_LE(filmed, (ros::Time::now() - begin).toSec() + 0.11);
  ASSERT_TRUE(ros::service::call("/observer_node/finish", finish));
  EXPECT_EQ(finish.response.message, "there is no film");
  observer.interrupt();
  EXPECT_EQ(observer.exitStatus(), 0);
  const auto center = centerOfLight(readPng(pictures + "/lit.png"));
  ASSERT_TRUE(center);
  EXPECT_LT((*center - pixelOf(kLitPoint, configured.look)).norm(), 1.5);
  EXPECT_EQ(readPng(pictures + "/lit_projector.png").rgb, litSquare().rgb);
}

TEST_F(ObserverNodeTest, filmsQuestionsThatAreHeardAndRefusesAFilmOfOneThatIsNot) {
  if (!hasProgram("ffmpeg")) GTEST_SKIP() << "ffmpeg is not installed";
  const std::string speech = folder.path("speech.json");
  std::ofstream(speech) << "[]";
  for (const char* voice : {"en-gb+f3", "xx-nobody"}) {
    Room room;
    std::vector<std::string> with = arguments();
    with.insert(with.end(), {"_speech:=" + speech, std::string("_human_voice:=") + voice});
    Running observer(with);
    ASSERT_TRUE(eventually([&] { return !room.seen().rgb.empty(); })) << observer.log();
    room.say("key_frame", "begun");  // heard in order: the film has begun
    const std::string picture = folder.path("pictures") + "/begun.png";
    ASSERT_TRUE(eventually([&] { return std::filesystem::exists(picture); }));
    room.say("asked", "Why did you not go straight?");
    ASSERT_TRUE(eventually([&] {
      return observer.log().find("not heard") != std::string::npos ||
             std::filesystem::exists(folder.path("asked/utterance_0001.wav"));
    }));
    const ros::Time asked = ros::Time::now();
    ASSERT_TRUE(eventually([&] { return (ros::Time::now() - asked).toSec() > 1.5; }));
    std_srvs::Trigger finish;
    ASSERT_TRUE(ros::service::call("/observer_node/finish", finish));
    if (voice == std::string("xx-nobody")) {
      EXPECT_FALSE(finish.response.success);
      EXPECT_EQ(finish.response.message,
                "\"Why did you not go straight?\" is shown but not heard: no voice \"xx-nobody\" "
                "(espeak-ng --voices lists those there are)");
      continue;
    }
    EXPECT_TRUE(finish.response.success) << finish.response.message;
    const std::string levels = runProgram({"ffmpeg", "-hide_banner", "-nostdin", "-i", video, "-vn",
                                           "-af", "volumedetect", "-f", "null", "-"})
                                   .output;
    const std::string key = "max_volume: ";
    ASSERT_NE(levels.find(key), std::string::npos) << levels;
    EXPECT_GT(std::stod(levels.substr(levels.find(key) + key.size())), -20) << "dB";
    std::filesystem::remove_all(folder.path("asked"));
    std::filesystem::remove(picture);
  }
}

TEST_F(ObserverNodeTest, captionsItsPictures) {
  Room room;
  Running observer({"__name:=observer_node", "_view:=" + view, "_inset:=false"});
  ASSERT_TRUE(eventually([&] { return !room.seen().rgb.empty(); }));
  const auto has_letters = [&] {
    const render::Image seen = room.seen();
    for (int v = 240; v < seen.height; ++v) {
      for (int u = 0; u < seen.width; ++u) {
        if (test::brightness(seen, u, v) > 600) return true;
      }
    }
    return false;
  };
  EXPECT_FALSE(has_letters());
  room.say("caption", "replay|What did you do?");
  EXPECT_TRUE(eventually(has_letters));
}

TEST_F(ObserverNodeTest, refusesWhatItCannotObey) {
  const auto refusal = [&](std::vector<std::string> with) {
    with.insert(with.begin(), kProgram);
    const ProgramResult result = runProgram(with);
    EXPECT_EQ(result.status, 1);
    return result.output;
  };
  EXPECT_EQ(refusal({"__name:=a"}),
            "observer_node: ~view is missing: the YAML file of the bystander's view\n");
  EXPECT_EQ(refusal({"__name:=b", "_view:=" + view, "_fps:=0"}),
            "observer_node: ~fps is 0; 1 to 120 can be drawn\n");
  EXPECT_EQ(refusal({"__name:=c", "_view:=" + folder.path("none.yaml")}),
            "observer_node: " + folder.path("none.yaml") + ": cannot be read\n");
  EXPECT_EQ(refusal({"__name:=d", "_view:=" + view, "_font:=/no/font"}),
            "observer_node: /no/font: cannot read the font (package fonts-dejavu-core)\n");
}

TEST_F(ObserverNodeTest, finishesItsFilmWhereTheClockStands) {
  if (!hasProgram("ffmpeg")) GTEST_SKIP() << "ffmpeg is not installed";
  struct SimulatedTime {
    SimulatedTime() { ros::param::set("/use_sim_time", true); }
    ~SimulatedTime() { ros::param::del("/use_sim_time"); }
  } simulated;
  ros::NodeHandle node;
  ros::Publisher publisher = node.advertise<rosgraph_msgs::Clock>("/clock", 1, true);
  rosgraph_msgs::Clock clock;
  clock.clock = ros::Time(100);
  publisher.publish(clock);
  Running observer(arguments());
  ASSERT_TRUE(ros::service::waitForService("/observer_node/finish", ros::Duration(20)));
  std_srvs::Trigger finish;
  ASSERT_TRUE(ros::service::call("/observer_node/finish", finish));
  EXPECT_NE(finish.response.message, "") << "nothing was filmed";
}

}  // namespace
}  // namespace afterglow::nodes::observer_node_ros_test

int main(int argc, char** argv) {
  ::testing::InitGoogleTest(&argc, argv);
  const afterglow::test::RosMaster master;
  ros::init(argc, argv, "observer_test", ros::init_options::NoSigintHandler);
  ros::NodeHandle node;
  ros::AsyncSpinner spinner(2);
  spinner.start();
  return RUN_ALL_TESTS();
}
