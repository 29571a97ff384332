// What record_beside_rosbag.py records: one topic at a steady rate, to recorder_node and whoever
// else subscribes. Prints a line of JSON at each step:
//   record_load RATE BYTES SECONDS SUBSCRIBERS
#include <afterglow/StartRecording.h>
#include <afterglow/StopRecording.h>
#include <ros/ros.h>
#include <sensor_msgs/CompressedImage.h>

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <thread>

namespace {

using namespace afterglow;
using Clock = std::chrono::steady_clock;

constexpr const char* kTopic = "/load";

double secondsSince(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

template <class Service>
typename Service::Response call(const std::string& name, const typename Service::Request& request) {
  typename Service::Response response;
  if (!ros::service::waitForService(name, ros::Duration(20)) ||
      !ros::service::call(name, request, response) || !response.success) {
    throw std::runtime_error(name + ": " + response.message);
  }
  return response;
}

/// Returns how many were published; the publisher numbers them in header.seq.
std::uint64_t publish(const ros::Publisher& publisher, double rate, std::size_t bytes,
                      double seconds) {
  sensor_msgs::CompressedImage message;
  message.format = "load";
  message.data.resize(bytes);
  const auto begin = Clock::now();
  const auto count = static_cast<std::uint64_t>(rate * seconds);
  for (std::uint64_t i = 0; i < count; ++i) {
    std::this_thread::sleep_until(
        begin + std::chrono::duration_cast<Clock::duration>(
                    std::chrono::duration<double>(static_cast<double>(i) / rate)));
    message.header.stamp = ros::Time::now();
    for (std::size_t at = i % 61; at < bytes; at += 61) {
      message.data[at] = static_cast<std::uint8_t>(i + at);
    }
    publisher.publish(message);
  }
  return count;
}

void run(double rate, std::size_t bytes, double seconds, std::uint32_t subscribers) {
  ros::NodeHandle node;
  const ros::Publisher publisher = node.advertise<sensor_msgs::CompressedImage>(kTopic, 0);
  StartRecording::Request start;
  start.name = "load";
  start.topics = {kTopic};
  StopRecording::Request stop;
  stop.outcome = "success";
  stop.behavior_id = call<StartRecording>("/recorder_node/start_recording", start).behavior_id;
  for (int i = 0; publisher.getNumSubscribers() < subscribers; ++i) {
    if (i > 2000) throw std::runtime_error("not enough subscribers");
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  std::printf("{\"ready\": true}\n");
  std::fflush(stdout);
  if (std::getchar() == EOF) return;
  const auto begin = Clock::now();
  const std::uint64_t published = publish(publisher, rate, bytes, seconds);
  const double published_in = secondsSince(begin);
  const auto stopped = call<StopRecording>("/recorder_node/stop_recording", stop);
  std::printf(
      "{\"published\": %llu, \"published_in\": %.4f, \"stopped_in\": %.4f, \"behavior\": %lld, "
      "\"recorded\": %llu, \"dropped\": %llu}\n",
      static_cast<unsigned long long>(published), published_in, secondsSince(begin),
      static_cast<long long>(stop.behavior_id), static_cast<unsigned long long>(stopped.messages),
      static_cast<unsigned long long>(stopped.dropped));
  std::fflush(stdout);
  std::getchar();  // rosbag may still be reading
}

}  // namespace

int main(int argc, char** argv) {
  ros::init(argc, argv, "record_load", ros::init_options::NoSigintHandler);
  if (argc != 5) {
    std::fprintf(stderr, "usage: record_load RATE BYTES SECONDS SUBSCRIBERS\n");
    return 2;
  }
  try {
    run(std::atof(argv[1]), std::strtoull(argv[2], nullptr, 10), std::atof(argv[3]),
        static_cast<std::uint32_t>(std::atoi(argv[4])));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "record_load: %s\n", error.what());
    return 1;
  }
  return 0;
}
