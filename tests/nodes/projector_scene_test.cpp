#include "nodes/projector/projector_scene.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <future>
#include <string>

#include "nodes/conversion/geometry_conversion.hpp"
#include "nodes/projector/frame_lookup.hpp"
#include "tests/support/cloud_messages.hpp"
#include "tests/support/cube_files.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::nodes::projector_scene_test {
namespace {

using test::cloudMessage;
using visualization_msgs::Marker;

constexpr std::size_t kCloud = 0, kMarkers = 1, kPath = 2;

ros::Time at(double seconds) { return ros::Time(1000 + seconds); }

ProjectorConfig config() {
  ProjectorConfig config;
  config.fixed_frame = "map";
  config.projectors.resize(1);
  config.projectors[0].frame = "projector";
  config.layers.resize(3);
  config.layers[kCloud].topic = "/cloud";
  config.layers[kCloud].type = LayerType::PointCloud2;
  config.layers[kMarkers].topic = "/markers";
  config.layers[kMarkers].type = LayerType::MarkerArray;
  config.layers[kPath].topic = "/path";
  config.layers[kPath].type = LayerType::Path;
  return config;
}

/// A scene on a hand-driven clock and hand-made transforms.
class ProjectorSceneTest : public ::testing::Test {
 protected:
  void transform(const std::string& frame, double x, ros::Time stamp, bool is_static = false) {
    geometry_msgs::TransformStamped message;
    message.header.frame_id = "map";
    message.child_frame_id = frame;
    message.header.stamp = stamp;
    message.transform.translation.x = x;
    message.transform.rotation.w = 1;
    buffer.setTransform(message, "test", is_static);
  }

  static Marker cube(int id, const std::string& frame = "map", const std::string& ns = "") {
    Marker m;
    m.header.frame_id = frame;
    m.ns = ns;
    m.id = id;
    m.type = Marker::CUBE;
    m.pose.orientation.w = 1;
    m.scale.x = m.scale.y = m.scale.z = 0.1;
    m.color.a = 1;
    return m;
  }

  void add(const Marker& marker, ros::Time now) { scene.add(kMarkers, marker, now); }

  std::vector<render::Drawable> drawn(std::size_t layer, ros::Time now) {
    return scene.snapshot(now).scene.layers.at(layer).drawables;
  }
  double firstX(ros::Time now) {
    const auto drawables = drawn(kMarkers, now);
    return drawables.size() == 1 ? drawables[0].pose.matrix().translation().x() : -1;
  }
  std::map<std::string, std::uint64_t> dropped(std::size_t layer) {
    return scene.status().at(layer).dropped;
  }

  tf2::BufferCore buffer;
  ProjectorScene scene{config(), buffer};
};

// ---------------------------------------------------------------------------------------- markers

TEST_F(ProjectorSceneTest, replacesAndDeletesByNamespaceAndId) {
  add(cube(1), at(0));
  add(cube(1, "map", "other"), at(0));
  add(cube(2), at(0));
  EXPECT_EQ(drawn(kMarkers, at(0)).size(), 3u);
  Marker sphere = cube(1);
  sphere.type = Marker::SPHERE;
  add(sphere, at(1));
  EXPECT_EQ(drawn(kMarkers, at(1)).size(), 3u);
  Marker gone;  // no frame is needed to delete
  gone.action = Marker::DELETE;
  gone.id = 1;
  add(gone, at(2));
  EXPECT_EQ(drawn(kMarkers, at(2)).size(), 2u);
  gone.id = 77;
  add(gone, at(2));
  EXPECT_EQ(drawn(kMarkers, at(2)).size(), 2u);
  gone.action = Marker::DELETEALL;
  gone.ns = "neither here nor there";
  add(gone, at(3));
  EXPECT_TRUE(drawn(kMarkers, at(3)).empty());
  EXPECT_TRUE(dropped(kMarkers).empty());
}

TEST_F(ProjectorSceneTest, showsAMeshOnceItHasBeenReadBesideTheDrawing) {
  const test::TempFolder folder;
  test::writeFile(folder.path("cube.stl"), test::cubeStl());
  ProjectorConfig from_folder = config();
  from_folder.mesh_roots = {folder.path("")};
  ProjectorScene beside(from_folder, buffer, ProjectorScene::MeshReading::BesideDrawing);
  Marker mesh = cube(1);
  mesh.type = Marker::MESH_RESOURCE;
  mesh.mesh_resource = "file://" + folder.path("cube.stl");
  beside.add(kMarkers, mesh, at(0));
  mesh.id = 2;
  beside.add(kMarkers, mesh, at(0));
  mesh.action = Marker::DELETE;
  beside.add(kMarkers, mesh, at(0));
  beside.add(kMarkers, cube(3), at(0));
  EXPECT_FALSE(beside.snapshot(at(0)).scene.layers.at(kMarkers).drawables.empty());
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (beside.isWaiting() && std::chrono::steady_clock::now() < deadline) beside.update(at(0));
  EXPECT_EQ(beside.snapshot(at(0)).scene.layers.at(kMarkers).drawables.size(), 2u);
  EXPECT_TRUE(beside.status().at(kMarkers).dropped.empty());
}

TEST(UnreadMeshes, waitOneForAKeyAndAreForgottenWithIt) {
  std::promise<MeshLibrary::Mesh> promise;
  const std::shared_future<MeshLibrary::Mesh> mesh = promise.get_future().share();
  const auto unread = [&](std::size_t layer, int id) {
    UnreadMesh u;
    u.layer = layer;
    u.marker.id = id;
    u.mesh = mesh;
    return u;
  };
  UnreadMeshes meshes;
  for (int id : {1, 2, 2, 3}) EXPECT_TRUE(meshes.add(unread(0, id)));
  EXPECT_TRUE(meshes.add(unread(1, 1)));
  EXPECT_TRUE(meshes.add(unread(2, 1)));
  meshes.remove(0, {"", 3});
  meshes.remove(0, {"", 99});
  meshes.removeAll(1);
  EXPECT_EQ(meshes.waiting().size(), 3u);
  EXPECT_TRUE(meshes.takeRead().empty());
  promise.set_value({std::nullopt, "bent"});
  EXPECT_EQ(meshes.takeRead().size(), 3u);
  EXPECT_TRUE(meshes.waiting().empty());
}

TEST(UnreadMeshes, areBounded) {
  std::promise<MeshLibrary::Mesh> promise;
  UnreadMesh unread;
  unread.mesh = promise.get_future().share();
  UnreadMeshes meshes;
  for (int i = 0; i < 1000; ++i) {
    unread.marker.id = i;
    ASSERT_TRUE(meshes.add(unread));
  }
  unread.marker.id = 1000;
  EXPECT_FALSE(meshes.add(unread));
  unread.marker.id = 999;
  EXPECT_TRUE(meshes.add(unread)) << "it replaces one";
}

TEST_F(ProjectorSceneTest, obeysTheOrderWithinAnArray) {
  visualization_msgs::MarkerArray array;
  array.markers = {cube(1), cube(2), Marker(), cube(3)};
  array.markers[2].action = Marker::DELETEALL;
  scene.add(kMarkers, array, at(0));
  EXPECT_EQ(drawn(kMarkers, at(0)).size(), 1u);
}

TEST_F(ProjectorSceneTest, endsALifetimeCountedFromArrival) {
  Marker m = cube(1);
  m.lifetime = ros::Duration(2);
  m.header.stamp = at(-500);  // an old stamp is no old age
  add(m, at(0));
  EXPECT_EQ(drawn(kMarkers, at(1.9)).size(), 1u);
  add(m, at(1.9));  // sent again, it starts again
  EXPECT_EQ(drawn(kMarkers, at(3.8)).size(), 1u);
  EXPECT_TRUE(drawn(kMarkers, at(3.9)).empty());
}

TEST_F(ProjectorSceneTest, takesZeroNegativeAndHugeLifetimesForForever) {
  for (const ros::Duration lifetime : {ros::Duration(0), ros::Duration(-5),
                                       ros::Duration(0, 50'000), ros::Duration(0x7fffffff, 0)}) {
    Marker m = cube(1);
    m.lifetime = lifetime;
    add(m, at(0));
    EXPECT_EQ(drawn(kMarkers, at(1e6)).size(), 1u) << lifetime;
    scene.clear();
  }
}

TEST_F(ProjectorSceneTest, placesOnceUnlessFrameLocked) {
  transform("arm", 1, at(0));
  add(cube(1, "/arm"), at(0));  // tf's leading slash is no part of the name
  Marker locked = cube(2, "arm");
  locked.frame_locked = 1;
  add(locked, at(0));
  transform("arm", 5, at(1));
  const auto drawables = drawn(kMarkers, at(1));
  ASSERT_EQ(drawables.size(), 2u);
  EXPECT_DOUBLE_EQ(drawables[0].pose.matrix().translation().x(), 1);
  EXPECT_DOUBLE_EQ(drawables[1].pose.matrix().translation().x(), 5);
}

TEST_F(ProjectorSceneTest, takesStampZeroForTheNewestTransformAndOthersForTheirTime) {
  transform("arm", 1, at(0));
  transform("arm", 3, at(2));
  Marker m = cube(1, "arm");
  m.header.stamp = at(1);
  add(m, at(2));
  EXPECT_DOUBLE_EQ(firstX(at(2)), 2);
  m.header.stamp = ros::Time(0);
  add(m, at(2));
  EXPECT_DOUBLE_EQ(firstX(at(2)), 3);
}

TEST_F(ProjectorSceneTest, hidesAFrameLockedMarkerWhileItsFrameIsGone) {
  transform("arm", 1, at(0));
  Marker m = cube(1, "arm");
  m.frame_locked = 1;
  add(m, at(0));
  EXPECT_EQ(drawn(kMarkers, at(0)).size(), 1u);
  buffer.clear();
  const SceneSnapshot snapshot = scene.snapshot(at(1));
  EXPECT_TRUE(snapshot.scene.layers[kMarkers].drawables.empty());
  EXPECT_EQ(snapshot.problems.back(), "/markers: no transform from 'arm' to 'map'");
  transform("arm", 7, at(2));
  EXPECT_DOUBLE_EQ(firstX(at(2)), 7);
}

TEST_F(ProjectorSceneTest, namesTheLinkOfAChainThatIsOld) {
  transform("base", 1, at(0));
  geometry_msgs::TransformStamped message;
  message.header.frame_id = "base";
  message.child_frame_id = "projector";
  message.transform.rotation.w = 1;
  for (const double time : {0., 4.}) {
    message.header.stamp = at(time);
    buffer.setTransform(message, "test");
  }
  EXPECT_EQ(scene.snapshot(at(4)).problems.at(0),
            "projector: the transform from 'projector' to 'map' is stale: 'base' in 'map' is 4 s "
            "old");
}

TEST_F(ProjectorSceneTest, countsWhatIsInvisibleAndWhoseLifetimeIsOver) {
  Marker m = cube(1);
  m.color.a = 0;
  add(m, at(0));
  m.id = 2;
  m.lifetime = ros::Duration(1);
  add(m, at(0));
  EXPECT_TRUE(drawn(kMarkers, at(0)).empty());
  EXPECT_EQ(scene.status().at(kMarkers).invisible, 2u);
  EXPECT_EQ(scene.status().at(kMarkers).expired, 0u);
  EXPECT_TRUE(drawn(kMarkers, at(1)).empty());
  EXPECT_EQ(scene.status().at(kMarkers).invisible, 1u);
  EXPECT_EQ(scene.status().at(kMarkers).expired, 1u);
}

TEST_F(ProjectorSceneTest, hidesWhatFollowsAFrameThatIsStale) {
  transform("arm", 1, at(0));
  Marker m = cube(1, "arm");
  m.frame_locked = 1;
  add(m, at(0));
  EXPECT_EQ(drawn(kMarkers, at(2)).size(), 1u);
  const SceneSnapshot snapshot = scene.snapshot(at(2.1));
  EXPECT_TRUE(snapshot.scene.layers[kMarkers].drawables.empty());
  EXPECT_EQ(snapshot.problems.back(),
            "/markers: the transform from 'arm' to 'map' is stale: 'arm' in 'map' is 2 s old");
  transform("arm", 2, at(3));
  EXPECT_DOUBLE_EQ(firstX(at(3)), 2);
}

TEST_F(ProjectorSceneTest, placesNothingByAStaleTransform) {
  transform("arm", 1, at(0));
  add(cube(1, "arm"), at(5));  // stamp 0: where the arm is now, and nobody knows
  EXPECT_TRUE(drawn(kMarkers, at(5)).empty());
  EXPECT_TRUE(scene.isWaiting());
  transform("arm", 2, at(6));
  EXPECT_DOUBLE_EQ(firstX(at(6)), 2);
  EXPECT_FALSE(scene.isWaiting());
  EXPECT_DOUBLE_EQ(firstX(at(60)), 2);  // once placed it stands
}

TEST_F(ProjectorSceneTest, waitsForATransformAndKeepsWhatWasShownMeanwhile) {
  transform("arm", 1, at(0));
  Marker m = cube(1, "arm");
  m.header.stamp = at(0);
  add(m, at(0));
  m.header.stamp = at(1);
  add(m, at(1));
  EXPECT_DOUBLE_EQ(firstX(at(1)), 1);
  EXPECT_EQ(scene.status()[kMarkers].waiting_for, "arm");
  transform("arm", 4, at(1.5));
  EXPECT_DOUBLE_EQ(firstX(at(1.5)), 3);
  EXPECT_EQ(scene.status()[kMarkers].waiting, 0u);
}

TEST_F(ProjectorSceneTest, doesNotLetAnOldMarkerReplaceANewOne) {
  add(cube(1, "late"), at(0));
  Marker newer = cube(1);
  newer.pose.position.x = 9;
  add(newer, at(1));
  transform("late", 1, at(2), true);
  EXPECT_DOUBLE_EQ(firstX(at(2)), 9);
}

TEST_F(ProjectorSceneTest, forgetsWhatWaitsWhenItIsDeleted) {
  add(cube(1, "late"), at(0));
  Marker gone = cube(1);
  gone.action = Marker::DELETE;
  add(gone, at(1));
  transform("late", 1, at(2), true);
  EXPECT_TRUE(drawn(kMarkers, at(2)).empty());
}

TEST_F(ProjectorSceneTest, dropsWhatWaitsInVain) {
  add(cube(1, "nowhere"), at(0));
  scene.update(at(9));
  EXPECT_EQ(scene.status()[kMarkers].waiting, 1u);
  scene.update(at(10));
  EXPECT_EQ(scene.status()[kMarkers].waiting, 0u);
  EXPECT_EQ(dropped(kMarkers).at("no transform from 'nowhere' to 'map'"), 1u);
}

TEST_F(ProjectorSceneTest, refusesABadMarkerAndRemovesWhatItReplaces) {
  add(cube(1), at(0));
  Marker bad = cube(1);
  bad.scale.x = std::numeric_limits<double>::quiet_NaN();
  visualization_msgs::MarkerArray array;
  array.markers = {bad, cube(2)};
  scene.add(kMarkers, array, at(1));
  EXPECT_EQ(drawn(kMarkers, at(1)).size(), 1u);  // the others in the array are kept
  EXPECT_EQ(dropped(kMarkers).at("scale is not finite or absurdly large"), 1u);
}

TEST_F(ProjectorSceneTest, refusesHeadersWithoutAPlaceOrTime) {
  add(cube(1, ""), at(0));
  add(cube(2, "/"), at(0));
  Marker m = cube(3);
  m.header.stamp.sec = 5;
  m.header.stamp.nsec = 2'000'000'000u;
  add(m, at(0));
  m = cube(4);
  m.action = 99;
  add(m, at(0));
  EXPECT_TRUE(drawn(kMarkers, at(0)).empty());
  EXPECT_EQ(dropped(kMarkers).at("frame_id is empty"), 2u);
  EXPECT_EQ(dropped(kMarkers).at("stamp is no time"), 1u);
  EXPECT_EQ(dropped(kMarkers).at("unknown action"), 1u);
}

TEST_F(ProjectorSceneTest, bearsStrangeFramesAndBoundsWhatItRemembers) {
  for (int i = 0; i < 100; ++i) {
    add(cube(i, std::string(65536, static_cast<char>('a' + i % 26)) + std::to_string(i)), at(0));
    add(cube(i, "\xff\xfe frame " + std::to_string(i)), at(0));
  }
  scene.update(at(20));
  EXPECT_LE(dropped(kMarkers).size(), 33u);
  for (const auto& [reason, count] : dropped(kMarkers)) EXPECT_LT(reason.size(), 150u);
}

TEST_F(ProjectorSceneTest, boundsTheNumberOfMarkers) {
  for (int i = 0; i < 20'100; ++i) add(cube(i), at(0));
  EXPECT_EQ(scene.status()[kMarkers].shown, 20'000u);
  EXPECT_EQ(dropped(kMarkers).at("too many markers"), 100u);
}

// ------------------------------------------------------------------------------- clouds and paths

TEST_F(ProjectorSceneTest, keepsTheNewestCloudAndClearsOnAnEmptyOne) {
  scene.add(kCloud, cloudMessage("map", {{1, 0, 0}, {2, 0, 0}}), at(0));
  scene.add(kCloud, cloudMessage("map", {{3, 0, 0}}), at(1));
  ASSERT_EQ(drawn(kCloud, at(100)).size(), 1u);
  const auto cloud = std::get<render::PointCloud>(drawn(kCloud, at(100))[0].shape);
  EXPECT_EQ(cloud.points.size(), 1u);
  auto bad = cloudMessage("map", {{4, 0, 0}});
  bad.data.clear();
  scene.add(kCloud, bad, at(2));  // keeps the last
  EXPECT_EQ(drawn(kCloud, at(2)).size(), 1u);
  EXPECT_EQ(dropped(kCloud).at("data is shorter than declared"), 1u);
  scene.add(kCloud, sensor_msgs::PointCloud2(), at(3));
  EXPECT_TRUE(drawn(kCloud, at(3)).empty());
}

TEST_F(ProjectorSceneTest, keepsOnlyAsManyWaitingCloudsAsRViz) {
  for (int i = 0; i < 15; ++i) scene.add(kCloud, cloudMessage("nowhere", {{1, 0, 0}}), at(i * 0.1));
  EXPECT_EQ(scene.status()[kCloud].waiting, 10u);
  EXPECT_EQ(dropped(kCloud).at("too many waiting: no transform from 'nowhere' to 'map'"), 5u);
}

TEST_F(ProjectorSceneTest, drawsPathsAndClearsThem) {
  nav_msgs::Path path;
  path.header.frame_id = "map";
  path.poses.resize(2);
  path.poses[1].pose.position.x = 1;
  scene.add(kPath, path, at(0));
  EXPECT_EQ(drawn(kPath, at(0)).size(), 1u);
  scene.add(kPath, nav_msgs::Path(), at(1));
  EXPECT_TRUE(drawn(kPath, at(1)).empty());
}

// -------------------------------------------------------------------------------------- projector

TEST_F(ProjectorSceneTest, staysDarkWithoutTheProjectorsPose) {
  SceneSnapshot snapshot = scene.snapshot(at(0));
  EXPECT_FALSE(snapshot.T_projector_world);
  EXPECT_EQ(snapshot.problems.at(0), "projector: no transform from 'projector' to 'map'");
  transform("projector", 2, at(0));
  snapshot = scene.snapshot(at(1));
  ASSERT_TRUE(snapshot.T_projector_world);
  EXPECT_DOUBLE_EQ(snapshot.T_projector_world->matrix().translation().x(), -2);
  EXPECT_TRUE(snapshot.problems.empty());
  snapshot = scene.snapshot(at(2.1));
  EXPECT_FALSE(snapshot.T_projector_world);
  EXPECT_EQ(snapshot.problems.at(0),
            "projector: the transform from 'projector' to 'map' is stale: 'projector' in 'map' is "
            "2 s old");
}

TEST_F(ProjectorSceneTest, trustsAStaticPoseForever) {
  transform("projector", 2, at(0), true);
  EXPECT_TRUE(scene.snapshot(at(1e6)).T_projector_world);
}

TEST_F(ProjectorSceneTest, drawsAMovingProjectorForWhenItsLightLeaves) {
  ProjectorConfig late = config();
  late.projectors[0].latency_ns = 100'000'000;
  ProjectorScene late_scene(late, buffer);
  for (int i = 0; i <= 10; ++i) transform("projector", i * 0.02, at(i * 0.01));  // 2 m/s
  const auto T = late_scene.snapshot(at(0.12)).T_projector_world;
  ASSERT_TRUE(T);
  EXPECT_NEAR(T->inverse().matrix().translation().x(), 2 * 0.22, 1e-6);
  EXPECT_NEAR(scene.snapshot(at(0.12)).T_projector_world->inverse().matrix().translation().x(), 0.2,
              1e-9);  // without latency: the newest as it is
}

/// A projector on the arm of a turret that turns at 1 rad/s, its tf at 50 Hz and a little late,
/// angles in encoder counts.
class TurningTurret : public ::testing::Test {
 protected:
  static constexpr double kLatency = 0.05, kCount = 1e-4;

  static Eigen::Isometry3d turret(double angle) {
    return Eigen::Translation3d(0.3, 0.1, 1) * Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ());
  }
  static Eigen::Isometry3d armToProjector() {
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.translate(Eigen::Vector3d(0.15, 0.05, 0.2));
    T.rotate(Eigen::AngleAxisd(-M_PI / 2, Eigen::Vector3d::UnitZ()));  // optical: z along x
    T.rotate(Eigen::AngleAxisd(-M_PI / 2 - 0.7, Eigen::Vector3d::UnitX()));
    return T;
  }

  void publish(const std::string& parent, const std::string& child, const Eigen::Isometry3d& T,
               ros::Time stamp, bool is_static) {
    geometry_msgs::TransformStamped message;
    message.header.frame_id = parent;
    message.child_frame_id = child;
    message.header.stamp = stamp;
    message.transform = toTransform(T);
    buffer.setTransform(message, "test", is_static);
  }

  /// Transforms of up to `seconds`.
  void turnUntil(double seconds) {
    publish("turret", "projector", armToProjector(), {}, true);
    for (; published * 0.02 <= seconds; ++published) {
      const double angle = std::round(published * 0.02 / kCount) * kCount;
      publish("map", "turret", turret(angle), at(published * 0.02), false);
    }
  }

  /// The farthest that light meant for points of the floor misses them, drawn at `seconds`.
  static double miss(const Rigid<Projector, World>& T_projector_world, double seconds) {
    const Eigen::Isometry3d truth = turret(seconds + kLatency) * armToProjector();
    double worst = 0;
    for (const double ahead : {0.8, 1.5, 2.5}) {
      for (const double aside : {-0.5, 0.0, 0.5}) {
        Eigen::Vector3d p = turret(seconds) * Eigen::Vector3d(ahead, aside, 0);
        p.z() = 0;
        const Eigen::Vector3d ray = truth.linear() * (T_projector_world * p);
        const Eigen::Vector3d eye = truth.translation();
        EXPECT_LT(ray.z(), 0);
        worst = std::max(worst, (eye - ray * (eye.z() / ray.z()) - p).norm());
      }
    }
    return worst;
  }

  tf2::BufferCore buffer;
  int published = 0;
};

TEST_F(TurningTurret, leavesLightOnTheFloorWhereItIs) {
  ProjectorConfig late = config();
  late.projectors[0].latency_ns = static_cast<std::int64_t>(kLatency * 1e9);
  ProjectorScene late_scene(late, buffer), prompt_scene(config(), buffer);
  for (int frame = 0; frame < 60; ++frame) {
    const double now = 0.2 + frame * 0.0337;
    turnUntil(now - 0.008);
    const auto T = late_scene.snapshot(at(now)).T_projector_world;
    ASSERT_TRUE(T);
    ASSERT_LT(miss(*T, now), 0.002) << now;
    EXPECT_GT(miss(*prompt_scene.snapshot(at(now)).T_projector_world, now),
              0.04);  // what latency costs
  }
}

TEST_F(TurningTurret, isDrawnForTheEndOfItsDrawing) {
  ProjectorConfig late = config();
  late.projectors[0].latency_ns = static_cast<std::int64_t>(kLatency * 1e9);
  ProjectorScene late_scene(late, buffer);
  turnUntil(1);
  late_scene.update(at(1));
  std::vector<std::string> problems;
  const auto T = late_scene.projectorPose(0, at(1), 15'000'000, problems);
  ASSERT_TRUE(T);
  EXPECT_LT(miss(*T, 1.015), 0.002);
  EXPECT_GT(miss(*T, 1), 0.01);
}

TEST_F(TurningTurret, tellsHowFarItsLightWasFromItsPlace) {
  ProjectorConfig late = config();
  late.projectors[0].latency_ns = static_cast<std::int64_t>(kLatency * 1e9);
  ProjectorScene good(late, buffer);
  late.projectors[0].latency_ns = 1;  // it is not
  ProjectorScene wrong(late, buffer);
  turnUntil(1);
  EXPECT_FALSE(good.lightOffset(0).mm());
  for (ProjectorScene* scene : {&good, &wrong}) {
    const auto T = scene->snapshot(at(1)).T_projector_world;
    ASSERT_TRUE(T);
    scene->noteLight(0, scene == &good ? at(1) : at(1 + kLatency), *T);
    EXPECT_FALSE(scene->lightOffset(0).mm());
  }
  turnUntil(1.1);
  for (ProjectorScene* scene : {&good, &wrong}) {
    const auto T = scene->snapshot(at(1.1)).T_projector_world;
    scene->noteLight(0, at(1.1), *T);
    ASSERT_TRUE(scene->lightOffset(0).mm());
  }
  EXPECT_LT(*good.lightOffset(0).mm(), 2);
  EXPECT_GT(*wrong.lightOffset(0).mm(), 50);
}

TEST_F(TurningTurret, isNotMisledWhenLocalizationLeaps) {
  ProjectorConfig late = config();
  late.projectors[0].latency_ns = static_cast<std::int64_t>(kLatency * 1e9);
  ProjectorScene scene(late, buffer);
  publish("turret", "projector", armToProjector(), {}, true);
  for (int i = 0; i <= 50; ++i) {
    const Eigen::Isometry3d correction(Eigen::Translation3d(i < 49 ? 0.03 : 0.0, 0, 0));
    publish("map", "odom", correction, at(i * 0.02), false);
    publish("odom", "turret", turret(i * 0.02), at(i * 0.02), false);
  }
  const auto T = scene.snapshot(at(1.005)).T_projector_world;
  ASSERT_TRUE(T);
  EXPECT_LT(miss(*T, 1.005), 0.002);
}

/// A projector 2 m ahead of a base that stood until it was told at 1 s to turn at 0.5 rad/s, which
/// it approaches by 3 rad/s^2; drawn at `now` for 40 ms later, tf every 20 ms.
class StartingBase : public TurningTurret {
 protected:
  static double yawAt(double seconds) {
    const double since = std::max(0.0, seconds - 1 - kDelay), speeding = 0.5 / 3;
    return since < speeding ? 1.5 * since * since : 0.5 * (since - speeding / 2);
  }
  double missAt(double now, bool has_commands, bool obeys = true) {
    ProjectorConfig late = config();
    late.projectors[0].latency_ns = 40'000'000;
    if (has_commands) late.base = BaseConfig{"/cmd_vel", "base_link", 0.75, 3, 10'000'000};
    ProjectorScene scene(late, buffer);
    publish("base_link", "projector", Eigen::Isometry3d(Eigen::Translation3d(2, 0, 1)), {}, true);
    const auto pose = [&](double seconds) {
      return Eigen::Isometry3d(
          Eigen::Translation3d(3, 1, 0) *
          Eigen::AngleAxisd(obeys ? yawAt(seconds) : 0, Eigen::Vector3d::UnitZ()));
    };
    geometry_msgs::Twist command;
    for (int i = 0; i * 0.02 <= now; ++i) {
      const double seconds = i * 0.02;
      publish("map", "odom", Eigen::Isometry3d::Identity(), at(seconds), false);
      publish("odom", "base_link", pose(seconds), at(seconds), false);
      command.angular.z = i < 50 ? 0 : 0.5;
      scene.addCommand(command, at(seconds));
    }
    const auto T = scene.snapshot(at(now)).T_projector_world;
    if (!T) return std::nan("");
    const Eigen::Vector3d meant = pose(now + 0.04) * Eigen::Vector3d(2, 0, 1);
    return 1000 * (T->inverse().matrix().translation() - meant).norm();
  }
  static constexpr double kDelay = 0.01;
};

TEST_F(StartingBase, isDrawnForWhereItsCommandsTakeIt) {
  for (const double now : {1.001, 1.011, 1.033, 1.07, 1.12, 1.17, 1.2, 1.4}) {
    EXPECT_LT(missAt(now, true), 0.5) << now << " s";
  }
  EXPECT_GT(missAt(1.07, false), 10) << "mm, as tf alone has it";
  EXPECT_LT(missAt(1.4, false), 0.5);
}

TEST_F(StartingBase, isTakenForStandingWhereItDoesNotObey) {
  EXPECT_LT(missAt(1.07, true, false), 25) << "mm, while it could still be beginning";
  EXPECT_LT(missAt(1.3, true, false), 0.01);
}

TEST_F(TurningTurret, isDarkOnceNobodyKnowsHowItWentOn) {
  ProjectorConfig late = config();
  late.projectors[0].latency_ns = static_cast<std::int64_t>(kLatency * 1e9);
  ProjectorScene late_scene(late, buffer);
  turnUntil(1);
  EXPECT_TRUE(late_scene.snapshot(at(1.4)).T_projector_world);
  const SceneSnapshot snapshot = late_scene.snapshot(at(1.5));
  EXPECT_FALSE(snapshot.T_projector_world);
  EXPECT_EQ(snapshot.problems.at(0),
            "projector: it moves, and the transform from 'projector' to 'map' is too old to say "
            "where to");
}

TEST_F(TurningTurret, servesSeveralProjectorsFromOneScene) {
  ProjectorConfig two = config();
  two.projectors.push_back({});
  two.projectors[1].frame = "elsewhere";
  ProjectorScene both(two, buffer);
  turnUntil(1);
  std::vector<std::string> problems, of_second;
  both.scene(at(1), problems);
  EXPECT_TRUE(problems.empty());
  EXPECT_TRUE(both.projectorPose(0, at(1), 0, problems));
  EXPECT_FALSE(both.projectorPose(1, at(1), 0, of_second));
  EXPECT_TRUE(problems.empty());
  EXPECT_EQ(of_second.at(0), "projector: no transform from 'elsewhere' to 'map'");
}

TEST(ProjectorPose, goesOnAlongItsScrew) {
  const auto pose = [](double turn) {
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    const Eigen::Vector3d pivot(2, -1, 0), axis(0, 0, 1);
    T.translate(pivot + 0.3 * turn * axis);
    T.rotate(Eigen::AngleAxisd(turn, axis));
    T.translate(Eigen::Vector3d(0.5, 0, 0.1));
    T.rotate(Eigen::AngleAxisd(1, Eigen::Vector3d::UnitX()));
    return T;
  };
  for (const double step : {0.5, 1e-3, 1e-5, 1e-8}) {
    const auto T = extrapolate({pose(1), 1'000}, {pose(1 + step), 2'000}, 5'000);
    EXPECT_LT((T.matrix() - pose(1 + 4 * step).matrix()).norm(), 1e-7) << step;
  }
  Eigen::Isometry3d ahead = pose(1);
  ahead.translation().y() += 1;
  EXPECT_NEAR(
      extrapolate({pose(1), 1}, {ahead, 2}, 4).translation().y() - pose(1).translation().y(), 3,
      1e-9);
}

TEST(ProjectorPose, goesOnTurningAboutItsAxis) {
  StampedPose a{Eigen::Isometry3d::Identity(), 1'000}, b = a;
  b.stamp_ns = 2'000;
  b.T_fixed_frame.rotate(Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitZ()));
  const Eigen::Isometry3d T = extrapolate(a, b, 5'000);
  EXPECT_TRUE(T.linear().isApprox(
      Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitZ()).toRotationMatrix(), 1e-9));
  EXPECT_NEAR(T.translation().norm(), 0, 1e-12);
}

// --------------------------------------------------------------------------------------- surfaces

TEST(ProjectorSceneSurface, drawsALayerOnlyWhereItsSurfaceAndViewerAre) {
  ProjectorConfig on_table = config();
  on_table.surfaces.resize(1);
  on_table.surfaces[0].name = "table";
  on_table.surfaces[0].frame = "table_frame";
  on_table.surfaces[0].gain = 0.5f;
  on_table.layers[kMarkers].surface = 0;
  on_table.layers[kMarkers].placement = render::Placement::Viewer;
  on_table.layers[kMarkers].viewer = ViewerConfig{"map", {0, 0, 1.6}};
  tf2::BufferCore buffer;
  ProjectorScene scene(on_table, buffer);
  SceneSnapshot snapshot = scene.snapshot(at(0));
  EXPECT_EQ(snapshot.scene.layers.size(), 2u);
  EXPECT_EQ(snapshot.problems.back(), "surface 'table': no transform from 'table_frame' to 'map'");
  geometry_msgs::TransformStamped table;
  table.header.frame_id = "map";
  table.child_frame_id = "table_frame";
  table.transform.translation.z = 0.7;
  table.transform.rotation.w = 1;
  buffer.setTransform(table, "test", true);
  snapshot = scene.snapshot(at(0));
  ASSERT_EQ(snapshot.scene.layers.size(), 3u);
  EXPECT_EQ(snapshot.scene.layers[kMarkers].p_viewer, Eigen::Vector3d(0, 0, 1.6));
  EXPECT_EQ(snapshot.scene.layers[kMarkers].gain, 0.5f);
  EXPECT_EQ(snapshot.scene.layers[kCloud].gain, 1);
  table.transform.translation.z = 1.7;  // over the viewer's head
  buffer.setTransform(table, "test", true);
  snapshot = scene.snapshot(at(0));
  EXPECT_EQ(snapshot.problems.back(), "viewer: not above surface 'table'");
}

TEST(ProjectorSceneSurface, laysTextForAReaderWhileHeIsKnown) {
  ProjectorConfig on_floor = config();
  on_floor.surfaces.resize(1);
  on_floor.surfaces[0].name = "floor";
  on_floor.surfaces[0].frame = "map";
  on_floor.layers[kMarkers].surface = 0;
  on_floor.layers[kMarkers].placement = render::Placement::Drape;
  on_floor.layers[kMarkers].reader = ReaderConfig{"person", {0, 0, 1.6}, false};
  tf2::BufferCore buffer;
  ProjectorScene scene(on_floor, buffer);
  SceneSnapshot snapshot = scene.snapshot(at(0));
  EXPECT_EQ(snapshot.scene.layers.size(), 2u);
  EXPECT_EQ(snapshot.problems.back(), "reader: no transform from 'person' to 'map'");
  geometry_msgs::TransformStamped person;
  person.header.frame_id = "map";
  person.child_frame_id = "person";
  person.transform.translation.y = 2;
  person.transform.rotation.w = 1;
  buffer.setTransform(person, "test", true);
  snapshot = scene.snapshot(at(0));
  ASSERT_EQ(snapshot.scene.layers.size(), 3u);
  ASSERT_TRUE(snapshot.scene.layers[kMarkers].reader);
  EXPECT_EQ(snapshot.scene.layers[kMarkers].reader->p_world, Eigen::Vector3d(0, 2, 1.6));
}

}  // namespace
}  // namespace afterglow::nodes::projector_scene_test
