// What reading and rewriting a message costs. The cloud is a Kinect's, the transforms a Fetch's.
#include <benchmark/benchmark.h>

#include "replay/messages/document.hpp"
#include "replay/messages/field_edit.hpp"
#include "replay/plan/rewrite.hpp"
#include "replay/ros2/cdr_conversion.hpp"
#include "tests/support/document_fields.hpp"
#include "tests/support/message_definitions.hpp"

namespace afterglow::replay {
namespace {

struct Sample {
  Channel channel;
  Schema schema;
  Bytes bytes;
};

Sample sample(const std::string& type, const std::string& definition) {
  const Schema schema = Schema::parse(type, definition);
  return {{"/topic", type, std::string(32, '0'), definition, false, "/node"}, schema, {}};
}

const Sample& cloud() {
  static const Sample made = [] {
    constexpr std::uint32_t kPoints = 640 * 480, kStep = 32;
    Sample cloud = sample("sensor_msgs/PointCloud2", test::kPointCloud2);
    Value document = test::zeroDocument(cloud.schema);
    replay::valueAt(document, "header.stamp") = RosTime{100, 0};
    replay::valueAt(document, "width") = kPoints;
    replay::valueAt(document, "point_step") = kStep;
    replay::valueAt(document, "data") = NumberArray{FieldType::UInt8, Bytes(kPoints * kStep)};
    cloud.bytes = encode(cloud.schema, document);
    return cloud;
  }();
  return made;
}

const Sample& transforms() {
  static const Sample made = [] {
    constexpr std::size_t kLinks = 20;
    Sample tf = sample("tf2_msgs/TFMessage", test::kTfMessage);
    tf.bytes.assign(4 + kLinks * tf.schema.minimumSize(1), 0);
    tf.bytes[0] = kLinks;
    Value document = decode(tf.schema, tf.bytes);
    for (Value& transform : std::get<Array>(replay::valueAt(document, "transforms"))) {
      replay::valueAt(transform, "header.stamp") = RosTime{100, 0};
      replay::valueAt(transform, "header.frame_id") = std::string("torso_lift_link");
      replay::valueAt(transform, "child_frame_id") = std::string("shoulder_pan_link");
    }
    tf.bytes = encode(tf.schema, document);
    return tf;
  }();
  return made;
}

void count(benchmark::State& state, const Sample& of) {
  state.SetItemsProcessed(state.iterations());
  state.SetBytesProcessed(state.iterations() * static_cast<std::int64_t>(of.bytes.size()));
}

void decodeMessage(benchmark::State& state, const Sample& (*make)()) {
  const Sample& of = make();
  for (auto _ : state) benchmark::DoNotOptimize(decode(of.schema, of.bytes));
  count(state, of);
}
BENCHMARK_CAPTURE(decodeMessage, PointCloud2_307200, cloud);
BENCHMARK_CAPTURE(decodeMessage, TFMessage_20, transforms);

void editStamps(benchmark::State& state, const Sample& (*make)()) {
  const Sample& of = make();
  const FieldFinder finder(of.schema, test::timeFields(of.schema));
  Bytes bytes = of.bytes;
  for (auto _ : state) {
    const auto found = finder.find(bytes);
    for (const FieldSpan& span : found.front()) writeTime(bytes, span, {1});
    benchmark::ClobberMemory();
  }
  count(state, of);
}
BENCHMARK_CAPTURE(editStamps, PointCloud2_307200, cloud);
BENCHMARK_CAPTURE(editStamps, TFMessage_20, transforms);

void rewriteMessage(benchmark::State& state, const Sample& (*make)()) {
  const Sample& of = make();
  Rewriter rewriter(uniqueGoalIds("/bench"));
  Bytes bytes = of.bytes;
  std::int64_t shift_ns = 1;  // back and forth, so that the stamps stay where they are
  for (auto _ : state) {
    benchmark::DoNotOptimize(rewriter.rewrite(of.channel, {{1}, shift_ns}, bytes));
    shift_ns = -shift_ns;
  }
  count(state, of);
}
BENCHMARK_CAPTURE(rewriteMessage, PointCloud2_307200, cloud);
BENCHMARK_CAPTURE(rewriteMessage, TFMessage_20, transforms);

void convertToRos2(benchmark::State& state, const Sample& (*make)()) {
  const Sample& of = make();
  const CdrConversion conversion(of.schema, of.schema);
  for (auto _ : state) benchmark::DoNotOptimize(conversion.toRos2(of.bytes));
  count(state, of);
}
BENCHMARK_CAPTURE(convertToRos2, PointCloud2_307200, cloud);
BENCHMARK_CAPTURE(convertToRos2, TFMessage_20, transforms);

void convertToRos1(benchmark::State& state, const Sample& (*make)()) {
  const Sample& of = make();
  const CdrConversion conversion(of.schema, of.schema);
  const Bytes cdr = conversion.toRos2(of.bytes);
  for (auto _ : state) benchmark::DoNotOptimize(conversion.toRos1(cdr));
  count(state, of);
}
BENCHMARK_CAPTURE(convertToRos1, PointCloud2_307200, cloud);
BENCHMARK_CAPTURE(convertToRos1, TFMessage_20, transforms);

void readHeaderStamp(benchmark::State& state) {
  const Sample& of = cloud();
  for (auto _ : state) benchmark::DoNotOptimize(headerStamp(of.schema, of.bytes));
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(readHeaderStamp);

void parseDefinition(benchmark::State& state) {
  for (auto _ : state) {
    benchmark::DoNotOptimize(Schema::parse("tf2_msgs/TFMessage", test::kTfMessage));
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(parseDefinition);

}  // namespace
}  // namespace afterglow::replay
