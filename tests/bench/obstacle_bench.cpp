// How long it takes to look where the base goes: a scan of 1000 beams in a cluttered room, taken in
// and judged along a track. Thirty of fifty decisions a second have no new scan to take in.
#include <benchmark/benchmark.h>

#include <random>

#include "replay/motion/base/obstacle_stop.hpp"
#include "tests/support/simulated_scan.hpp"

namespace afterglow::replay {
namespace {

using namespace test;

constexpr ScanShape kThousand{-1.92, 3.84 / 999, 1000, 0.01};

/// Forty legs within 3 m, none on the way.
std::vector<Disc> clutter() {
  std::mt19937 random(1);
  std::vector<Disc> discs;
  while (discs.size() < 40) {
    const double x = -1 + 4e-9 * random() / 4.294967296, y = 3 - 6e-9 * random() / 4.294967296;
    if (std::abs(y) > 0.6) discs.push_back({x, y, 0.03});
  }
  return discs;
}

PoseTrack bend() {
  std::vector<PoseTrack::Sample> samples;
  PlanarPose pose;
  for (int i = 0; i < 200; ++i) {
    samples.push_back({stampAt(0.02 * i), pose});
    pose = advance(pose, {0.5, 0.1}, 0.02);
  }
  return PoseTrack(samples, "map", true);
}

void decideOnOneScan(benchmark::State& state) {
  const PoseTrack track = bend();
  ObstacleStop stop({}, "map");
  stop.hear(scanOf(clutter(), {}, 0, kThousand));
  for (auto _ : state) {
    const SweptPath path = pathAlong(track, track.begin(), {}, 0.4, stop.lookAhead());
    benchmark::DoNotOptimize(stop.judge({stampAt(0), {}, {}, {}, 0.02}, path));
  }
}
BENCHMARK(decideOnOneScan)->Unit(benchmark::kMicrosecond);

void takeAScanAndDecide(benchmark::State& state) {
  const PoseTrack track = bend();
  const std::vector<Disc> discs = clutter();
  ObstacleStop stop({}, "map");
  std::vector<RangeScan> scans;
  for (int i = 0; i < 20; ++i) scans.push_back(rangesOf(discs, {}, i / 15., kThousand, 7 + i));
  std::size_t next = 0;
  for (auto _ : state) {
    const RangeScan& ranges = scans[next++ % scans.size()];
    stop.hear(std::make_shared<FloorScan>(ranges, ScanMount{{kLaserAhead, 0}, {1, 0}, {0, 1}},
                                          nullptr, std::vector<OwnPart>{}));
    const SweptPath path = pathAlong(track, track.begin(), {}, 0.4, stop.lookAhead());
    benchmark::DoNotOptimize(stop.judge({ranges.stamp, {}, {}, {}, 0.02}, path));
  }
}
BENCHMARK(takeAScanAndDecide)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace afterglow::replay
