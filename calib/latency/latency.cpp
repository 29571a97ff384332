#include "calib/latency/latency.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numeric>
#include <utility>

#include "calib/color/color.hpp"
#include "calib/median.hpp"

namespace afterglow::calib {
namespace {

constexpr double kMs = 1e6;  // ns
constexpr std::size_t kCells = std::tuple_size<decltype(TimedImage::light)>::value;
constexpr double kLeastHz = 10;                     // images a second
constexpr std::int64_t kJump_ns = 20'000'000;       // more than a thread waits between two clocks
constexpr double kOldest_ms = 2000, kAhead_ms = 5;  // of an image when it arrives
constexpr double kEarliest_ms = -300, kLatest_ms = 1200,
                 kStep_ms = 10;        // where light is looked for
constexpr double kWindow_ms = 150;     // round a change: less than a light is left on or off
constexpr double kLeastLight = 0.004;  // of full scale: a gray level near the middle
constexpr double kLeastCorrelation = 0.6;
constexpr double kMostNoise = 0.2;   // of the light
constexpr double kOnArrival_ms = 2;  // between stamp and arrival: nothing else was stamped
constexpr double kRefresh_ms = 6;    // less than any projector's period
constexpr double kAlike = 0.12;      // shares from 0.15 to 0.85 that are anything deviate by 0.2
constexpr double kCurve = 0.25;      // of the exposure: if the camera's curve is not sRGB's
constexpr std::size_t kParts = 8;    // that are compared for the uncertainty
constexpr double kStudent = 2.36;    // 95 % of means of so many parts

using Signal = std::vector<double>;
using Parts = std::array<double, kParts>;  ///< a value of each eighth of the measurement

double meanOf(const Parts& parts) {
  return std::accumulate(parts.begin(), parts.end(), 0.0) / kParts;
}

/// The uncertainty of their mean, 95 %.
double uncertaintyOf(const Parts& parts) {
  const double mean = meanOf(parts);
  double square = 0;
  for (const double value : parts) square += (value - mean) * (value - mean);
  return kStudent * std::sqrt(square / (kParts - 1) / kParts);
}

/// An image near a change: when, after the change, and how far the change had come, 0 to 1.
struct Sample {
  double after_ms, share;
  std::size_t change;
};

/// A rise from 0 to 1, straight, its middle at `middle_ms`.
struct Ramp {
  double middle_ms = 0, width_ms = 0;

  double at(double ms) const { return std::clamp((ms - middle_ms) / width_ms + 0.5, 0.0, 1.0); }
};

double misfit(const Ramp& ramp, const std::vector<Sample>& samples) {
  double sum = 0;
  for (const Sample& sample : samples) {
    const double off = sample.share - ramp.at(sample.after_ms);
    sum += off * off;
  }
  return sum;
}

/// The best middle for this width: in steps, then in finer ones. Where several are as good, the
/// mean of them.
Ramp bestMiddle(double width_ms, double near_ms, double range_ms,
                const std::vector<Sample>& samples) {
  Ramp best{near_ms, width_ms};
  for (double step = 4; step > 0.02; step /= 4, range_ms = 2 * step * 4) {
    double least = std::numeric_limits<double>::infinity(), first = 0, last = 0;
    for (double at = best.middle_ms - range_ms; at <= best.middle_ms + range_ms; at += step) {
      const double value = misfit({at, width_ms}, samples);
      if (value < least - 1e-12) {
        least = value;
        first = at;
      }
      if (value <= least + 1e-12) last = at;
    }
    best.middle_ms = (first + last) / 2;
  }
  return best;
}

Ramp fitRamp(double near_ms, const std::vector<Sample>& samples) {
  Ramp best;
  double least = std::numeric_limits<double>::infinity();
  for (double width = 1; width < kWindow_ms; width *= 1.4) {
    const Ramp ramp = bestMiddle(width, near_ms, 60, samples);
    const double value = misfit(ramp, samples);
    if (value >= least) continue;
    least = value;
    best = ramp;
  }
  return best;
}

/// Images of one camera and the changes that they show.
class Recording {
 public:
  Recording(const std::vector<LightChange>& changes, const std::vector<TimedImage>& images)
      : changes_(changes) {
    keepNew(images);
    refuseFewImages();
    refuseClocks();
    findLight();
  }

  SeenDelay measure() const;

 private:
  void keepNew(const std::vector<TimedImage>& images);
  void refuseFewImages();
  void refuseClocks();
  void findLight();

  struct Cells {
    std::array<double, kCells> light{};        ///< how much brighter it is while it is lit
    std::array<double, kCells> correlation{};  ///< the share of its changes that this explains
  };

  std::vector<int> stateAt(double delay_ms) const;
  Cells cellsAt(double delay_ms) const;
  /// The mean of the lit cells between two rows of the grid, those of the most light counting most.
  Signal signal(int first_row, int end_row) const;
  std::vector<Sample> samples(const Signal& signal, bool is_rise) const;
  Ramp middleOf(const Signal& signal) const;
  Parts exposuresMs(const Ramp& ramp) const;
  Parts middlesMs(const Signal& signal, const Ramp& ramp) const;
  std::size_t partOf(std::size_t change) const { return change * kParts / changes_.size(); }
  void refuseNoise(const Signal& signal) const;
  void measureRows(SeenDelay& seen) const;
  bool mayBeInStep(const Signal& signal, const SeenDelay& seen) const;
  double stampMs(const TimedImage& image) const {
    return static_cast<double>(image.stamp_ns - changes_.front().at.wall_ns) / kMs;
  }
  double changeMs(const LightChange& change) const {
    return static_cast<double>(change.at.wall_ns - changes_.front().at.wall_ns) / kMs;
  }

  const std::vector<LightChange>& changes_;
  std::vector<TimedImage> images_;
  std::array<double, kCells> weights_{};
  double period_ms_ = 0, arrival_ms_ = 0;  ///< medians
  double image_ms_ = 0;                    ///< time for each image, lost ones included
  double coarse_ms_ = 0;                   ///< delay to within a few steps
};

/// Drops what a driver sent again, with its old stamp or with a new one: real images have noise.
void Recording::keepNew(const std::vector<TimedImage>& images) {
  for (const TimedImage& image : images) {
    const bool is_again = !images_.empty() && (image.stamp_ns <= images_.back().stamp_ns ||
                                               image.light == images_.back().light);
    if (!is_again) images_.push_back(image);
  }
}

void Recording::refuseFewImages() {
  if (changes_.size() < 2 * kParts || images_.size() < 4 * kParts) {
    throw LatencyRefused(
        fmt::format("{} images and {} changes of light are too few: is the camera running?",
                    images_.size(), changes_.size()));
  }
  std::vector<double> gaps, ages;
  for (std::size_t i = 0; i < images_.size(); ++i) {
    if (i > 0) gaps.push_back(stampMs(images_[i]) - stampMs(images_[i - 1]));
    ages.push_back(static_cast<double>(images_[i].arrived.wall_ns - images_[i].stamp_ns) / kMs);
  }
  period_ms_ = median(gaps, 0);
  arrival_ms_ = median(ages, 0);
  image_ms_ = (stampMs(images_.back()) - stampMs(images_.front())) /
              static_cast<double>(images_.size() - 1);
  if (period_ms_ * kLeastHz > 1000 * 1.05) {
    throw LatencyRefused(
        fmt::format("the camera sends {:.1f} images a second, at least {:.0f} are needed",
                    1000 / period_ms_, kLeastHz));
  }
}

/// Refuses a clock that was set meanwhile, and stamps by another clock.
void Recording::refuseClocks() {
  std::vector<ClockReading> readings;
  for (const LightChange& change : changes_) readings.push_back(change.at);
  for (const TimedImage& image : images_) readings.push_back(image.arrived);
  std::sort(readings.begin(), readings.end(),
            [](const auto& a, const auto& b) { return a.steady_ns < b.steady_ns; });
  for (std::size_t i = 1; i < readings.size(); ++i) {
    const std::int64_t step = (readings[i].wall_ns - readings[i - 1].wall_ns) -
                              (readings[i].steady_ns - readings[i - 1].steady_ns);
    if (std::abs(step) < kJump_ns) continue;
    throw LatencyRefused(
        fmt::format("this machine's clock jumped by {:.0f} ms meanwhile: let it "
                    "be set first (chrony, ntp)",
                    static_cast<double>(step) / kMs));
  }
  if (arrival_ms_ < -kAhead_ms || arrival_ms_ > kOldest_ms) {
    throw LatencyRefused(fmt::format(
        "images arrive {:.0f} ms {} their stamps: the camera's clock is not this machine's "
        "(chrony, ntp sets them by each other)",
        std::abs(arrival_ms_), arrival_ms_ < 0 ? "before" : "after"));
  }
}

/// Returns for each image whether it is lit (1) or dark (-1) if light comes so late; 0 before the
/// first change.
std::vector<int> Recording::stateAt(double delay_ms) const {
  std::vector<int> state;
  std::size_t next = 0;
  for (const TimedImage& image : images_) {
    while (next < changes_.size() && changeMs(changes_[next]) + delay_ms <= stampMs(image)) ++next;
    state.push_back(next == 0 ? 0 : changes_[next - 1].is_lit ? 1 : -1);
  }
  return state;
}

/// Compares the cells of lit and of dark images, if light comes so late.
Recording::Cells Recording::cellsAt(double delay_ms) const {
  const std::vector<int> state = stateAt(delay_ms);
  std::array<std::array<double, kCells>, 2> sums{};
  std::array<double, kCells> squares{};
  std::array<double, 2> counts{};
  for (std::size_t i = 0; i < images_.size(); ++i) {
    if (state[i] == 0) continue;
    const std::size_t is_lit = state[i] > 0 ? 1 : 0;
    ++counts[is_lit];
    for (std::size_t cell = 0; cell < kCells; ++cell) {
      const double light = images_[i].light[cell];
      sums[is_lit][cell] += light;
      squares[cell] += light * light;
    }
  }
  Cells cells;
  const double all = counts[0] + counts[1];
  if (counts[0] == 0 || counts[1] == 0) return cells;
  for (std::size_t cell = 0; cell < kCells; ++cell) {
    const double mean = (sums[0][cell] + sums[1][cell]) / all;
    const double variance = squares[cell] / all - mean * mean;
    cells.light[cell] = sums[1][cell] / counts[1] - sums[0][cell] / counts[0];
    const double explained = cells.light[cell] * std::sqrt(counts[0] * counts[1]) / all;
    if (variance > 1e-12) cells.correlation[cell] = explained / std::sqrt(variance);
  }
  return cells;
}

/// Finds the delay at which the images follow the changes best, and the cells that do.
void Recording::findLight() {
  double best = 0, all = 0;
  Cells found;
  for (double delay = kEarliest_ms; delay <= kLatest_ms; delay += kStep_ms) {
    const Cells cells = cellsAt(delay);
    double sum = 0;
    for (const double value : cells.correlation) sum += value > 0 ? value * value : 0;
    if (sum <= best) continue;
    best = sum;
    coarse_ms_ = delay;
    found = cells;
  }
  for (std::size_t cell = 0; cell < kCells; ++cell) {
    const bool is_seen =
        found.light[cell] > kLeastLight && found.correlation[cell] > kLeastCorrelation;
    weights_[cell] = is_seen ? found.light[cell] : 0;
    all += weights_[cell];
  }
  if (all > 0) return;
  throw LatencyRefused(
      "the light is not seen: nothing that the camera shows follows it. Has the camera the lit "
      "place in view, is the room dim enough, is its exposure fixed?");
}

Signal Recording::signal(int first_row, int end_row) const {
  const auto begin = static_cast<std::size_t>(first_row * TimedImage::kColumns);
  const auto end = static_cast<std::size_t>(end_row * TimedImage::kColumns);
  Signal signal;
  for (const TimedImage& image : images_) {
    double sum = 0;
    for (std::size_t cell = begin; cell < end; ++cell) sum += weights_[cell] * image.light[cell];
    signal.push_back(sum);
  }
  // 0 and 1 are what it settles at, long after each change.
  std::vector<double> dark, lit;
  const std::vector<int> now = stateAt(coarse_ms_ + kWindow_ms / 2),
                         soon = stateAt(coarse_ms_ - kWindow_ms / 2);
  for (std::size_t i = 0; i < signal.size(); ++i) {
    if (now[i] == soon[i] && now[i] != 0) (now[i] > 0 ? lit : dark).push_back(signal[i]);
  }
  const double low = median(dark, 0), high = median(lit, 1);
  for (double& value : signal) value = (value - low) / (high - low);
  return signal;
}

std::vector<Sample> Recording::samples(const Signal& signal, bool is_rise) const {
  std::vector<Sample> samples;
  std::size_t first = 0;
  for (std::size_t c = 0; c < changes_.size(); ++c) {
    const double middle = changeMs(changes_[c]) + coarse_ms_;
    while (first < images_.size() && stampMs(images_[first]) < middle - kWindow_ms) ++first;
    if (changes_[c].is_lit != is_rise) continue;
    for (std::size_t i = first; i < images_.size(); ++i) {
      const double after = stampMs(images_[i]) - changeMs(changes_[c]);
      if (after > coarse_ms_ + kWindow_ms) break;
      samples.push_back({after, is_rise ? signal[i] : 1 - signal[i], c});
    }
  }
  return samples;
}

/// The mean of on and off: a camera's curve that is not as supposed moves them apart, not their
/// mean.
Ramp Recording::middleOf(const Signal& signal) const {
  const Ramp on = fitRamp(coarse_ms_, samples(signal, true));
  const Ramp off = fitRamp(coarse_ms_, samples(signal, false));
  return {(on.middle_ms + off.middle_ms) / 2, (on.width_ms + off.width_ms) / 2};
}

/// A share y of an image that a change divides is anything from 0 to 1 alike, of which y (1 - y) is
/// 1/6 in the mean: that tells how many images are divided, wherever changes scatter to. Row by
/// row, as a rolling shutter sees them; noise is subtracted as it is far from changes.
Parts Recording::exposuresMs(const Ramp& ramp) const {
  const double near = ramp.width_ms / 2 + 1.5 * period_ms_;
  Parts all{};
  double rows = 0;
  for (int row = 0; row < TimedImage::kRows; ++row) {
    const auto first = weights_.begin() + row * TimedImage::kColumns;
    if (std::all_of(first, first + TimedImage::kColumns, [](double w) { return w == 0; })) continue;
    ++rows;
    const Signal seen = signal(row, row + 1);
    Parts divided{}, count{};
    double noise = 0, settled = 0;
    for (const bool is_rise : {true, false}) {
      for (const Sample& sample : samples(seen, is_rise)) {
        const double value = sample.share * (1 - sample.share);
        const bool is_near = std::abs(sample.after_ms - ramp.middle_ms) < near;
        (is_near ? divided[partOf(sample.change)] : noise) += value;
        ++(is_near ? count[partOf(sample.change)] : settled);
      }
    }
    const double usual = settled > 0 ? noise / settled : 0;
    for (std::size_t part = 0; part < kParts; ++part)
      all[part] += divided[part] - usual * count[part];
  }
  const double changes = static_cast<double>(changes_.size()) / kParts;
  for (double& exposure : all) exposure *= 6 * image_ms_ / (rows * changes);
  return all;
}

/// Parts follow each other: images that are almost in step with the projector's refresh see light
/// now sooner, now later, for seconds.
Parts Recording::middlesMs(const Signal& signal, const Ramp& ramp) const {
  Parts middles{};
  for (const bool is_rise : {true, false}) {
    const std::vector<Sample> all = samples(signal, is_rise);
    for (std::size_t part = 0; part < kParts; ++part) {
      std::vector<Sample> some;
      std::copy_if(all.begin(), all.end(), std::back_inserter(some),
                   [&](const Sample& sample) { return partOf(sample.change) == part; });
      middles[part] += bestMiddle(ramp.width_ms, ramp.middle_ms, 40, some).middle_ms / 2;
    }
  }
  return middles;
}

void Recording::refuseNoise(const Signal& signal) const {
  double square = 0;
  std::size_t count = 0;
  for (const bool is_rise : {true, false}) {
    for (const Sample& sample : samples(signal, is_rise)) {
      if (std::abs(sample.after_ms - coarse_ms_) < 0.7 * kWindow_ms) continue;
      const double off = sample.share - (sample.after_ms < coarse_ms_ ? 0 : 1);
      square += off * off;
      ++count;
    }
  }
  const double noise = count > 0 ? std::sqrt(square / static_cast<double>(count)) : 0;
  if (noise < kMostNoise) return;
  throw LatencyRefused(fmt::format(
      "what is lit varies by {:.0f} % without the projector: the room's light flickers, something "
      "moves, or the camera's exposure adapts. Fix the exposure, and darken the room",
      100 * noise));
}

/// The difference between the upper and the lower half of the light: a rolling shutter, or a
/// projector that draws line by line.
void Recording::measureRows(SeenDelay& seen) const {
  std::array<double, TimedImage::kRows> light{};
  double all = 0, moment = 0;
  for (std::size_t cell = 0; cell < kCells; ++cell) {
    const std::size_t row = cell / TimedImage::kColumns;
    light[row] += weights_[cell];
    all += weights_[cell];
    moment += weights_[cell] * (static_cast<double>(row) + 0.5) / TimedImage::kRows;
  }
  seen.row = moment / all;
  const int half = std::clamp(static_cast<int>(std::lround(seen.row * TimedImage::kRows)), 1,
                              TimedImage::kRows - 1);
  const auto centerOf = [&](int first, int end) {
    double sum = 0, weighted = 0;
    for (int row = first; row < end; ++row) {
      sum += light[static_cast<std::size_t>(row)];
      weighted += light[static_cast<std::size_t>(row)] * (row + 0.5) / TimedImage::kRows;
    }
    return sum > 0 ? weighted / sum : -1;
  };
  const double upper = centerOf(0, half), lower = centerOf(half, TimedImage::kRows);
  if (upper < 0 || lower < 0) return;  // in one row: nothing is told
  const double later =
      middleOf(signal(half, TimedImage::kRows)).middle_ms - middleOf(signal(0, half)).middle_ms;
  seen.rows_ms = later / (lower - upper);
}

/// A refresh that light waits for scatters it, and so divides images anywhere, unless all images
/// are as far from a refresh: then light comes at once, it seems, and divides none or all alike.
bool Recording::mayBeInStep(const Signal& signal, const SeenDelay& seen) const {
  if (seen.spread_ms > kRefresh_ms) return false;
  double count = 0, sum = 0, square = 0;
  for (const bool is_rise : {true, false}) {
    for (const Sample& sample : samples(signal, is_rise)) {
      if (std::abs(sample.share - 0.5) > 0.35) continue;
      ++count;
      sum += sample.share;
      square += sample.share * sample.share;
    }
  }
  const double mean = sum / std::max(count, 1.0);
  return count < 2 * kParts || square / count - mean * mean < kAlike * kAlike;
}

SeenDelay Recording::measure() const {
  const Signal whole = signal(0, TimedImage::kRows);
  refuseNoise(whole);
  const Ramp ramp = middleOf(whole);
  SeenDelay seen;
  seen.ms = ramp.middle_ms;
  seen.uncertainty_ms = uncertaintyOf(middlesMs(whole, ramp));
  const Parts exposures = exposuresMs(ramp);
  seen.exposure_ms = std::max(0.0, meanOf(exposures));
  seen.exposure_uncertainty_ms = uncertaintyOf(exposures);
  measureRows(seen);
  seen.spread_ms =
      std::sqrt(std::max(0.0, ramp.width_ms * ramp.width_ms - seen.exposure_ms * seen.exposure_ms));
  seen.may_be_in_step = mayBeInStep(whole, seen);
  seen.arrival_ms = arrival_ms_;
  seen.frame_hz = 1000 / period_ms_;
  seen.changes = static_cast<int>(changes_.size());
  seen.images = static_cast<int>(images_.size());
  return seen;
}

/// Returns the middle of a range; half the range is its bound, beside `more_ms`. Throws
/// LatencyRefused for a delay that is negative whatever it is.
ProjectorDelay between(double low_ms, double high_ms, double more_ms, std::string basis) {
  if (high_ms + more_ms < 0) {
    throw LatencyRefused(fmt::format(
        "by its stamps the camera sees light {:.0f} ms before it is shown: its clock is not this "
        "machine's (chrony, ntp sets them by each other)",
        -high_ms));
  }
  const double low = std::max(0.0, low_ms), high = std::max(low, high_ms);
  return {(low + high) / 2, (high - low) / 2 + more_ms, std::move(basis)};
}

}  // namespace

TimedImage timedImage(const Picture& picture, std::int64_t stamp_ns, const ClockReading& arrived) {
  if (picture.width < TimedImage::kColumns || picture.height < TimedImage::kRows) {
    throw std::invalid_argument("an image of too few pixels to see light in");
  }
  static const std::array<float, 256> kLight = [] {
    std::array<float, 256> light{};
    for (std::size_t i = 0; i < 256; ++i) {
      light[i] = static_cast<float>(lightOfSrgb(static_cast<double>(i) / 255));
    }
    return light;
  }();
  TimedImage image;
  image.stamp_ns = stamp_ns;
  image.arrived = arrived;
  for (int row = 0; row < TimedImage::kRows; ++row) {
    const int top = row * picture.height / TimedImage::kRows;
    const int bottom = (row + 1) * picture.height / TimedImage::kRows;
    for (int column = 0; column < TimedImage::kColumns; ++column) {
      const int left = column * picture.width / TimedImage::kColumns;
      const int right = (column + 1) * picture.width / TimedImage::kColumns;
      float sum = 0;
      for (int y = top; y < bottom; ++y) {
        for (int x = left; x < right; ++x) sum += kLight[picture.at(x, y)];
      }
      image.light[static_cast<std::size_t>(row * TimedImage::kColumns + column)] =
          sum / static_cast<float>((bottom - top) * (right - left));
    }
  }
  return image;
}

SeenDelay measureDelay(const std::vector<LightChange>& changes,
                       const std::vector<TimedImage>& images) {
  return Recording(changes, images).measure();
}

ProjectorDelay separate(const SeenDelay& seen, StampMeaning stamps,
                        const std::optional<SeenDelay>& reference) {
  const double in_step = seen.may_be_in_step ? 500 / seen.frame_hz : 0;
  if (reference) {
    const double more = in_step + seen.uncertainty_ms + reference->uncertainty_ms +
                        std::abs(seen.rows_ms * (seen.row - reference->row));
    const double ms = seen.ms - reference->ms;
    return between(ms, ms, more, "told apart from the camera's own by the second light");
  }
  const double half = seen.exposure_ms / 2;
  const double more = in_step + seen.uncertainty_ms + std::abs(seen.rows_ms * seen.row) +
                      (stamps == StampMeaning::Middle
                           ? 0
                           : seen.exposure_uncertainty_ms / 2 + kCurve * seen.exposure_ms / 2);
  if (stamps != StampMeaning::Unknown) {
    const double ms = seen.ms + (stamps == StampMeaning::Start ? half : 0) -
                      (stamps == StampMeaning::End ? half : 0);
    return between(ms, ms, more,
                   fmt::format("if images are stamped at the {} of their exposure, as was said",
                               kStampNames[static_cast<std::size_t>(stamps) - 1]));
  }
  if (seen.arrival_ms < kOnArrival_ms) {
    throw LatencyRefused(fmt::format(
        "images are stamped on arrival: of the {:.1f} ms after which light is seen, nobody can "
        "tell which are the camera's, 0 to {:.1f} ms are the projector's. Switch a second light "
        "(--led), or say what the stamps mean (--stamps)",
        seen.ms, std::max(0.0, seen.ms - half)));
  }
  // No stamp is earlier than an exposure's start, and no image arrives before its end.
  return between(seen.ms - half, std::min(seen.ms + half, seen.ms + seen.arrival_ms - half), more,
                 "wherever in its exposure an image is stamped");
}

std::string delayWords(const SeenDelay& seen, const ProjectorDelay& delay) {
  const std::string in_step =
      seen.may_be_in_step
          ? " Images may be in step with the projector's refresh, which hides up to "
            "half of the time between two: give the camera another frame rate."
          : "";
  return fmt::format(
      "The projector's delay is {:.1f} ms, give or take {:.1f}, {}. By the images' stamps light is "
      "seen after {:.1f} ms, give or take {:.1f} ({} changes, {} images, {:.1f} a second); "
      "the exposure, with the light's own rise, takes {:.1f} ms, give or take {:.1f}, single "
      "pictures scatter over "
      "{:.1f} ms, from the first row to the last {:.1f} ms pass, and images arrive {:.1f} ms after "
      "their stamps.{}",
      delay.ms, delay.bound_ms, delay.basis, seen.ms, seen.uncertainty_ms, seen.changes,
      seen.images, seen.frame_hz, seen.exposure_ms, seen.exposure_uncertainty_ms, seen.spread_ms,
      seen.rows_ms, seen.arrival_ms, in_step);
}

// ---------------------------------------------------------------------------------------- running

namespace {

constexpr std::size_t kFirstLook = 24, kChangesBetween = 80, kMostChanges = 640;
constexpr double kGoodEnough_ms = 2;
// Longer than kWindow_ms; at most two flashes a second.
constexpr double kLeastHold_ns = 250e6, kHoldRange_ns = 250e6;
constexpr double kGolden = 0.6180339887498949;  // its multiples fall everywhere alike

std::int64_t holdNs(std::size_t change) {
  const double place = std::fmod(static_cast<double>(change) * kGolden, 1);
  return std::llround(kLeastHold_ns + kHoldRange_ns * place);
}

}  // namespace

LatencyRun::LatencyRun(std::vector<Switch> lights) : lights_(std::move(lights)) {}

std::int64_t LatencyRun::goOn(std::int64_t steady_ns) {
  if (isDone() || steady_ns < due_ns_) return due_ns_;
  const std::size_t count = changes_.size();
  if (count > 0 && (count == kFirstLook || count % kChangesBetween == 0)) measure();
  if (isDone()) return due_ns_;
  const bool is_lit = changes_.size() % 2 == 0;
  changes_.push_back({lights_[seen_.size()](is_lit), is_lit});
  due_ns_ = changes_.back().at.steady_ns + holdNs(changes_.size());
  return due_ns_;
}

void LatencyRun::see(const TimedImage& image) {
  if (!changes_.empty() && !isDone()) images_.push_back(image);
}

void LatencyRun::measure() {
  const SeenDelay seen = measureDelay(changes_, images_);
  const double uncertainty_ms = seen.uncertainty_ms + seen.exposure_uncertainty_ms / 2;
  const bool is_good = changes_.size() >= kChangesBetween && !seen.may_be_in_step &&
                       uncertainty_ms <= kGoodEnough_ms;
  if (!is_good && changes_.size() < kMostChanges) return;
  seen_.push_back(seen);
  changes_.clear();
  images_.clear();
}

}  // namespace afterglow::calib
