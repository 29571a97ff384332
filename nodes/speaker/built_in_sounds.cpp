#include "nodes/speaker/built_in_sounds.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <vector>

namespace afterglow::nodes {
namespace {

constexpr int kRate = 22050;  // Hz
constexpr double kTone_s = 0.12, kGap_s = 0.08, kRest_s = 0.6, kEdge_s = 0.01;
constexpr double kLoudness = 0.4;
constexpr double kTurn = 6.283185307179586;

/// Hz, one after the other. Plugging rises, unplugging falls; badly: twice.
const std::vector<double> kTones[] = {
    {1000, 1000}, {880, 587}, {587, 880}, {880, 587, 880, 587}, {587, 880, 587, 880}};

void append(Sound& sound, double hertz, double seconds) {
  const auto count = static_cast<int>(seconds * kRate);
  for (int i = 0; i < count; ++i) {
    const double t = static_cast<double>(i) / kRate;
    const double edge = std::clamp(std::min(t, seconds - t) / kEdge_s, 0.0, 1.0);  // no clicks
    sound.samples.push_back(static_cast<std::int16_t>(
        std::lround(32767 * kLoudness * edge * std::sin(kTurn * hertz * t))));
  }
}

}  // namespace

std::shared_ptr<const Sound> builtInSound(int number) {
  if (number < 1 || number > static_cast<int>(std::size(kTones))) return nullptr;
  auto sound = std::make_shared<Sound>(Sound{kRate, 1, {}});
  for (const double hertz : kTones[static_cast<std::size_t>(number - 1)]) {
    append(*sound, hertz, kTone_s);
    append(*sound, 0, kGap_s);
  }
  append(*sound, 0, kRest_s);
  return sound;
}

}  // namespace afterglow::nodes
