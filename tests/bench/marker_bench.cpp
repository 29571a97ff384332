// An array of 2,000 mixed markers, from the bytes of its message to the scene and to the picture.
#include <benchmark/benchmark.h>
#include <ros/serialization.h>
#include <tf2/buffer_core.h>
#include <visualization_msgs/MarkerArray.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "nodes/projector/projector_scene.hpp"
#include "render/projector_renderer.hpp"
#include "tests/support/cube_files.hpp"
#include "tests/support/optics.hpp"
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
  // Solids of 4 cm; of lists each element is small against the whole.
  if (has_points && m.type != Marker::TRIANGLE_LIST) m.scale.x = m.scale.y = m.scale.z = 0.005;
  for (int k = 0; has_points && k < 12; ++k) {
    m.points.emplace_back();
    m.points.back().x = 0.004 * k;
    m.points.back().y = 0.008 * (k % 3);
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

/// One message and one image a step, as at 60 Hz, with a frame that moves.
class MarkerStream {
 public:
  explicit MarkerStream(int count) {
    test::writeFile(folder_.path("cube.stl"), test::cubeStl());
    bytes_ = arrayBytes(count, "file://" + folder_.path("cube.stl"));
    ProjectorConfig config;
    config.fixed_frame = "map";
    config.mesh_roots = {folder_.path("")};
    config.layers.resize(1);
    config.layers[0].topic = "/markers";
    config.layers[0].type = LayerType::MarkerArray;
    scene_.emplace(config, transforms_);
  }

  SceneSnapshot step() {
    arm_x_ = arm_x_ > 0.02 ? 0.01 : arm_x_ + 1e-4;
    passTime();
    ros::serialization::IStream stream(bytes_.data(), static_cast<std::uint32_t>(bytes_.size()));
    ros::serialization::deserialize(stream, message_);
    scene_->add(0, message_, now_);
    return scene_->snapshot(now_);
  }
  /// A message of one marker, which has moved; nothing else has.
  SceneSnapshot stepOfOne() {
    passTime();
    visualization_msgs::MarkerArray message;
    message.markers = {message_.markers[kMoving]};
    message.markers[0].pose.position.x += moved_m_ += 1e-4;
    scene_->add(0, message, now_);
    return scene_->snapshot(now_);
  }
  /// No message comes, and nothing moves.
  SceneSnapshot stepWithoutMessage() {
    passTime();
    return scene_->snapshot(now_);
  }
  std::size_t shown() const { return scene_->status()[0].shown; }

 private:
  static constexpr std::size_t kMoving = 1020;  // an arrow in the middle, in "map"

  void passTime() {
    now_ += ros::Duration(1.0 / 60);
    setArm(transforms_, arm_x_, now_);
  }

  test::TempFolder folder_;
  std::vector<std::uint8_t> bytes_;
  tf2::BufferCore transforms_;
  std::optional<ProjectorScene> scene_;
  visualization_msgs::MarkerArray message_;
  ros::Time now_{1000};
  double arm_x_ = 0.01, moved_m_ = 0;
};

void markersToScene(benchmark::State& state) {
  MarkerStream stream(static_cast<int>(state.range(0)));
  for (auto _ : state) benchmark::DoNotOptimize(stream.step());
  if (stream.shown() != static_cast<std::size_t>(state.range(0))) {
    state.SkipWithError("some are missing");
  }
}
BENCHMARK(markersToScene)->Arg(2000)->Unit(benchmark::kMillisecond)->UseRealTime();

/// The same, drawn from above. p99_ms: what 99 of 100 frames need.
void markersToPicture(benchmark::State& state, SceneSnapshot (MarkerStream::*step)()) {
  MarkerStream stream(2000);
  render::GlContext context;
  render::ProjectorRenderer renderer(
      context, test::lens(1280, 800, 1100, 640, 500, {-0.2, 0.05, 0.001, -0.001, 0}),
      render::Drawing::Measured);
  const auto T_projector_world =
      test::lookAt<Projector>({1.2, 1, 2.5}, {1.2, 1.01, 0}, {0, 1, 0}).inverse();
  render::Image image;
  std::vector<double> times_ms;
  stream.step();
  for (auto _ : state) {
    const auto begin = std::chrono::steady_clock::now();
    const SceneSnapshot snapshot = (stream.*step)();
    renderer.render(snapshot.scene, T_projector_world, image);
    times_ms.push_back(
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin)
            .count());
  }
  const auto lit = std::count_if(image.rgb.begin(), image.rgb.end(), [](auto c) { return c > 0; });
  std::sort(times_ms.begin(), times_ms.end());
  state.counters["p99_ms"] = times_ms[(times_ms.size() * 99 - 1) / 100];
  state.counters["lit_share"] = static_cast<double>(lit) / static_cast<double>(image.rgb.size());
}
BENCHMARK_CAPTURE(markersToPicture, anew, &MarkerStream::step)
    ->Name("markers_2000_1280x800")
    ->Iterations(300)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(markersToPicture, oneMoves, &MarkerStream::stepOfOne)
    ->Name("markers_2000_1280x800_one_moves")
    ->Iterations(300)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(markersToPicture, unchanged, &MarkerStream::stepWithoutMessage)
    ->Name("markers_2000_1280x800_unchanged")
    ->Iterations(300)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

/// A snapshot of markers that came before.
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
  for (auto _ : state) benchmark::DoNotOptimize(scene.snapshot(ros::Time(1000)));
}
BENCHMARK(shownMarkersToScene)->Arg(2000)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace afterglow::nodes
