// An array of 2,000 mixed markers, from the bytes of its message to the scene that is to be drawn.
#include <benchmark/benchmark.h>
#include <ros/serialization.h>
#include <tf2/buffer_core.h>
#include <visualization_msgs/MarkerArray.h>

#include <cstdint>
#include <string>
#include <vector>

#include "nodes/projector/projector_scene.hpp"
#include "tests/support/cube_files.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::nodes {
namespace {

using visualization_msgs::Marker;

Marker marker(int i, const std::string& mesh) {
  Marker m;
  m.header.frame_id = i % 2 == 0 ? "map" : "arm";
  m.ns = "namespace " + std::to_string(i % 7);
  m.id = i;
  m.type = i % 12;
  m.pose.position.x = 0.05 * (i % 50);
  m.pose.position.y = 0.05 * (i / 50);
  m.pose.orientation.w = 1;
  m.scale.x = m.scale.y = m.scale.z = 0.04;
  m.color.g = m.color.a = 1;
  m.frame_locked = i % 3 == 0;
  m.text = m.type == Marker::TEXT_VIEW_FACING ? "Text " + std::to_string(i) : "";
  m.mesh_resource = m.type == Marker::MESH_RESOURCE ? mesh : "";
  const bool has_points =
      (m.type >= Marker::LINE_STRIP && m.type <= Marker::POINTS) || m.type == Marker::TRIANGLE_LIST;
  for (int k = 0; has_points && k < 12; ++k) {
    m.points.emplace_back();
    m.points.back().x = 0.003 * k;
    m.points.back().y = 0.002 * (k % 3);
    m.colors.push_back(m.color);
  }
  return m;
}

std::vector<std::uint8_t> arrayBytes(int count, const std::string& mesh) {
  visualization_msgs::MarkerArray array;
  for (int i = 0; i < count; ++i) array.markers.push_back(marker(i, mesh));
  std::vector<std::uint8_t> bytes(ros::serialization::serializationLength(array));
  ros::serialization::OStream stream(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
  ros::serialization::serialize(stream, array);
  return bytes;
}

void setArm(tf2::BufferCore& transforms, double x, ros::Time stamp) {
  geometry_msgs::TransformStamped transform;
  transform.header.frame_id = "map";
  transform.header.stamp = stamp;
  transform.child_frame_id = "arm";
  transform.transform.translation.x = x;
  transform.transform.rotation.w = 1;
  transforms.setTransform(transform, "bench");
}

/// One message and one frame an iteration, as at 60 Hz, with a frame that moves.
void markersToScene(benchmark::State& state) {
  const test::TempFolder folder;
  test::writeFile(folder.path("cube.stl"), test::cubeStl());
  const auto bytes =
      arrayBytes(static_cast<int>(state.range(0)), "file://" + folder.path("cube.stl"));
  ProjectorConfig config;
  config.fixed_frame = "map";
  config.mesh_roots = {folder.path("")};
  config.layers.resize(1);
  config.layers[0].topic = "/markers";
  config.layers[0].type = LayerType::MarkerArray;
  tf2::BufferCore transforms;
  ProjectorScene scene(config, transforms);
  visualization_msgs::MarkerArray message;
  ros::Time now(1000);
  for (auto _ : state) {
    now += ros::Duration(1.0 / 60);
    setArm(transforms, 0.01, now);
    ros::serialization::IStream stream(const_cast<std::uint8_t*>(bytes.data()),
                                       static_cast<std::uint32_t>(bytes.size()));
    ros::serialization::deserialize(stream, message);
    scene.add(0, message, now);
    benchmark::DoNotOptimize(scene.frame(now));
  }
  const std::size_t shown = scene.status()[0].shown;
  if (shown != static_cast<std::size_t>(state.range(0))) state.SkipWithError("some are missing");
}
BENCHMARK(markersToScene)->Arg(2000)->Unit(benchmark::kMillisecond)->UseRealTime();

/// A frame of markers that came before.
void shownMarkersToScene(benchmark::State& state) {
  ProjectorConfig config;
  config.fixed_frame = "map";
  config.layers.resize(1);
  config.layers[0].topic = "/markers";
  config.layers[0].type = LayerType::MarkerArray;
  tf2::BufferCore transforms;
  setArm(transforms, 0, ros::Time(1000));
  ProjectorScene scene(config, transforms);
  visualization_msgs::MarkerArray message;
  for (int i = 0; i < state.range(0); ++i) {
    if (i % 12 != Marker::MESH_RESOURCE) message.markers.push_back(marker(i, ""));
  }
  scene.add(0, message, ros::Time(1000));
  for (auto _ : state) benchmark::DoNotOptimize(scene.frame(ros::Time(1000)));
}
BENCHMARK(shownMarkersToScene)->Arg(2000)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace afterglow::nodes
