/// \file
/// A projector's delay: from the moment at which a picture is handed over to the moment at which it
/// is light, measured with a camera.
///
/// Only a sum can be observed: by the stamps of a camera's images, light comes after the
/// projector's delay and the camera's own offset, which is the stamp less the middle of the
/// exposure. The exposure's length shows in the images that a change divides, so that an offset of
/// half an exposure is known; the rest of the offset (transport, where images are stamped on
/// arrival) shows only beside a second light that is switched by the same clock and has no delay.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "calib/picture.hpp"

namespace afterglow::calib {

/// A moment by the clock that stamps messages and by one that never jumps.
struct ClockReading {
  std::int64_t wall_ns = 0, steady_ns = 0;
};

/// The moment at which a light was told to go on or off.
struct LightChange {
  ClockReading at;
  bool is_lit = false;
};

/// An image as mean light of each cell of a grid.
struct TimedImage {
  static constexpr int kColumns = 16, kRows = 12;

  std::int64_t stamp_ns = 0;
  ClockReading arrived;
  std::array<float, std::size_t{kColumns} * kRows> light{};  ///< row by row; 1: full scale
};

/// Throws std::invalid_argument for an image with fewer pixels than the grid has cells.
TimedImage timedImage(const Picture& picture, std::int64_t stamp_ns, const ClockReading& arrived);

/// A measurement that cannot be used; what() says why, and what to do.
class LatencyRefused : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The delay of a light as the images' stamps have it.
struct SeenDelay {
  double ms = 0;              ///< from the change to the stamp of an image that is half lit by it
  double uncertainty_ms = 0;  ///< of that, with a certainty of 95 %
  double exposure_ms = 0;     ///< length of the exposure, the light's own rise included
  double exposure_uncertainty_ms = 0;
  double spread_ms = 0;   ///< the range over which single changes scatter
  double rows_ms = 0;     ///< how much later the lowest row sees it than the first
  double row = 0;         ///< mean row of the light, 0 the first, 1 the last
  double arrival_ms = 0;  ///< from the stamp to the arrival of an image, median
  double frame_hz = 0;
  /// Whether images and the light's refresh may be in step, so that the light comes always at the
  /// same place between two images, and nobody sees where.
  bool may_be_in_step = false;
  int changes = 0, images = 0;
};

/// Needs changes at moments that have nothing to do with the camera's. Throws LatencyRefused:
/// images too few or too rare, a clock that jumped or is another machine's, no light that follows
/// the changes, a room whose light flickers or a camera that adapts.
SeenDelay measureDelay(const std::vector<LightChange>& changes,
                       const std::vector<TimedImage>& images);

/// The moment that a camera's driver stamps, as far as somebody knows.
enum class StampMeaning { Unknown, Start, Middle, End };
/// The names of StampMeaning from Start on.
inline const std::vector<std::string> kStampNames = {"start", "middle", "end"};

/// The projector's own delay: `ms`, give or take `bound_ms`.
struct ProjectorDelay {
  double ms = 0, bound_ms = 0;
  std::string basis;  ///< how it was told apart from the camera's offset, for people
};

/// `reference`: a light without a delay, seen by the same camera; empty: there was none. Throws
/// LatencyRefused if light is seen before it is shown, and if images are stamped on arrival and
/// there was no reference: the camera's transport may be any part of what was seen.
ProjectorDelay separate(const SeenDelay& seen, StampMeaning stamps,
                        const std::optional<SeenDelay>& reference);

/// Returns what was measured, in two or three sentences.
std::string delayWords(const SeenDelay& seen, const ProjectorDelay& delay);

/// A measurement as it runs: switches one light after the other on and off, until the delay of each
/// is known to two milliseconds, for four minutes at most. It has no clock and no thread.
class LatencyRun {
 public:
  /// Switches a light and returns the moment.
  using Switch = std::function<ClockReading(bool is_lit)>;

  explicit LatencyRun(std::vector<Switch> lights);

  /// Switches what is due, and returns when the next change is, by the steady clock. Throws
  /// LatencyRefused as measureDelay, as soon as that can be said.
  std::int64_t goOn(std::int64_t steady_ns);
  void see(const TimedImage& image);

  bool isDone() const { return seen_.size() == lights_.size(); }
  /// The delays of the lights, once it is done.
  const std::vector<SeenDelay>& seen() const { return seen_; }

 private:
  void measure();

  std::vector<Switch> lights_;
  std::vector<SeenDelay> seen_;
  std::vector<LightChange> changes_;  ///< of the light that is switched now
  std::vector<TimedImage> images_;
  std::int64_t due_ns_ = 0;
};

}  // namespace afterglow::calib
