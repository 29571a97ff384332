#include "nodes/observer/room_view.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <stdexcept>

#include "tests/support/temp_folder.hpp"

namespace afterglow::nodes::room_view_test {
namespace {

const std::string kView =
    "fixed_frame: map\n"
    "eye: [0, -2, 1]\n"
    "target: [0, 0, 1]\n"
    "vertical_fov: 90\n"
    "size: [160, 90]\n"
    "others:\n"
    "  left: {eye: [-2, 0, 1], target: [0, 0, 1], vertical_fov: 45,"
    " near: {eye: [-1, 0, 1], target: [0, 0, 1], vertical_fov: 30}}\n"
    "floor: {center: [1, 2], size: [3, 1], color: \"#ff8000\", tile: 1, joint_color: \"#000000\"}\n"
    "walls:\n"
    "  - {from: [0, 0], to: [0, 4], height: 2.5, color: \"#00ff00\"}\n";

std::string edited(const std::string& from, const std::string& to) {
  std::string text = kView;
  const std::size_t found = text.find(from);
  if (found == std::string::npos) throw std::logic_error("not in the view: " + from);
  return text.replace(found, from.size(), to);
}

struct RoomViewTest : ::testing::Test {
  test::TempFolder folder;
  const std::string path = folder.path("view.yaml");

  RoomView load(const std::string& text) const {
    std::ofstream(path) << text;
    return loadRoomView(path);
  }
  /// What it says after the file's name.
  std::string refusal(const std::string& text) const {
    try {
      load(text);
      return "not refused";
    } catch (const std::runtime_error& error) {
      EXPECT_EQ(std::string(error.what()).rfind(path, 0), 0u) << error.what();
      return std::string(error.what()).substr(path.size());
    }
  }
};

TEST_F(RoomViewTest, readsTheDemosFile) {
  const RoomView room = loadRoomView("assets/demo/view.yaml");
  EXPECT_EQ(room.fixed_frame, "map");
  for (const char* place : {"pick", "drive", "place"}) EXPECT_EQ(room.others.count(place), 1u);
}

TEST_F(RoomViewTest, looksFromTheEyeToTheTarget) {
  const RoomView room = load(kView);
  const render::ObserverView view = viewFrom(room.place.look, room.width, room.height);
  EXPECT_EQ(view.width, 160);
  EXPECT_EQ(view.height, 90);
  EXPECT_NEAR(view.vertical_fov, M_PI / 2, 1e-12);
  const auto T_observer_world = view.T_world_observer.inverse();
  EXPECT_TRUE((T_observer_world * Eigen::Vector3d(0, 0, 1)).isApprox(Eigen::Vector3d(0, 0, 2)));
  const Eigen::Vector3d right_and_up = T_observer_world * Eigen::Vector3d(1, 0, 2);
  EXPECT_TRUE(right_and_up.isApprox(Eigen::Vector3d(1, -1, 2)));
  EXPECT_NEAR(view.T_world_observer.matrix().linear().determinant(), 1, 1e-12);
}

TEST_F(RoomViewTest, goesOverToOtherPlaces) {
  const RoomView room = load(kView);
  const Look& left = room.others.at("left").look;
  EXPECT_TRUE(between(room.place.look, left, 0).p_eye.isApprox(room.place.look.p_eye));
  EXPECT_TRUE(between(room.place.look, left, 1).p_eye.isApprox(left.p_eye));
  EXPECT_TRUE(between(room.place.look, left, 0.5).p_eye.isApprox(Eigen::Vector3d(-1, -1, 1)));
  ASSERT_TRUE(room.others.at("left").near);
  EXPECT_EQ(room.others.at("left").near->p_eye.x(), -1);
  EXPECT_FALSE(room.place.near);
}

TEST_F(RoomViewTest, buildsFloorAndWalls) {
  const RoomView room = load(kView);
  ASSERT_EQ(room.shell.size(), 3u) << "joints, tiles, a wall";
  const auto& tiles = std::get<render::Triangles>(room.shell[1].shape);
  ASSERT_EQ(tiles.points.size(), 3u * 6);
  for (const Eigen::Vector3f& p : tiles.points) {
    EXPECT_EQ(p.z(), 0);
    EXPECT_TRUE(p.x() >= -0.5f && p.x() <= 2.5f && p.y() >= 1.5f && p.y() <= 2.5f);
  }
  for (const render::Color& color : tiles.colors) EXPECT_NEAR(color.g, 0.5, 0.02);
  const auto& joints = std::get<render::Cube>(room.shell[0].shape);
  EXPECT_LT(room.shell[0].pose.matrix().translation().z() + joints.size.z() / 2, 0);
  const auto& wall = std::get<render::Cube>(room.shell[2].shape);
  EXPECT_FLOAT_EQ(wall.size.x(), 4);
  EXPECT_FLOAT_EQ(wall.size.z(), 2.5);
  EXPECT_TRUE(
      (room.shell[2].pose * Eigen::Vector3d(2, 0, 0)).isApprox(Eigen::Vector3d(0, 4, 1.25)));
}

TEST_F(RoomViewTest, isMadeAroundWhatHappenedWhereNobodyDescribesIt) {
  for (const double turn : {0.0, 1.0, 2.5, 4.0}) {
    const Eigen::Matrix3d R(Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ()));
    const std::vector<Eigen::Vector3d> places = {{5, 1, 1.3}, {6.5, 1.5, 0}, {9, 0, 1.3}};
    std::vector<Eigen::Vector3d> turned;
    for (const Eigen::Vector3d& place : places) turned.emplace_back(R * place);
    const RoomView room = roomAround("map", turned, R * Eigen::Vector3d(1, 0.2, -1));
    const auto T_observer_world =
        viewFrom(room.place.look, room.width, room.height).T_world_observer.inverse();
    for (const Eigen::Vector3d& place : turned) {
      const Eigen::Vector3d p = T_observer_world * place;
      EXPECT_GT(p.z(), 1) << turn;
      EXPECT_LT(std::abs(p.y() / p.z()), std::tan(room.place.look.vertical_fov / 2)) << turn;
      EXPECT_LT(std::abs(p.x() / p.z()),
                std::tan(room.place.look.vertical_fov / 2) * room.width / room.height);
    }
    EXPECT_GT(Eigen::Vector3d(R.transpose() * room.place.look.p_eye).y(), 2) << "from the left";
    ASSERT_EQ(room.shell.size(), 4u) << "joints, tiles, two walls";
    for (std::size_t i = 2; i < 4; ++i) {
      const auto T_wall_world = room.shell[i].pose.matrix().inverse();
      const double eye_side = (T_wall_world * room.place.look.p_eye).y();
      for (const Eigen::Vector3d& place : turned) {
        EXPECT_GT((T_wall_world * place).y() * eye_side, 0) << "no wall before the eye";
      }
    }
  }
}

TEST_F(RoomViewTest, isMadeAroundTheOriginOfARecordingWithoutAProjectorsPose) {
  const RoomView room = roomAround("odom", {}, Eigen::Vector3d::Zero());
  EXPECT_EQ(room.fixed_frame, "odom");
  EXPECT_TRUE(room.place.look.p_target.head<2>().isZero());
}

TEST_F(RoomViewTest, refusesWhatItDoesNotUnderstand) {
  EXPECT_EQ(refusal(edited("target:", "targt:")),
            ":3: unknown key 'targt' in the view; did you mean 'target'?");
  EXPECT_EQ(refusal(edited("fixed_frame: map\n", "")), ":1: no 'fixed_frame' in the view");
  EXPECT_EQ(refusal(edited("[0, 0, 1]", "[0, -2, 5]")),
            ":3: 'target' should not be straight above or below 'eye'");
  EXPECT_EQ(refusal(edited("[160, 90]", "[160.5, 90]")),
            ":5: 'size' should be two whole numbers of pixels from 16 to 4096");
  EXPECT_EQ(refusal(edited("#ff8000", "orange")),
            ":8: 'color' of the floor should be \"#rrggbb\" or [r, g, b]");
  EXPECT_EQ(refusal(edited("tile: 1", "tile: 0.001")).rfind(":8: 'tile' of the floor", 0), 0u);
  EXPECT_EQ(refusal(edited("to: [0, 4]", "to: [0, 0]")),
            ":10: a wall should be 0.01 to 100 m long");
  EXPECT_EQ(refusal("floor: ["), ":1: end of sequence flow not found");
  EXPECT_THROW(loadRoomView(folder.path("none.yaml")), std::runtime_error);
}

}  // namespace
}  // namespace afterglow::nodes::room_view_test
