#include "replay/motion/path_time.hpp"

#include <algorithm>
#include <stdexcept>

#include "replay/motion/pose_track.hpp"

namespace afterglow::replay {
namespace {

constexpr double kHurry = 1.05;  // to catch up with the timeline

void checkRate(double rate) {
  if (!(rate > 0)) throw std::invalid_argument("the rate of a base must be above zero");
}

}  // namespace

PathTime::PathTime(Stamp begin, Stamp end, double rate)
    : now_(begin), end_(end), rate_(rate), pace_(rate) {
  checkRate(rate);
}

Stamp PathTime::in(double seconds) const { return later(now_, pace_ * seconds); }

void PathTime::advance(double seconds) {
  Stamp next = in(seconds);
  if (met_ && next < *met_) next = std::min(*met_, in(kHurry * seconds));
  now_ = std::min({next, end_, std::max(now_, limit_.value_or(end_))});
}

void PathTime::setRate(double rate) {
  checkRate(rate);
  pace_ *= rate / rate_;
  rate_ = rate;
}

}  // namespace afterglow::replay
