// The measured delay of a projector, on a simulated one and a simulated camera whose delays are
// known.
#include "calib/latency/latency.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <deque>
#include <random>
#include <string>

#include "calib/color/color.hpp"

namespace afterglow::calib::latency_test {
namespace {

constexpr double kMs = 1e6;

/// A projector, a lamp beside it and a camera; times in ms.
struct Room {
  double delay = 40;             ///< from a picture's hand-over to its first refresh
  double refresh = 1000.0 / 60;  ///< light changes at a refresh alone; 0: at once
  double rise = 0;
  double hz = 30, exposure = 10;
  double drift = 1.001;   ///< of the camera's clock: 59.94 Hz are not 60
  double transport = 25;  ///< from an exposure's end to the image's arrival
  double rolling = 0;     ///< from the first row's exposure to the last one's
  enum Stamp { Start, Middle, End, Arrival } stamp = Start;
  double stamp_jitter = 0, camera_clock = 0;
  double noise = 0.01;  ///< of full scale, an image's cell
  double banding = 0;   ///< noise that all cells share
  double dropped = 0, repeated = 0;
  bool has_new_stamps = false;  ///< of repeated images
  double ambient = 0.05, light = 0.3, flicker = 0;
  double gamma = 0;       ///< of the camera, where it is not sRGB's
  double clock_jump = 0;  ///< of the machine's clock, after 5 s
  double lamp_row = 0.7;
  unsigned seed = 1;
};

class Simulation {
 public:
  explicit Simulation(const Room& room) : room_(room), random_(room.seed) {}

  /// Runs until it is done, at most for ten minutes.
  std::vector<SeenDelay> run(bool has_lamp = false) {
    std::vector<LatencyRun::Switch> lights = {[this](bool is_lit) { return project(is_lit); }};
    if (has_lamp) lights.push_back([this](bool is_lit) { return lamp(is_lit); });
    LatencyRun run(std::move(lights));
    double next_image = uniform() * 1000 / room_.hz;
    for (now_ = 0; now_ < 600e3 && !run.isDone();) {
      const double due = static_cast<double>(run.goOn(ns(now_))) / kMs;
      // A tenth of a ms: the moments of threads.
      const double image_at = arrivalOf(next_image);
      if (image_at <= due) {
        now_ = std::max(now_, image_at);
        deliver(run, next_image);
        next_image += 1000 / room_.hz * room_.drift;
      } else {
        now_ = due + 0.1 * uniform();
      }
    }
    EXPECT_TRUE(run.isDone());
    return run.seen();
  }

  /// The mean of what the projector's light really took.
  double truth() const { return truth_ / static_cast<double>(changes_.size()); }

 private:
  struct Change {
    double at;
    bool is_lit;
  };

  double uniform() { return std::uniform_real_distribution<double>()(random_); }
  double bell() { return std::normal_distribution<double>()(random_); }
  static std::int64_t ns(double ms) { return std::llround(ms * kMs); }
  ClockReading reading(double ms) const {
    return {1'000'000'000'000 + ns(ms + (ms > 5000 ? room_.clock_jump : 0)), ns(ms)};
  }

  ClockReading project(bool is_lit) {
    double at = now_ + room_.delay;
    if (room_.refresh > 0) at = std::ceil(at / room_.refresh) * room_.refresh;
    changes_.push_back({at, is_lit});
    truth_ += at + room_.rise / 2 - now_;
    return reading(now_);
  }
  ClockReading lamp(bool is_lit) {
    lamp_.push_back({now_, is_lit});
    return reading(now_);
  }

  /// The share of an exposure that is lit.
  static double lit(const std::deque<Change>& changes, double from, double to, double rise) {
    double lit = 0;
    constexpr int kMoments = 25;
    for (int i = 0; i < kMoments; ++i) {
      const double moment = from + (to - from) * (i + 0.5) / kMoments;
      double level = 0;
      for (auto change = changes.rbegin(); change != changes.rend(); ++change) {
        if (change->at > moment) continue;
        const double share = rise > 0 ? std::min(1.0, (moment - change->at) / rise) : 1;
        level = change->is_lit ? share : 1 - share;
        break;
      }
      lit += level / kMoments;
    }
    return lit;
  }

  double arrivalOf(double begin) const {
    return begin + room_.exposure + room_.rolling + room_.transport;
  }

  double stampOf(double begin) {
    const double jitter = room_.stamp_jitter * bell();
    switch (room_.stamp) {
      case Room::Start:
        return begin + jitter;
      case Room::Middle:
        return begin + room_.exposure / 2 + jitter;
      case Room::End:
        return begin + room_.exposure + jitter;
      case Room::Arrival:
        break;
    }
    return arrivalOf(begin);
  }

  void deliver(LatencyRun& run, double begin) {
    if (uniform() < room_.dropped) return;
    TimedImage image;
    image.arrived = reading(now_);
    image.stamp_ns = reading(stampOf(begin) + room_.camera_clock).wall_ns;
    const double shared = room_.banding * bell();
    const double mains =
        room_.flicker * std::sin(2 * M_PI * 100.37 * (begin + room_.exposure / 2) / 1000);
    double beam = -1;
    for (int row = 0; row < TimedImage::kRows; ++row) {
      const double shift = room_.rolling * (row + 0.5) / TimedImage::kRows;
      const double from = begin + shift, to = from + room_.exposure;
      const bool is_beam = row >= 3 && row < 9;
      const bool is_lamp = row == std::lround(room_.lamp_row * TimedImage::kRows);
      if (beam < 0 || room_.rolling > 0) beam = lit(changes_, from, to, room_.rise);
      const double lamp = is_lamp ? lit(lamp_, from, to, 0) : 0;
      for (int column = 0; column < TimedImage::kColumns; ++column) {
        double level = room_.ambient * (1 + mains) + shared + room_.noise * bell();
        if (is_beam && column >= 4 && column < 12) level += room_.light * beam;
        if (column == 13) level += 0.3 * lamp;
        image.light[static_cast<std::size_t>(row * TimedImage::kColumns + column)] =
            static_cast<float>(curve(level));
      }
    }
    run.see(image);
    if (uniform() >= room_.repeated) return;
    if (room_.has_new_stamps) image.stamp_ns += ns(500 / room_.hz);
    run.see(image);
  }

  /// The light that timedImage() takes for the camera's.
  double curve(double level) const {
    level = std::clamp(level, 0.0, 1.0);
    return room_.gamma > 0 ? lightOfSrgb(std::pow(level, 1 / room_.gamma)) : level;
  }

  const Room room_;
  std::mt19937 random_;
  double now_ = 0, truth_ = 0;
  std::deque<Change> changes_, lamp_;
};

StampMeaning meaning(const Room& room) {
  return room.stamp == Room::Start    ? StampMeaning::Start
         : room.stamp == Room::Middle ? StampMeaning::Middle
                                      : StampMeaning::End;
}

/// Expects the delay within 2 ms, where it is known what the stamps mean.
void expectDelay(const Room& room, const std::string& what, double within_ms = 2) {
  Simulation simulation(room);
  const SeenDelay seen = simulation.run().at(0);
  const ProjectorDelay delay = separate(seen, meaning(room), std::nullopt);
  EXPECT_NEAR(delay.ms, simulation.truth(), within_ms) << what << ": " << delayWords(seen, delay);
  EXPECT_LT(std::abs(delay.ms - simulation.truth()), delay.bound_ms + 0.5) << what;
  EXPECT_NEAR(seen.exposure_ms, room.exposure + room.rise / 2,
              1.5 + seen.exposure_uncertainty_ms + room.rise / 2)
      << what;
  const ProjectorDelay blind = separate(seen, StampMeaning::Unknown, std::nullopt);
  EXPECT_LT(std::abs(blind.ms - simulation.truth()), blind.bound_ms + 0.5)
      << what << ": " << delayWords(seen, blind);
}

std::string refusalOf(const Room& room) {
  try {
    separate(Simulation(room).run().at(0), StampMeaning::Unknown, std::nullopt);
  } catch (const LatencyRefused& refused) {
    return refused.what();
  }
  return "";
}

TEST(Latency, isMeasuredWithinTwoMilliseconds) {
  for (const double delay : {0.0, 40.0, 300.0}) {
    for (const double hz : {15.0, 30.0, 60.0}) {
      Room room;
      room.delay = delay;
      room.hz = hz;
      expectDelay(room, "delay " + std::to_string(delay) + " at " + std::to_string(hz));
    }
  }
}

TEST(Latency, knowsTheExposure) {
  for (const double exposure : {1.0, 5.0, 16.0, 30.0}) {
    for (const auto stamp : {Room::Start, Room::Middle, Room::End}) {
      Room room;
      room.exposure = exposure;
      room.stamp = stamp;
      expectDelay(room, "exposure " + std::to_string(exposure) + ", stamp " +
                            std::to_string(static_cast<int>(stamp)));
    }
  }
}

TEST(Latency, isMeasuredInDifficultRooms) {
  Room noisy, bright, lossy, repeating, jittery, slow, linear, prompt;
  noisy.noise = 0.05;
  noisy.banding = 0.02;
  bright.ambient = 0.6;
  bright.light = 0.1;
  bright.flicker = 0.01;
  lossy.dropped = 0.2;
  repeating.repeated = 0.3;
  repeating.has_new_stamps = true;
  jittery.stamp_jitter = 4;
  slow.rise = 8;
  linear.gamma = 1;
  prompt.refresh = 0;
  expectDelay(noisy, "noise");
  expectDelay(bright, "a bright room");
  expectDelay(lossy, "dropped images");
  expectDelay(repeating, "repeated images");
  expectDelay(jittery, "stamps that jitter");
  expectDelay(slow, "a panel that is slow");
  expectDelay(linear, "a camera whose values are light", 3);
  expectDelay(prompt, "a projector without refresh");
}

TEST(Latency, isBoundedWhereImagesAreInStepWithTheProjector) {
  for (const double exposure : {2.0, 12.0}) {
    for (const unsigned seed : {1u}) {
      Room room;
      room.hz = 60;
      room.exposure = exposure;
      room.drift = 1;
      room.seed = seed;
      Simulation simulation(room);
      const SeenDelay seen = simulation.run().at(0);
      const ProjectorDelay delay = separate(seen, StampMeaning::Start, std::nullopt);
      EXPECT_TRUE(seen.may_be_in_step) << delayWords(seen, delay);
      EXPECT_LT(std::abs(delay.ms - simulation.truth()), delay.bound_ms) << delayWords(seen, delay);
    }
  }
}

TEST(Latency, isToldApartFromAnyCamerasOwnByASecondLight) {
  for (const auto stamp : {Room::Start, Room::End, Room::Arrival}) {
    for (const double transport : {5.0, 60.0}) {
      Room room;
      room.stamp = stamp;
      room.transport = transport;
      Simulation simulation(room);
      const auto seen = simulation.run(true);
      const ProjectorDelay delay = separate(seen.at(0), StampMeaning::Unknown, seen.at(1));
      EXPECT_NEAR(delay.ms, simulation.truth(), 2) << delayWords(seen[0], delay);
      EXPECT_LT(std::abs(delay.ms - simulation.truth()), delay.bound_ms + 0.5);
    }
  }
}

TEST(Latency, boundsWhatARollingShutterHides) {
  Room room;
  room.rolling = 20;
  room.lamp_row = 0.5;
  Simulation simulation(room);
  const auto seen = simulation.run(true);
  EXPECT_NEAR(seen[0].rows_ms, -20, 4);
  EXPECT_NEAR(seen[0].row, 0.5, 0.02);
  const ProjectorDelay delay = separate(seen[0], StampMeaning::Start, seen[1]);
  EXPECT_NEAR(delay.ms, simulation.truth(), 2) << delayWords(seen[0], delay);
  const ProjectorDelay alone = separate(seen[0], StampMeaning::Start, std::nullopt);
  EXPECT_LT(std::abs(alone.ms - simulation.truth()), alone.bound_ms) << delayWords(seen[0], alone);
}

TEST(Latency, isNotToldOfImagesThatAreStampedOnArrival) {
  Room room;
  room.stamp = Room::Arrival;
  const SeenDelay seen = Simulation(room).run().at(0);
  try {
    separate(seen, StampMeaning::Unknown, std::nullopt);
    FAIL() << "told";
  } catch (const LatencyRefused& refused) {
    EXPECT_NE(std::string(refused.what()).find("images are stamped on arrival: of the "),
              std::string::npos);
  }
}

TEST(Latency, refusesWhatCannotBeMeasured) {
  Room dark, slow, jumping, ahead, behind, elsewhere, flickering;
  dark.light = 0;
  EXPECT_NE(refusalOf(dark).find("the light is not seen: "), std::string::npos);
  slow.hz = 7;
  EXPECT_NE(refusalOf(slow).find("the camera sends 7.0 images a second"), std::string::npos);
  jumping.clock_jump = 120;
  EXPECT_NE(refusalOf(jumping).find("clock jumped by 120 ms"), std::string::npos);
  ahead.camera_clock = 500;
  EXPECT_NE(refusalOf(ahead).find("465 ms before their stamps: the camera's clock"),
            std::string::npos)
      << refusalOf(ahead);
  behind.camera_clock = -3600e3;
  EXPECT_NE(refusalOf(behind).find("after their stamps: the camera's clock"), std::string::npos);
  elsewhere.camera_clock = -200;
  EXPECT_NE(refusalOf(elsewhere).find("before it is shown: its clock"), std::string::npos)
      << refusalOf(elsewhere);
  flickering.ambient = 0.4;
  flickering.flicker = 0.4;
  EXPECT_NE(refusalOf(flickering).find("light flickers"), std::string::npos)
      << refusalOf(flickering);
}

TEST(Latency, isRefusedWithoutImages) {
  LatencyRun run({[](bool) { return ClockReading{}; }});
  const auto goOn = [&run] {
    for (std::int64_t now = 0; now < 100'000'000'000; now += 1'000'000'000) run.goOn(now);
  };
  EXPECT_THROW(goOn(), LatencyRefused);
}

TEST(Latency, seesLightLinearly) {
  Picture half{32, 24, std::vector<std::uint8_t>(768, 0)};
  for (std::size_t i = 0; i < 384; ++i) half.pixels[i] = 188;  // half of sRGB's light
  const TimedImage image = timedImage(half, 1, {2, 3});
  EXPECT_NEAR(image.light.front(), 0.5, 0.01);
  EXPECT_EQ(image.light.back(), 0);
  EXPECT_THROW(timedImage({8, 8, std::vector<std::uint8_t>(64)}, 1, {}), std::invalid_argument);
}

}  // namespace
}  // namespace afterglow::calib::latency_test
