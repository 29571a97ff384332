// How exactly a replay keeps the recorded rhythm, seen by a subscriber of its own: `afterglow play`
// beside `rosbag play`, and beside a third player if one is given, on the same messages,
// alternately, in one run. A 100 Hz stream of velocities and a 30 Hz stream of markers. Prints
// figures and each player's median p99; run by hand on a machine that has nothing else to do:
//   replay_timing [seconds] [rounds] [fifo|normal] [third player's command, the bag behind it]
// "normal" keeps afterglow from trying SCHED_FIFO. player_beside_rosbag.py runs all of it.
#include <geometry_msgs/Twist.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <visualization_msgs/MarkerArray.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <map>
#include <string>
#include <vector>

#include "nodes/player/realtime.hpp"
#include "replay/record/snapshot.hpp"
#include "replay/store/open/open_store.hpp"
#include "replay/store/store.hpp"
#include "tests/support/node_process.hpp"
#include "tests/support/ros_master.hpp"
#include "tests/support/temp_folder.hpp"

namespace {

using namespace afterglow;

template <typename M>
replay::Channel channelOf(const std::string& topic) {
  namespace traits = ros::message_traits;
  return {topic,
          traits::DataType<M>::value(),
          traits::MD5Sum<M>::value(),
          traits::Definition<M>::value(),
          false,
          "/bench"};
}

template <typename M>
replay::Bytes serialized(const M& message) {
  replay::Bytes bytes(ros::serialization::serializationLength(message));
  ros::serialization::OStream stream(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
  ros::serialization::serialize(stream, message);
  return bytes;
}

/// Tells velocities apart, m/s: slower ones than a robot may go, at which a motion is refused.
constexpr double kStep = 1e-3;

replay::Bytes twist(int index) {
  geometry_msgs::Twist message;
  message.linear.x = kStep * (index + 1);
  return serialized(message);
}

replay::Bytes markers(int index) {
  visualization_msgs::MarkerArray message;
  message.markers.resize(20);
  message.markers.front().id = index;  // tells them apart
  return serialized(message);
}

/// Arrivals of one stream, by index; seconds on the steady clock.
using Arrivals = std::map<int, double>;

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

struct Stream {
  double rate_hz;
  int count;
  Arrivals arrivals;
};

class Subscriber {
 public:
  Subscriber(double seconds) {
    streams_["cmd"] = {100, static_cast<int>(100 * seconds), {}};
    streams_["ar"] = {30, static_cast<int>(30 * seconds), {}};
    node_.setCallbackQueue(&queue_);
    const auto hints = ros::TransportHints().tcpNoDelay();
    twists_ = node_.subscribe<geometry_msgs::Twist>(
        "/bench/cmd", 1000,
        [this](const geometry_msgs::TwistConstPtr& m) {
          arrive("cmd", static_cast<int>(std::lround(m->linear.x / kStep)) - 1);
        },
        ros::VoidConstPtr(), hints);
    markers_ = node_.subscribe<visualization_msgs::MarkerArray>(
        "/bench/ar", 1000,
        [this](const visualization_msgs::MarkerArrayConstPtr& m) {
          const bool clears = m->markers.front().action == visualization_msgs::Marker::DELETEALL;
          arrive("ar", clears ? -1 : m->markers.front().id);
        },
        ros::VoidConstPtr(), hints);
    spinner_.start();
  }
  ~Subscriber() { spinner_.stop(); }

  std::map<std::string, Stream> take() {
    const std::lock_guard<std::mutex> lock(mutex_);
    std::map<std::string, Stream> taken = streams_;
    for (auto& [name, stream] : streams_) stream.arrivals.clear();
    return taken;
  }

 private:
  void arrive(const std::string& stream, int index) {
    const double at = now();
    const std::lock_guard<std::mutex> lock(mutex_);
    // The zero velocity and the clearing markers at the end are no messages of the recording.
    if (index >= 0) streams_.at(stream).arrivals.emplace(index, at);
  }

  std::mutex mutex_;
  std::map<std::string, Stream> streams_;
  ros::CallbackQueue queue_;
  ros::NodeHandle node_;
  ros::Subscriber twists_, markers_;
  ros::AsyncSpinner spinner_{1, &queue_};
};

struct Figures {
  double p50 = 0, p99 = 0, max = 0, drift = 0;  ///< milliseconds
  std::size_t missing = 0;
};

double quantile(std::vector<double> values, double q) {
  if (values.empty()) return NAN;
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(q * static_cast<double>(values.size() - 1))];
}

/// Of two in the middle, their mean.
double median(const std::vector<double>& values) {
  if (values.empty()) return NAN;
  std::vector<double> sorted = values;
  std::sort(sorted.begin(), sorted.end());
  const std::size_t half = sorted.size() / 2;
  return sorted.size() % 2 == 1 ? sorted[half] : (sorted[half - 1] + sorted[half]) / 2;
}

/// Errors against the recorded schedule, relative to their median; drift: last second less first.
Figures measure(const Stream& stream) {
  std::vector<double> errors, sizes;
  for (const auto& [index, at] : stream.arrivals) {
    errors.push_back(1e3 * (at - index / stream.rate_hz));
  }
  const double middle = quantile(errors, 0.5);
  for (const double error : errors) sizes.push_back(std::abs(error - middle));
  const auto second = static_cast<std::ptrdiff_t>(stream.rate_hz);
  Figures figures;
  figures.p50 = quantile(sizes, 0.5);
  figures.p99 = quantile(sizes, 0.99);
  figures.max = quantile(sizes, 1);
  if (errors.size() > 2 * static_cast<std::size_t>(second)) {
    figures.drift = quantile({errors.end() - second, errors.end()}, 0.5) -
                    quantile({errors.begin(), errors.begin() + second}, 0.5);
  }
  figures.missing = static_cast<std::size_t>(stream.count) - stream.arrivals.size();
  return figures;
}

std::int64_t record(const std::string& path, double seconds) {
  const auto store = replay::openStore(path, replay::OpenMode::ReadWrite);
  const std::int64_t recording = store->addRecording({0, "", "replay_timing", ""});
  const std::int64_t cmd =
      store->addChannel(recording, channelOf<geometry_msgs::Twist>("/bench/cmd"));
  const std::int64_t ar =
      store->addChannel(recording, channelOf<visualization_msgs::MarkerArray>("/bench/ar"));
  const std::int64_t begin = 1'600'000'000'000'000'000;
  std::vector<replay::Message> messages;
  for (int i = 0; i < 100 * seconds; ++i)
    messages.push_back({cmd, {begin + std::llround(i * 1e7)}, messages.size(), {}, twist(i)});
  for (int i = 0; i < 30 * seconds; ++i)
    messages.push_back({ar, {begin + std::llround(i * 1e9 / 30)}, messages.size(), {}, markers(i)});
  store->append(messages);
  replay::Behavior behavior;
  behavior.recording = recording;
  behavior.name = "timing";
  behavior.topics = {"/bench/cmd", "/bench/ar"};
  replay::Snapshot snapshot;
  snapshot.requested = behavior.topics;
  behavior.snapshot = snapshot.toJson();
  behavior.begin = {begin};
  behavior.end = replay::Stamp{begin + std::llround(seconds * 1e9)};
  return store->addBehavior(behavior);
}

using Words = std::vector<std::string>;

struct Settings {
  double seconds = 12;
  int rounds = 3;
  bool is_normal = false;
  Words third;  ///< the command of a third player
};

void run(const Settings& settings) {
  const double seconds = settings.seconds;
  const test::TempFolder folder;
  const std::string store = folder.path("timing.db"), bag = folder.path("timing.bag");
  const std::string id = std::to_string(record(store, seconds));
  const auto finish = [](const Words& arguments) {
    test::NodeProcess process(arguments);
    if (process.exitStatus() != 0) throw std::runtime_error(process.log());
  };
  finish({AFTERGLOW_BENCH_COMMAND, "export", id, "--store", store, "--out", bag});
  std::map<std::string, Words> players = {
      {"afterglow play",
       {AFTERGLOW_BENCH_COMMAND, "play", id, "--store", store, "--allow-motion", "--open-loop",
        "--no-scan", "--longest-stall", "0.5", "--quiet"}},
      {"rosbag play", {"rosbag", "play", "-q", "--wait-for-subscribers", bag}}};
  if (settings.is_normal) players["afterglow play"].push_back("--no-realtime");
  if (!settings.third.empty()) {
    players["third player"] = settings.third;
    players["third player"].push_back(bag);
  }

  Subscriber subscriber(seconds);
  // It is to measure how late the players are, not how late it wakes itself.
  const nodes::RealtimeScope realtime;
  std::map<std::string, std::vector<Figures>> all;  // by stream and player
  std::printf("%-5s %-15s %8s %8s %8s %9s %8s   (ms)\n", "", "", "p50", "p99", "max", "drift",
              "missing");
  for (int round = 0; round < settings.rounds; ++round) {
    for (const auto& [player, arguments] : players) {
      finish(arguments);
      for (const auto& [name, stream] : subscriber.take()) {
        const Figures figures = measure(stream);
        all[name + "/" + player].push_back(figures);
        std::printf("%-5s %-15s %8.3f %8.3f %8.3f %9.3f %8zu\n", name.c_str(), player.c_str(),
                    figures.p50, figures.p99, figures.max, figures.drift, figures.missing);
      }
    }
  }
  for (const char* stream : {"cmd", "ar"}) {
    for (const auto& [player, arguments] : players) {
      std::vector<double> p99s;
      double drift = 0;
      for (const Figures& figures : all[stream + ("/" + player)]) {
        p99s.push_back(figures.p99);
        drift = std::max(drift, std::abs(figures.drift));
      }
      std::printf("%-5s %-15s p99: median %.3f, worst %.3f; largest drift %.3f ms, of %d rounds\n",
                  stream, player.c_str(), median(p99s), quantile(p99s, 1), drift, settings.rounds);
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  Settings settings;
  if (argc > 1) settings.seconds = std::atof(argv[1]);
  if (argc > 2) settings.rounds = std::atoi(argv[2]);
  if (argc > 3) settings.is_normal = std::string(argv[3]) == "normal";
  if (argc > 4) settings.third.assign(argv + 4, argv + argc);
  if (settings.seconds < 3 || settings.rounds < 1) {
    std::fprintf(stderr,
                 "usage: replay_timing [seconds, 3 or more] [rounds] [fifo|normal] [...]\n");
    return 2;
  }
  try {
    const test::RosMaster master;
    int none = 0;
    ros::init(none, nullptr, "replay_timing", ros::init_options::NoSigintHandler);
    ros::start();
    run(settings);
    ros::shutdown();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "replay_timing: %s\n", error.what());
    return 1;
  }
  return 0;
}
