// Markers as broken as they come (numbered as in the list of faults they stem from): each does what
// its test says, is counted and logged once, and everything else is still drawn.
#include <cmath>
#include <limits>
#include <string>

#include "tests/support/faulty_scene.hpp"

namespace afterglow::nodes::marker_faults_test {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinite = std::numeric_limits<double>::infinity();

class MarkerFaults : public test::FaultyScene {};

std_msgs::ColorRGBA color(float r, float g, float b, float a) {
  std_msgs::ColorRGBA c;
  c.r = r;
  c.g = g;
  c.b = b;
  c.a = a;
  return c;
}

// 17, 18
TEST_F(MarkerFaults, nothingThatIsNotFiniteIsDrawn) {
  for (const double bad : {kNan, kInfinite, -kInfinite}) {
    Marker m = cube(7);
    m.pose.position.x = bad;
    expectRefused(m, "position is not finite or absurdly far");
    m = cube(7);
    m.pose.orientation.z = bad;
    expectRefused(m, "orientation is not finite");
    m = cube(7);
    m.scale.z = bad;
    expectRefused(m, "scale is not finite or absurdly large");
    m = cube(7);
    m.color.a = static_cast<float>(bad);
    expectRefused(m, "color is not finite");
    m = withPoints(Marker::LINE_STRIP, 4);
    m.points[2].y = bad;
    expectRefused(m, "a point is not finite or absurdly far");
    m = withPoints(Marker::SPHERE_LIST, 4);
    m.colors.assign(4, color(1, 1, static_cast<float>(bad), 1));
    expectRefused(m, "a color is not finite");
  }
}

TEST_F(MarkerFaults, absurdSizesAndPlacesAreRefused) {
  for (const double absurd : {6e180, -1e245, 1e39, 1e7}) {
    Marker m = cube(7);
    m.scale.x = absurd;
    expectRefused(m, "scale is not finite or absurdly large");
    m = cube(7);
    m.pose.position.z = absurd;
    expectRefused(m, "position is not finite or absurdly far");
    m = withPoints(Marker::POINTS, 2);
    m.points[1].x = absurd;
    expectRefused(m, "a point is not finite or absurdly far");
  }
  Marker m = withPoints(Marker::TRIANGLE_LIST, 3);
  m.scale.y = 1e6;  // each by itself is possible, their product is not
  expectRefused(m, "a point is not finite or absurdly far");
}

// RViz 1.14 checks of each type the fields that it uses (marker_utils.cpp, checkMarkerMsg).
TEST_F(MarkerFaults, fieldsThatATypeDoesNotUseAreNotLookedAt) {
  for (const int type : {Marker::LINE_STRIP, Marker::LINE_LIST}) {
    Marker m = withPoints(type, 4);
    m.scale.y = kNan;
    m.scale.z = kInfinite;
    expectDrawn(m);
  }
  Marker m = withPoints(Marker::POINTS, 2);
  m.scale.z = kNan;
  expectDrawn(m);
  m = marker(Marker::TEXT_VIEW_FACING);
  m.text = "text";
  m.scale.x = kNan;
  m.scale.y = 1e300;
  m.pose.orientation.x = kNan;
  m.pose.orientation.w = 1e-7;
  expectDrawn(m);
  for (const int type : {Marker::LINE_STRIP, Marker::LINE_LIST, Marker::CUBE_LIST,
                         Marker::SPHERE_LIST, Marker::POINTS, Marker::TRIANGLE_LIST}) {
    m = withPoints(type, 6);
    m.colors.assign(6, color(1, 1, 1, 1));
    m.color.b = static_cast<float>(kNan);
    EXPECT_EQ(expectDrawn(m).color, render::Color{}) << type;
  }
  for (const int type :
       {Marker::CUBE, Marker::SPHERE, Marker::CYLINDER, Marker::TEXT_VIEW_FACING}) {
    m = withPoints(type, 3);
    m.text = "text";
    m.points[1].z = kNan;
    m.colors.assign(2, color(static_cast<float>(kNan), 0, 0, 1));
    expectDrawn(m);
  }
  for (const int count : {0, 2}) {
    m = withPoints(Marker::ARROW, count);
    m.colors.assign(5, color(static_cast<float>(kNan), 0, 0, 1));
    expectDrawn(m);
  }
}

TEST_F(MarkerFaults, fieldsThatATypeUsesAreLookedAtThoughOthersAreNot) {
  Marker m = withPoints(Marker::LINE_STRIP, 4);
  m.scale.x = kNan;
  expectRefused(m, "scale is not finite or absurdly large");
  m = withPoints(Marker::POINTS, 4);
  m.pose.orientation.x = kNan;
  expectRefused(m, "orientation is not finite");
  m = marker(Marker::TEXT_VIEW_FACING);
  m.scale.z = kInfinite;
  expectRefused(m, "scale is not finite or absurdly large");
  m = withPoints(Marker::ARROW, 2);
  m.points[1].x = kNan;
  expectRefused(m, "a point is not finite or absurdly far");
}

// 19, 20
TEST_F(MarkerFaults, orientationsAreNormalizedOrRefused) {
  Marker m = cube(7);
  m.pose.orientation.w = 0;
  EXPECT_TRUE(expectDrawn(m).pose.matrix().linear().isIdentity());
  m.pose.orientation.w = 0.995;
  EXPECT_TRUE(expectDrawn(m).pose.matrix().linear().isIdentity(1e-9));
  m.pose.orientation.w = 42;
  EXPECT_TRUE(
      expectDrawn(m, "orientation is not normalized").pose.matrix().linear().isIdentity(1e-9));
  m.pose.orientation.w = 1e-7;
  expectRefused(m, "orientation has no length");
  m.pose.orientation.w = 1e200;  // its square is not finite
  expectRefused(m, "orientation is not finite");
}

// 21
TEST_F(MarkerFaults, scalesOfZeroOrLessAreDrawnWhereTheyMakeSenseAndRefusedElsewhere) {
  Marker m = cube(7);
  m.scale.x = -0.1;  // mirrored it is the same
  m.scale.z = 0;     // flat it is still seen
  expectDrawn(m);
  for (const int type : {Marker::CUBE, Marker::SPHERE, Marker::CYLINDER}) {
    m = marker(type);
    m.scale.x = m.scale.y = 0;
    expectRefused(m, "scale is 0");
  }
  for (const double width : {0.0, -0.1}) {
    m = withPoints(Marker::LINE_LIST, 2);
    m.scale.x = width;
    expectRefused(m, "line width is not positive");
    m = withPoints(Marker::POINTS, 2);
    m.scale.y = width;
    expectRefused(m, "point size is not positive");
    m = marker(Marker::ARROW);
    m.scale.x = width;
    expectRefused(m, "arrow's length or width is not positive");
    m = marker(Marker::TEXT_VIEW_FACING);
    m.text = "text";
    m.scale.z = width;
    expectRefused(m, "text height (scale.z) is not positive");
  }
}

// 22
TEST_F(MarkerFaults, unknownTypesAndActionsAreIgnored) {
  for (const int type : {-1, 12, 99, std::numeric_limits<int>::max()}) {
    expectRefused(marker(type), "unknown type");
  }
  for (const int action : {1, -1, 99}) {
    Marker m = cube(7);
    m.action = action;
    expectRefused(m, "unknown action");
  }
}

// 23
TEST_F(MarkerFaults, deletingWhatIsNotThereDoesNothing) {
  Marker gone;
  gone.action = Marker::DELETE;
  gone.id = 12345;
  gone.ns = "nobody's";
  add({cube(1), gone}, at(0));
  EXPECT_EQ(drawn(at(0)).size(), 1u);
  EXPECT_TRUE(dropped().empty());
}

// 24
TEST_F(MarkerFaults, deleteAllClearsItsTopicAndNoOther) {
  Marker all;
  all.action = Marker::DELETEALL;
  Marker named = cube(1);
  named.ns = "some";
  add({cube(1), named, cube(2, "a frame nobody has")}, at(0));
  add({all}, at(1));
  transform("a frame nobody has", 1, at(1), true);
  EXPECT_TRUE(drawn(at(2)).empty());  // nor what waited
}

// 25
TEST_F(MarkerFaults, incompletePrimitivesAreRefused) {
  expectRefused(withPoints(Marker::ARROW, 1), "ARROW of neither 0 nor 2 points");
  expectRefused(withPoints(Marker::ARROW, 3), "ARROW of neither 0 nor 2 points");
  expectRefused(withPoints(Marker::LINE_LIST, 3), "LINE_LIST of an odd number of points");
  expectRefused(withPoints(Marker::LINE_LIST, 1), "fewer than two points for a line");
  for (const int count : {0, 1}) {
    expectRefused(withPoints(Marker::LINE_STRIP, count), "fewer than two points for a line");
  }
  for (const int count : {1, 2, 4, 5}) {
    expectRefused(withPoints(Marker::TRIANGLE_LIST, count),
                  "TRIANGLE_LIST of incomplete triangles");
  }
}

// 26
TEST_F(MarkerFaults, colorsOfAnotherNumberThanPointsAreRefused) {
  for (const int type : {Marker::LINE_STRIP, Marker::LINE_LIST, Marker::CUBE_LIST,
                         Marker::SPHERE_LIST, Marker::POINTS, Marker::TRIANGLE_LIST}) {
    Marker m = withPoints(type, 6);
    expectDrawn(m);  // none: the marker's own
    for (const std::size_t count : {1u, 5u, 7u}) {
      m.colors.assign(count, color(1, 0, 0, 1));
      expectRefused(m, "colors are not as many as points");
    }
  }
}

// 27
TEST_F(MarkerFaults, pointsInOnePlaceMakeNothingThatIsNotFinite) {
  for (const int type : {Marker::LINE_STRIP, Marker::LINE_LIST, Marker::CUBE_LIST,
                         Marker::SPHERE_LIST, Marker::POINTS, Marker::TRIANGLE_LIST}) {
    Marker m = withPoints(type, 6);
    for (auto& p : m.points) p = m.points[1];
    expectDrawn(m);
    for (auto& p : m.points) p = geometry_msgs::Point();
    expectDrawn(m);
  }
  Marker m = withPoints(Marker::TRIANGLE_LIST, 3);
  for (auto& p : m.points) p.y = 0;  // in a line
  expectDrawn(m);
  m = withPoints(Marker::ARROW, 2);
  m.points[1] = m.points[0];
  expectRefused(m, "arrow's start and end coincide");
}

// 28: the file's own faults are in marker_assets_test, mesh_file_test and mesh_reader_test.
TEST_F(MarkerFaults, aMeshThatCannotBeHadIsRefusedByName) {
  Marker m = marker(Marker::MESH_RESOURCE);
  expectRefused(m, "no mesh_resource");
  m.mesh_resource = "http://localhost/a.stl";
  expectRefused(m, "mesh 'http://localhost/a.stl': neither package:// nor file://");
  m.mesh_resource = "package://nowhere_at_all/a.stl";
  expectRefused(m, "mesh 'package://nowhere_at_all/a.stl': there is no ROS package of that name");
  m.mesh_resource = "file:///a/../../etc/passwd";
  expectRefused(m, "mesh 'file:///a/../../etc/passwd': '..' is not followed");
  m.mesh_resource = "file:///dev/zero";
  expectRefused(m,
                "mesh 'file:///dev/zero': outside the folders meshes may come from (mesh_roots)");
}

// 29
TEST_F(MarkerFaults, strangeTextIsDrawnAsFarAsItIsText) {
  Marker m = marker(Marker::TEXT_VIEW_FACING);
  for (const std::string& text :
       {std::string("\xff\xfe\xc0\x80\xed\xa0\x80"), std::string("a\0b", 3),
        std::string("\n\n\r\t\n"), std::string("\xd7\xa9\xd7\x9c\xd7\x95\xd7\x9d"),
        std::string("\xf0\x9f"), std::string("%s%n{}")}) {
    m.text = text;
    expectDrawn(m);
  }
  m.text.clear();
  expectDrawn(m, "text is empty");
  m.text = std::string(10'000'000, '\xff');
  expectRefused(m, "text of more than 4096 characters");
}

// The set-up installs fonts-dejavu-core, which has no character for private use.
TEST_F(MarkerFaults, lettersThatNoFontHasAreTold) {
  Marker m = marker(Marker::TEXT_VIEW_FACING);
  m.text = "a \xf4\x8f\xbf\xbd \xf4\x8f\xbf\xbc";  // U+10FFFD, U+10FFFC
  const std::string remark =
      "no font has U+10FFFD and 1 more: install one that has (fonts-noto-core, "
      "fonts-noto-cjk, fonts-symbola)";
  expectDrawn(m, remark);
  startAgain();
  add({m}, at(0));
  add({m}, at(1));  // known already
  EXPECT_EQ(remarks().at(remark), 2u);
}

// A sphere is drawn with 25 corners at least, in a list with a million at most.
TEST_F(MarkerFaults, moreThanCanBeDrawnAtOnceIsRefused) {
  std::vector<Marker> lists(4, withPoints(Marker::SPHERE_LIST, 50'000));
  for (int i = 0; i < 4; ++i) lists[static_cast<std::size_t>(i)].id = i;
  for (auto& list : lists) {
    for (auto& p : list.points) p.x = p.y = 0;
  }
  add(lists, at(0));
  const std::string reason = "too much at once: more than 2 million corners on this topic";
  EXPECT_EQ(scene_->status()[kMarkers].shown, 2u);
  EXPECT_EQ(dropped(), (std::map<std::string, std::uint64_t>{{reason, 2}}));
  lists[0].action = Marker::DELETE;
  add({lists[0], lists[3]}, at(1));
  EXPECT_EQ(scene_->status()[kMarkers].shown, 2u) << "there is room again";
  EXPECT_EQ(dropped().at(reason), 2u);
  Marker strip = withPoints(Marker::LINE_STRIP, 300'000);  // 8 corners a point
  for (auto& p : strip.points) p.x = p.y = 0;
  add({strip}, at(1));
  EXPECT_EQ(dropped().at(reason), 3u);
  lists[3].action = Marker::DELETEALL;
  add({lists[3], strip}, at(2));
  EXPECT_EQ(scene_->status()[kMarkers].shown, 1u) << "alone it is drawn";
}

// 30
TEST_F(MarkerFaults, aMillionIdsAreBounded) {
  visualization_msgs::MarkerArray array;
  array.markers.resize(1000, cube(0));
  for (int round = 0; round < 1000; ++round) {
    for (int i = 0; i < 1000; ++i) array.markers[static_cast<std::size_t>(i)].id = 1000 * round + i;
    scene_->add(kMarkers, array, at(0));
  }
  EXPECT_EQ(scene_->status()[kMarkers].shown, 20'000u);
  EXPECT_EQ(dropped().at("too many markers"), 980'000u);
  EXPECT_EQ(logged(0).size(), 1u);
  array.markers.resize(1);
  array.markers[0].id = 5;  // what is shown already can still change, and go
  array.markers[0].type = Marker::SPHERE;
  scene_->add(kMarkers, array, at(0));
  EXPECT_EQ(dropped().at("too many markers"), 980'000u);
  array.markers[0].action = Marker::DELETEALL;
  scene_->add(kMarkers, array, at(0));
  EXPECT_TRUE(drawn(at(0)).empty());
}

TEST_F(MarkerFaults, aNewNamespaceInEachMessageIsBounded) {
  for (int i = 0; i < 25'000; ++i) {
    Marker m = cube(1, "nowhere");
    m.ns = "namespace " + std::to_string(i);
    add({m}, at(0));
  }
  EXPECT_EQ(scene_->status()[kMarkers].waiting, 20'000u);
  scene_->update(at(20));
  EXPECT_EQ(scene_->status()[kMarkers].waiting, 0u);
  EXPECT_LE(dropped().size(), 2u);
}

// 31
TEST_F(MarkerFaults, lifetimesEndInRosTimeAndStartAnewAfterAJump) {
  Marker m = cube(7);
  m.lifetime = ros::Duration(2);
  add({m, cube(8)}, at(100));
  EXPECT_EQ(drawn(at(101.9)).size(), 2u);
  EXPECT_EQ(drawn(at(101.9)).size(), 2u);  // time stands still: so does its end
  EXPECT_EQ(drawn(at(102)).size(), 1u);
  scene_->clear();  // as the node does when time jumps back
  add({m}, at(3));
  scene_->add(kRest, cube(1), at(3));
  EXPECT_EQ(drawn(at(4.9)).size(), 1u);
  EXPECT_TRUE(drawn(at(5)).empty());
}

TEST_F(MarkerFaults, lifetimesOfNothingLessOrEverAreForever) {
  for (const auto& lifetime : {ros::Duration(0), ros::Duration(-3), ros::Duration(0x7fffffff, 0)}) {
    Marker m = cube(7);
    m.lifetime = lifetime;
    startAgain();
    add({m}, at(0));
    EXPECT_EQ(drawn(at(1e8)).size(), 1u);
  }
  Marker m = cube(7);
  m.lifetime.sec = 1;
  m.lifetime.nsec = -2'000'000'000;  // no publisher of a library sends it
  expectDrawn(m);
}

// 32
TEST_F(MarkerFaults, aFrameLockedMarkerHidesWithItsFrameAndReturnsWithIt) {
  transform("arm", 1, at(0));
  Marker m = cube(7, "arm");
  m.frame_locked = 1;
  add({m}, at(0));
  EXPECT_EQ(drawn(at(0.5)).size(), 1u);
  buffer_.clear();
  EXPECT_TRUE(drawn(at(1)).empty());
  EXPECT_EQ(scene_->status()[kMarkers].waiting_for, "arm");
  transform("arm", 3, at(2));
  const auto returned = drawn(at(2));
  ASSERT_EQ(returned.size(), 1u);
  EXPECT_DOUBLE_EQ(returned[0].pose.matrix().translation().x(), 3);
}

TEST_F(MarkerFaults, aMarkerSentAgainUnlockedNoLongerFollowsItsFrame) {
  transform("arm", 1, at(0));
  Marker m = cube(7, "arm");
  m.frame_locked = 1;
  add({m}, at(0));
  m.frame_locked = 0;  // RViz goes on moving it
  add({m}, at(0));
  transform("arm", 5, at(1));
  const auto drawables = drawn(at(1));
  ASSERT_EQ(drawables.size(), 1u);
  EXPECT_DOUBLE_EQ(drawables[0].pose.matrix().translation().x(), 1);
}

// 33
TEST_F(MarkerFaults, ofOneIdTwiceInAnArrayTheLastIsShown) {
  Marker last = cube(7);
  last.pose.position.x = 3;
  add({cube(7), cube(8), last}, at(0));
  const auto drawables = drawn(at(0));
  ASSERT_EQ(drawables.size(), 2u);
  EXPECT_DOUBLE_EQ(drawables[0].pose.matrix().translation().x(), 3);
  EXPECT_EQ(remarks().at("an id twice in one array: the last is shown"), 1u);
  Marker all, other = cube(7);
  all.action = Marker::DELETEALL;
  other.ns = "other";
  startAgain();
  add({cube(7), other, all, cube(7)}, at(0));  // neither of these is the same
  EXPECT_TRUE(remarks().empty());
}

// 34
TEST_F(MarkerFaults, colorsAreClampedAndTransparentOnesNotDrawn) {
  Marker m = cube(7);
  m.color = color(300, -5, 0.5f, 2);
  EXPECT_EQ(expectDrawn(m).color, (render::Color{1, 0, 0.5f, 1}));
  for (const float alpha : {0.0f, -1.0f}) {
    m.color.a = alpha;
    startAgain();
    add({m, cube(8)}, at(0));
    EXPECT_EQ(drawn(at(0)).size(), 1u);
  }
}

}  // namespace
}  // namespace afterglow::nodes::marker_faults_test
