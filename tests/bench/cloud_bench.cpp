// A depth camera's cloud, from the bytes of its message to the finished picture.
#include <benchmark/benchmark.h>
#include <ros/serialization.h>
#include <tf2/buffer_core.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <random>
#include <vector>

#include "nodes/conversion/geometry_conversion.hpp"
#include "nodes/projector/projector_scene.hpp"
#include "render/projector_renderer.hpp"
#include "tests/support/cloud_messages.hpp"
#include "tests/support/optics.hpp"

namespace afterglow::render {
namespace {

const std::vector<double> kBent = {-0.2, 0.05, 0.001, -0.001, 0};

constexpr std::size_t kColorAt = 16;  // in a point

/// Rows of points as a depth camera sees a table with things on it, rgb, 32 bytes a point.
std::vector<std::uint8_t> cloudBytes(int columns, int rows) {
  std::mt19937 random(4);
  std::normal_distribution<float> noise(0, 0.002f);
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < columns * rows; ++i) {
    const float across = static_cast<float>(i % columns) / static_cast<float>(columns) - 0.5f;
    const float down = static_cast<float>(i / columns) / static_cast<float>(rows) - 0.5f;
    const float depth = 1.5f + 0.1f * std::sin(20 * across) * std::cos(15 * down) + noise(random);
    points.emplace_back(1.1f * across * depth, 0.7f * down * depth, depth);
  }
  sensor_msgs::PointCloud2 message = test::cloudMessage("camera", points, 32);
  message.width = static_cast<std::uint32_t>(columns);
  message.height = static_cast<std::uint32_t>(rows);
  message.row_step = 32 * message.width;
  sensor_msgs::PointField field = message.fields.back();
  field.name = "rgb";
  field.offset = kColorAt;
  message.fields.push_back(field);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::uint32_t rgb = random() & 0xffffff;
    std::memcpy(&message.data[32 * i + kColorAt], &rgb, sizeof(rgb));
  }
  std::vector<std::uint8_t> bytes(ros::serialization::serializationLength(message));
  ros::serialization::OStream stream(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
  ros::serialization::serialize(stream, message);
  return bytes;
}

void setStaticTransform(tf2::BufferCore& transforms, const std::string& child,
                        const Eigen::Isometry3d& T_map_child) {
  geometry_msgs::TransformStamped transform;
  transform.header.frame_id = "map";
  transform.child_frame_id = child;
  transform.transform = nodes::toTransform(T_map_child);
  transforms.setTransform(transform, "bench", true);
}

/// A depth camera's image, and how it is shown.
struct Case {
  int columns, rows, width, height;
  nodes::CloudStyle style;
  Drawing drawing;
  int pictures = 1;  ///< of each cloud: 2 where it comes at 30 Hz and is shown at 60
};

nodes::ProjectorConfig config(const nodes::CloudStyle& style) {
  nodes::ProjectorConfig config;
  config.fixed_frame = "map";
  config.projectors.resize(1);
  config.projectors[0].frame = "projector";
  nodes::LayerConfig layer;
  layer.topic = "/cloud";
  layer.type = nodes::LayerType::PointCloud2;
  layer.cloud = style;
  config.layers = {layer};
  return config;
}

/// Deserialized, checked and converted, placed by tf, drawn. p99_ms: what 99 of 100 clouds need.
void messageToFrame(benchmark::State& state, const Case& c) {
  std::vector<std::uint8_t> bytes = cloudBytes(c.columns, c.rows);
  tf2::BufferCore transforms;
  const auto T = test::lookAt<Projector>({0.1, -0.2, 0.1}, {0, 0, 1.5}, {0, -1, 0});
  setStaticTransform(transforms, "camera", Eigen::Isometry3d::Identity());
  setStaticTransform(transforms, "projector", T.matrix());
  nodes::ProjectorScene scene(config(c.style), transforms);
  GlContext context;
  ProjectorRenderer renderer(
      context, test::lens(c.width, c.height, 0.9 * c.width, 0.5 * c.width, 0.6 * c.height, kBent),
      c.drawing);
  sensor_msgs::PointCloud2 message;
  Image image;
  std::vector<double> times_ms;
  std::uint8_t bit = 1;
  for (auto _ : state) {
    const auto begin = std::chrono::steady_clock::now();
    ros::serialization::IStream stream(const_cast<std::uint8_t*>(bytes.data()),
                                       static_cast<std::uint32_t>(bytes.size()));
    ros::serialization::deserialize(stream, message);
    const std::size_t changed = c.style.color == nodes::ColorSource::Rgb8 ? kColorAt : 0;
    message.data[changed] ^= bit;  // what does not change would not be drawn
    bit ^= 1;
    scene.add(0, message, ros::Time(1));
    for (int i = 0; i < c.pictures; ++i) {
      const nodes::SceneSnapshot snapshot = scene.snapshot(ros::Time(1));
      renderer.render(snapshot.scene, *snapshot.T_projector_world, image);
    }
    const std::chrono::duration<double, std::milli> taken =
        std::chrono::steady_clock::now() - begin;
    times_ms.push_back(taken.count());
  }
  const auto lit = std::count_if(image.rgb.begin(), image.rgb.end(), [](auto value) { return value > 0; });
  if (lit == 0) state.SkipWithError("the picture is black");
  std::sort(times_ms.begin(), times_ms.end());
  state.counters["p99_ms"] = times_ms[(times_ms.size() * 99 - 1) / 100];
  state.counters["lit_share"] = static_cast<double>(lit) / static_cast<double>(image.rgb.size());
}

void cloud(const char* name, const Case& c) {
  benchmark::RegisterBenchmark(name, messageToFrame, c)
      ->Unit(benchmark::kMillisecond)
      ->UseRealTime()
      ->Iterations(c.drawing == Drawing::Gl ? 20 : 300);
}

const bool kRegistered = [] {
  constexpr auto kMeasured = Drawing::Measured;
  const nodes::CloudStyle colored{PointStyle::Points, 3, nodes::ColorSource::Rgb8};
  const nodes::CloudStyle flat{PointStyle::Points, 3, nodes::ColorSource::Flat};
  const nodes::CloudStyle boxes{PointStyle::Boxes, 0.004f, nodes::ColorSource::Rgb8};
  cloud("cloud_307200_1280x800", {640, 480, 1280, 800, colored, kMeasured});
  cloud("cloud_307200_1280x800_flat", {640, 480, 1280, 800, flat, kMeasured});
  cloud("cloud_307200_1280x800_boxes", {640, 480, 1280, 800, boxes, kMeasured});
  cloud("cloud_307200_1280x800_opengl", {640, 480, 1280, 800, colored, Drawing::Gl});
  cloud("cloud_307200_1920x1080", {640, 480, 1920, 1080, colored, kMeasured});
  cloud("cloud_307200_1920x1080_shown_twice", {640, 480, 1920, 1080, colored, kMeasured, 2});
  cloud("cloud_100000_1920x1080", {400, 250, 1920, 1080, colored, kMeasured});
  return true;
}();

}  // namespace
}  // namespace afterglow::render
