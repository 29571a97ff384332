// Polygons, poses, cells, ranges, maps and images: what their fields become, and what is refused.
#include <gtest/gtest.h>
#include <rosbag/bag.h>
#include <sensor_msgs/image_encodings.h>

#include <cmath>
#include <limits>

#include "nodes/conversion/camera_messages.hpp"
#include "nodes/conversion/path_conversion.hpp"
#include "nodes/projector/recorded_scene.hpp"
#include "replay/bags/bag_file.hpp"
#include "replay/store/open/open_store.hpp"
#include "tests/support/optics.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::nodes::floor_layers_test {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();
const render::Color kRed{1, 0, 0, 1};

Eigen::AlignedBox3f boundsOf(const render::Drawable& drawable) {
  Eigen::AlignedBox3f box;
  for (const Eigen::Vector3f& p : std::get<render::MeshInstance>(drawable.shape).body->points) {
    box.extend((drawable.pose.matrix() * p.cast<double>()).cast<float>());
  }
  return box;
}

const render::Body& bodyOf(const Converted<Drawables>& drawn) {
  return *std::get<render::MeshInstance>(drawn.value->at(0).shape).body;
}

geometry_msgs::Pose at(double x, double y) {
  geometry_msgs::Pose pose;
  pose.position.x = x;
  pose.position.y = y;
  pose.orientation.w = 1;
  return pose;
}

// ---------------------------------------------------------------------------------------- polygons
geometry_msgs::Polygon polygon(const std::vector<Eigen::Vector3f>& points) {
  geometry_msgs::Polygon message;
  for (const Eigen::Vector3f& p : points) {
    geometry_msgs::Point32 point;
    point.x = p.x();
    point.y = p.y();
    point.z = p.z();
    message.points.push_back(point);
  }
  return message;
}
const std::vector<Eigen::Vector3f> kCorner = {{0, 0, 1}, {2, 0, 1}, {2, 1, 1},
                                              {1, 1, 1}, {1, 2, 1}, {0, 2, 1}};

TEST(Polygon, isAClosedLineOrAFaceOfItsArea) {
  const auto line = toPolygonShapes(polygon(kCorner), {}, false, kRed);
  const auto& lines = std::get<render::Lines>(line.value->at(0).shape);
  EXPECT_EQ(lines.points.front(), lines.points.back());
  EXPECT_EQ(lines.points.size(), 8u);
  EXPECT_EQ(line.value->at(0).color, kRed);
  const auto face = toPolygonShapes(polygon(kCorner), {}, true, kRed);
  const render::Body& body = bodyOf(face);
  EXPECT_EQ(body.points.size(), 6u);
  double area = 0;
  for (const auto& t : body.triangles) {
    const Eigen::Vector3f &a = body.points[t[0]], &b = body.points[t[1]], &c = body.points[t[2]];
    area += double{(b - a).cross(c - a).norm()} / 2;
  }
  EXPECT_NEAR(area, 3, 1e-6);
}

TEST(Polygon, clearsWithoutPointsAndIsRefusedWithBadOnes) {
  EXPECT_TRUE(toPolygonShapes({}, {}, true, kRed).value->empty());
  EXPECT_TRUE(toPolygonShapes(polygon({{1, 1, 1}, {1, 1, 1}}), {}, false, kRed).value->empty());
  for (const double bad : {kNan, kInf, 1e30}) {
    EXPECT_EQ(toPolygonShapes(polygon({{0, 0, 0}, {static_cast<float>(bad), 0, 0}, {0, 1, 0}}), {},
                              false, kRed)
                  .reason,
              "a point is not finite or absurdly far");
  }
  EXPECT_EQ(toPolygonShapes(polygon({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}), {}, true, kRed).reason,
            "a polygon without an area");
  std::vector<Eigen::Vector3f> many;
  for (int i = 0; i < 1001; ++i) many.emplace_back(std::cos(i / 200.f), std::sin(i / 200.f), 0);
  EXPECT_EQ(toPolygonShapes(polygon(many), {}, true, kRed).reason,
            "more than 1000 corners to be filled");
  EXPECT_TRUE(toPolygonShapes(polygon(many), {}, false, kRed).value);
}

// ------------------------------------------------------------------------------------------- poses
geometry_msgs::PoseWithCovariance spread(double xx, double yy, double yaw) {
  geometry_msgs::PoseWithCovariance message;
  message.pose = at(1, 2);
  message.covariance[0] = xx;
  message.covariance[7] = yy;
  message.covariance[35] = yaw;
  return message;
}

TEST(PoseSpread, isAnEllipseOfOneDeviationAndATriangleOfTheYaws) {
  PathStyle style;
  style.poses = PathStyle::Poses::Arrows;
  CovarianceStyle look;
  look.position_scale = 3;
  const auto drawn = toPoseShapes(spread(0.04, 0.01, 0.25), style, look);
  ASSERT_EQ(drawn.value->size(), 3u);
  const render::Drawable& ellipse = drawn.value->at(1);
  const Eigen::Vector3f size = std::get<render::Sphere>(ellipse.shape).size;
  const Eigen::Vector3d long_axis = ellipse.pose.matrix().linear().col(
      size.x() > size.y() ? (size.x() > size.z() ? 0 : 2) : (size.y() > size.z() ? 1 : 2));
  EXPECT_NEAR(size.maxCoeff(), 1.2, 1e-6);
  EXPECT_NEAR(std::abs(long_axis.x()), 1, 1e-6);
  EXPECT_NEAR(size.minCoeff(), 1e-3, 1e-9);  // flat: nothing is said of z, roll and pitch
  EXPECT_EQ(ellipse.pose.matrix().translation(), Eigen::Vector3d(1, 2, 0));
  const auto& triangle = std::get<render::Triangles>(drawn.value->at(2).shape);
  EXPECT_NEAR(triangle.points[2].y(), std::tan(0.5), 1e-6);
  EXPECT_EQ(triangle.points[2].x(), 1);
}

TEST(PoseSpread, isLeftOutWhereItIsNothingOrAbsurd) {
  PathStyle style;
  style.poses = PathStyle::Poses::Axes;
  EXPECT_EQ(toPoseShapes(spread(0, 0, 0), style, {}).value->size(), 1u);
  EXPECT_EQ(toPoseShapes(spread(-1, -1, -1), style, {}).value->size(), 1u);
  const auto absurd = toPoseShapes(spread(1e20, 1, 0), style, {});
  EXPECT_EQ(absurd.value->size(), 1u);
  EXPECT_EQ(absurd.reason, "a covariance is absurdly large: its ellipse is left out");
  for (const double bad : {kNan, kInf}) {
    EXPECT_EQ(toPoseShapes(spread(1, bad, 1), style, {}).reason, "a covariance is not finite");
  }
  CovarianceStyle none;
  none.has_position = none.has_orientation = false;
  EXPECT_EQ(toPoseShapes(spread(1, 1, 1), style, none).value->size(), 1u);
}

TEST(Poses, leaveOutBadOnesAndAreRefusedWhereAllAre) {
  PathStyle style;
  style.poses = PathStyle::Poses::FlatArrows;
  const auto drawn = toPoseShapes({at(0, 0), at(kNan, 0)}, style);
  const auto& lines = std::get<render::Lines>(drawn.value->at(0).shape);
  EXPECT_EQ(lines.points.size(), 6u);
  EXPECT_FALSE(lines.strip);
  EXPECT_EQ(lines.points[1], Eigen::Vector3f(0.3f, 0, 0));
  EXPECT_EQ(drawn.reason, "a pose's position is not finite or absurdly far");
  EXPECT_EQ(toPoseShapes({at(kNan, 0)}, style).reason,
            "a pose's position is not finite or absurdly far");
  EXPECT_TRUE(toPoseShapes(std::vector<geometry_msgs::Pose>(), style).value->empty());
}

// ------------------------------------------------------------------------------- cells and ranges
TEST(Cells, areRectanglesAroundTheirPlaces) {
  nav_msgs::GridCells cells;
  cells.cell_width = 0.2f;
  cells.cell_height = 0.1f;
  EXPECT_TRUE(toCellShapes(cells, kRed).value->empty());
  cells.cells.resize(2);
  cells.cells[1].x = 1;
  const auto box = boundsOf(toCellShapes(cells, kRed).value->at(0));
  EXPECT_LT((box.min() - Eigen::Vector3f(-0.1f, -0.05f, 0)).norm(), 1e-6f);
  EXPECT_LT((box.max() - Eigen::Vector3f(1.1f, 0.05f, 0)).norm(), 1e-6f);
  for (const float bad : {0.f, -1.f, static_cast<float>(kNan), static_cast<float>(kInf)}) {
    cells.cell_width = bad;
    EXPECT_EQ(toCellShapes(cells, kRed).reason, "cell_width or cell_height is not positive");
  }
  cells.cell_width = 1;
  cells.cells[0].z = kNan;
  EXPECT_EQ(toCellShapes(cells, kRed).reason, "a point is not finite or absurdly far");
  cells.cells.resize(kMostGridCells + 1);
  EXPECT_EQ(toCellShapes(cells, kRed).reason, "more than 524288 cells");
}

sensor_msgs::Range ranger(double range, double least = 0.1, double greatest = 4) {
  sensor_msgs::Range message;
  message.field_of_view = static_cast<float>(M_PI / 2);
  message.min_range = static_cast<float>(least);
  message.max_range = static_cast<float>(greatest);
  message.range = static_cast<float>(range);
  return message;
}

TEST(Range, isAConeAsLongAsItAndAsWideAsItsView) {
  const auto box = boundsOf(toConeShapes(ranger(2), kRed).value->at(0));
  EXPECT_NEAR(box.min().x(), 0, 1e-6);
  EXPECT_NEAR(box.max().x(), 2, 1e-6);
  EXPECT_NEAR(box.max().y(), 2, 0.01);
  EXPECT_NEAR(box.min().z(), -2, 0.01);
}

TEST(Range, isNothingWithoutAReturn) {
  for (const double none : {0.05, 4.5, kNan, kInf, -kInf}) {
    EXPECT_TRUE(toConeShapes(ranger(none), kRed).value->empty()) << none;
  }
  // A ranger of a fixed distance says whether something is within it.
  EXPECT_NEAR(boundsOf(toConeShapes(ranger(-kInf, 1, 1), kRed).value->at(0)).max().x(), 1, 1e-6);
  EXPECT_TRUE(toConeShapes(ranger(kInf, 1, 1), kRed).value->empty());
  auto blind = ranger(1);
  blind.field_of_view = 4;
  EXPECT_EQ(toConeShapes(blind, kRed).reason, "field_of_view is not within 0 and pi");
}

// -------------------------------------------------------------------------------------------- maps
nav_msgs::OccupancyGrid map(std::uint32_t width, std::uint32_t height, std::int8_t value = 0) {
  nav_msgs::OccupancyGrid message;
  message.header.frame_id = "map";
  message.info.width = width;
  message.info.height = height;
  message.info.resolution = 0.5f;
  message.info.origin = at(1, 2);
  message.data.assign(std::size_t{width} * height, value);
  return message;
}

map_msgs::OccupancyGridUpdate updateOf(int x, int y, std::uint32_t width, std::uint32_t height) {
  map_msgs::OccupancyGridUpdate update;
  update.header.frame_id = "map";
  update.x = x;
  update.y = y;
  update.width = width;
  update.height = height;
  update.data.assign(std::size_t{width} * height, 100);
  return update;
}

TEST(Map, hasRVizsColors) {
  using render::Rgba;
  EXPECT_EQ(cellColor(ColorScheme::Map, 0), (Rgba{255, 255, 255, 255}));
  EXPECT_EQ(cellColor(ColorScheme::Map, 100), (Rgba{0, 0, 0, 255}));
  EXPECT_EQ(cellColor(ColorScheme::Map, -1), (Rgba{0x70, 0x89, 0x86, 255}));
  EXPECT_EQ(cellColor(ColorScheme::Map, 101), (Rgba{0, 255, 0, 255}));
  EXPECT_EQ(cellColor(ColorScheme::Map, -128), (Rgba{255, 0, 0, 255}));
  EXPECT_EQ(cellColor(ColorScheme::Map, -2), (Rgba{255, 255, 0, 255}));
  EXPECT_EQ(cellColor(ColorScheme::Costmap, 0).a, 0);
  EXPECT_EQ(cellColor(ColorScheme::Costmap, 50), (Rgba{127, 0, 128, 255}));
  EXPECT_EQ(cellColor(ColorScheme::Costmap, 99), (Rgba{0, 255, 255, 255}));
  EXPECT_EQ(cellColor(ColorScheme::Costmap, 100), (Rgba{255, 0, 255, 255}));
  EXPECT_EQ(cellColor(ColorScheme::Raw, -1), (Rgba{255, 255, 255, 255}));
}

TEST(Map, joinsEqualCellsAndLiesAtItsOrigin) {
  auto grid = map(6, 4);
  grid.data[0] = 100;
  const auto drawn = toMapShapes(grid, ColorScheme::Map);
  EXPECT_EQ(bodyOf(drawn).triangles.size(), 6u);  // the cell, the rest of its row, the other rows
  const auto box = boundsOf(drawn.value->at(0));
  EXPECT_LT((box.min() - Eigen::Vector3f(1, 2, 0)).norm(), 1e-6f);
  EXPECT_LT((box.max() - Eigen::Vector3f(4, 4, 0)).norm(), 1e-6f);
  EXPECT_TRUE(toMapShapes(map(6, 4), ColorScheme::Costmap).value->empty());
}

TEST(Map, isRefusedWithWrongSizes) {
  auto grid = map(6, 4);
  grid.data.pop_back();
  EXPECT_EQ(toMapShapes(grid, {}).reason, "data is not as long as width times height");
  grid.info.width = grid.info.height = 0xffffffffu;
  EXPECT_EQ(toMapShapes(grid, {}).reason, "more than 67108864 cells");
  for (const double bad : {0., -1., kNan}) {
    grid = map(2, 2);
    grid.info.resolution = static_cast<float>(bad);
    EXPECT_EQ(toMapShapes(grid, {}).reason, "resolution is not positive");
  }
  grid.info.resolution = 1e30f;
  EXPECT_EQ(toMapShapes(grid, {}).reason, "resolution is not finite or absurdly large");
  grid = map(2, 2);
  grid.info.origin.position.x = kNan;
  EXPECT_EQ(toMapShapes(grid, {}).reason, "the origin's position is not finite or absurdly far");
  EXPECT_TRUE(toMapShapes(map(0, 0), {}).value->empty());
}

TEST(Map, ofTooManyCellsKeepsItsObstaclesAtLessThanItsResolution) {
  auto noise = map(1000, 1000);
  for (std::size_t i = 0; i < noise.data.size(); ++i) {
    noise.data[i] = static_cast<std::int8_t>((i * 2654435761u >> 20) % 64);
  }
  noise.data[123456] = 100;
  const auto drawn = toMapShapes(noise, ColorScheme::Costmap);
  EXPECT_LE(bodyOf(drawn).triangles.size(), 2 * kMostRectangles);
  EXPECT_EQ(drawn.reason,
            "more than 131072 rectangles of different cells: drawn at less than its resolution");
  const auto& colors = bodyOf(drawn).colors;
  EXPECT_EQ(std::count(colors.begin(), colors.end(), (render::Color{1, 0, 1, 1})), 4);
}

TEST(Map, takesUpdatesThatLieWithinIt) {
  auto grid = map(4, 3);
  EXPECT_EQ(updateMap(updateOf(1, 1, 2, 2), grid), "");
  EXPECT_EQ(grid.data, (std::vector<std::int8_t>{0, 0, 0, 0, 0, 100, 100, 0, 0, 100, 100, 0}));
  EXPECT_EQ(updateMap(updateOf(3, 1, 2, 2), grid), "an update reaches out of its map");
  EXPECT_EQ(updateMap(updateOf(-1, 0, 1, 1), grid), "an update reaches out of its map");
  auto huge = updateOf(1, 1, 1, 1);
  huge.width = 0xffffffffu;
  EXPECT_EQ(updateMap(huge, grid), "an update reaches out of its map");
  auto short_one = updateOf(0, 0, 2, 2);
  short_one.data.pop_back();
  EXPECT_EQ(updateMap(short_one, grid), "an update's data is not as long as width times height");
}

// ------------------------------------------------------------------------------------------ images
sensor_msgs::Image image(std::uint32_t width, std::uint32_t height) {
  sensor_msgs::Image message;
  message.header.frame_id = "camera";
  message.width = width;
  message.height = height;
  message.step = width;
  message.encoding = sensor_msgs::image_encodings::MONO8;
  for (std::uint32_t i = 0; i < width * height; ++i) {
    message.data.push_back(static_cast<std::uint8_t>(i % width * 7));
  }
  return message;
}

TEST(Image, liesAroundItsCenterOrBeforeItsLens) {
  ImagePlane plane;
  plane.width = 3;
  plane.center = {1, 0, 0};
  const auto flat = boundsOf(toImageShapes(image(30, 20), plane).value->at(0));
  EXPECT_LT((flat.min() - Eigen::Vector3f(-0.5f, -1, 0)).norm(), 1e-5f);
  EXPECT_LT((flat.max() - Eigen::Vector3f(2.5f, 1, 0)).norm(), 1e-5f);
  plane.lens = test::lens(30, 20, 20, 14.5, 9.5);
  plane.distance = 2;
  const auto seen = boundsOf(toImageShapes(image(30, 20), plane).value->at(0));
  EXPECT_LT((seen.min() - Eigen::Vector3f(-1.5f, -1, 2)).norm(), 1e-5f);
  EXPECT_LT((seen.max() - Eigen::Vector3f(1.5f, 1, 2)).norm(), 1e-5f);
  EXPECT_EQ(toImageShapes(image(20, 20), plane).reason,
            "the image is not of its camera_info's size");
}

TEST(Image, isRefusedWhereItsBytesAreFewerThanItsSize) {
  auto cut = image(30, 20);
  cut.data.resize(10);
  EXPECT_EQ(toImageShapes(cut, {}).reason, "image data has 10 bytes, 30x20 mono8 needs 600");
  cut.width = 0xffffffffu;
  EXPECT_NE(toImageShapes(cut, {}).reason, "");
}

TEST(Image, ofManyPixelsIsDrawnAtLessThanItsResolution) {
  auto large = image(1024, 768);
  for (std::size_t i = 0; i < large.data.size(); ++i) {
    large.data[i] = static_cast<std::uint8_t>(i * 2654435761u >> 24);
  }
  const auto drawn = toImageShapes(large, {});
  EXPECT_LE(bodyOf(drawn).triangles.size(), 2 * kMostRectangles);
  EXPECT_FALSE(drawn.reason.empty());
}

// ------------------------------------------------------------------------------------------ layers
ros::Time when(double seconds) { return ros::Time(1000 + seconds); }

class FloorLayerTest : public ::testing::Test {
 protected:
  ProjectorScene& scene() {
    if (!scene_) scene_.emplace(config(), buffer);
    return *scene_;
  }
  ProjectorConfig config() const {
    ProjectorConfig config;
    config.fixed_frame = "map";
    config.layers = {layer};
    config.layers[0].topic = "/layer";
    return config;
  }
  std::vector<render::Drawable> drawn(double now) {
    return scene().snapshot(when(now)).scene.layers.at(0).drawables;
  }
  LayerStatus status() { return scene().status().at(0); }

  LayerConfig layer;
  tf2::BufferCore buffer;

 private:
  std::optional<ProjectorScene> scene_;
};

nav_msgs::Odometry odometry(double x, double seconds) {
  nav_msgs::Odometry message;
  message.header.frame_id = "map";
  message.header.stamp = when(seconds);
  message.pose.pose = at(x, 0);
  return message;
}

TEST_F(FloorLayerTest, dropsAnArrowOfOdometryWhereItHasMovedAndKeepsTheLast) {
  layer.type = LayerType::Odometry;
  layer.path.poses = PathStyle::Poses::Arrows;
  layer.buffer_length = 3;
  for (int i = 0; i < 10; ++i) scene().add(0, odometry(0.06 * i, i), when(i));
  EXPECT_EQ(status().received, 10u);
  EXPECT_EQ(drawn(10).size(), 3u);  // at 0, 0.12, 0.24, ...: the last three
  double last = 0;
  for (const render::Drawable& drawable : drawn(10))
    last = std::max(last, double{boundsOf(drawable).min().x()});
  EXPECT_NEAR(last, 0.48, 1e-6);
}

TEST_F(FloorLayerTest, placesAnOldMapWithTheNewestTransformAndUpdatesIt) {
  layer.type = LayerType::OccupancyGrid;
  scene().add(0, updateOf(0, 0, 1, 1), when(0));
  EXPECT_EQ(status().dropped.at("an update before its map"), 1u);
  auto grid = map(6, 4);
  grid.header.frame_id = "floor";
  grid.header.stamp = ros::Time(1);  // long before tf's memory
  scene().add(0, grid, when(0));
  EXPECT_TRUE(drawn(0).empty());
  geometry_msgs::TransformStamped transform;
  transform.header.frame_id = "map";
  transform.header.stamp = when(0);
  transform.child_frame_id = "floor";
  transform.transform.rotation.w = 1;
  transform.transform.translation.x = 10;
  buffer.setTransform(transform, "test", true);
  ASSERT_EQ(drawn(0).size(), 1u);
  EXPECT_NEAR(boundsOf(drawn(0)[0]).min().x(), 11, 1e-5);
  const auto triangles = [this] {
    return std::get<render::MeshInstance>(drawn(0).at(0).shape).body->triangles.size();
  };
  EXPECT_EQ(triangles(), 2u);
  scene().add(0, updateOf(0, 0, 1, 1), when(0));
  EXPECT_EQ(triangles(), 6u);
  scene().add(0, updateOf(6, 0, 1, 1), when(0));
  EXPECT_EQ(status().dropped.at("an update reaches out of its map"), 1u);
  scene().clear();  // time has jumped: a map is not sent again
  EXPECT_EQ(triangles(), 6u);
}

TEST_F(FloorLayerTest, showsPolygonsOfAnArrayByTheirOwnFrames) {
  layer.type = LayerType::PolygonArray;
  jsk_recognition_msgs::PolygonArray array;
  array.polygons.resize(3);
  for (auto& one : array.polygons) {
    one.header.frame_id = "map";
    one.polygon = polygon(kCorner);
  }
  array.polygons[1].header.frame_id = "nowhere";
  scene().add(0, array, when(0));
  EXPECT_EQ(drawn(0).size(), 2u);
  EXPECT_EQ(status().waiting_for, "nowhere");
  array.polygons.resize(1);
  scene().add(0, array, when(1));
  EXPECT_EQ(drawn(1).size(), 1u);
  array.polygons.clear();
  scene().add(0, array, when(2));
  EXPECT_TRUE(drawn(2).empty());
  EXPECT_EQ(status().nothing, "an array without polygons");
}

TEST_F(FloorLayerTest, showsAnImageOnceItsLensIsKnown) {
  layer.type = LayerType::Image;
  layer.camera_info = "/camera_info";
  auto seen = image(30, 20);
  seen.header.frame_id = "map";
  scene().add(0, seen, when(0));
  EXPECT_TRUE(drawn(0).empty());
  EXPECT_EQ(status().dropped.at("no message on /camera_info yet"), 1u);
  scene().add(0, sensor_msgs::CameraInfo(), when(0));
  EXPECT_TRUE(drawn(0).empty());
  scene().add(0, toCameraInfo(test::lens(30, 20, 20, 14.5, 9.5)), when(0));
  ASSERT_EQ(drawn(0).size(), 1u);
  EXPECT_NEAR(boundsOf(drawn(0)[0]).min().z(), 1, 1e-6);
}

TEST_F(FloorLayerTest, waitsForAFrameAndSaysWhichIsUnknown) {
  layer.type = LayerType::Pose;
  layer.path.poses = PathStyle::Poses::Arrows;
  geometry_msgs::PoseStamped pose;
  pose.header.frame_id = "nowhere";
  pose.pose = at(0, 0);
  scene().add(0, pose, when(0));
  EXPECT_TRUE(drawn(0).empty());
  EXPECT_EQ(status().waiting_for, "nowhere");
  pose.header.frame_id = "";
  scene().add(0, pose, when(0));
  EXPECT_EQ(status().dropped.at("frame_id is empty"), 1u);
}

// --------------------------------------------------------------------------------------- recorded
TEST_F(FloorLayerTest, areShownFromARecordingWithTheirSecondTopics) {
  const test::TempFolder folder;
  const std::string path = folder.path("floor.bag");
  {
    rosbag::Bag bag(path, rosbag::bagmode::Write);
    auto seen = image(30, 20);
    seen.header.frame_id = "map";
    bag.write("/camera/image", when(1), seen);
    bag.write("/camera/info", when(2), toCameraInfo(test::lens(30, 20, 20, 14.5, 9.5)));
    bag.write("/map", when(1), map(6, 4));
    bag.write("/map_updates", when(3), updateOf(0, 0, 1, 1));
    bag.close();
  }
  const auto store = replay::openMemoryStore();
  const replay::Behavior behavior = replay::importBag(path, *store).behavior;
  ProjectorConfig config;
  config.fixed_frame = "map";
  config.layers.resize(2);
  config.layers[0].topic = "/camera/image";
  config.layers[0].type = LayerType::Image;
  config.layers[0].camera_info = "/camera/info";
  config.layers[1].topic = "/map";
  config.layers[1].type = LayerType::OccupancyGrid;
  RecordedScene scene(*store, behavior, config);
  const auto triangles = [&](double seconds, std::size_t of) {
    const auto drawables = scene.at(toStamp(when(seconds))).scene.layers.at(of).drawables;
    if (drawables.empty()) return std::size_t{0};
    return std::get<render::MeshInstance>(drawables[0].shape).body->triangles.size();
  };
  EXPECT_EQ(triangles(1.5, 0), 0u);
  EXPECT_EQ(triangles(1.5, 1), 2u);
  EXPECT_EQ(triangles(2.5, 0), 60u);  // equal rows are one
  EXPECT_EQ(triangles(3.5, 1), 6u);
}

}  // namespace
}  // namespace afterglow::nodes::floor_layers_test
