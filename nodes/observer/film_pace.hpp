/// \file
/// The pace of a film: which second of a recording it shows when.
#pragma once

#include <utility>
#include <vector>

namespace afterglow::nodes {

/// A part of a film or of a recording, seconds.
struct FilmSpan {
  double begin_s = 0, end_s = 0;
};

/// Two clocks, seconds, by moments at which both are known. Between these they are interpolated;
/// before the first and after the last, and where no moment is known, they run alike.
class ClockPair {
 public:
  /// Moments come in order; the second clock may stand meanwhile.
  void add(double first_s, double second_s) { moments_.emplace_back(first_s, second_s); }
  bool isKnown() const { return !moments_.empty(); }
  double secondAt(double first_s) const;
  /// Returns the first of several such moments, as where the second clock stands.
  double firstAt(double second_s) const;

 private:
  std::vector<std::pair<double, double>> moments_;
};

/// The events of a recording; spans in order of their beginnings.
struct FilmEvents {
  double seconds = 0;  ///< the recording's length
  std::vector<FilmSpan> said;
  std::vector<FilmSpan> moving;
};

/// Returns the clocks of a film and of a recording, which the film shows in at most `most_s`, as
/// far as that can be: what is said at its own pace, of what stands still a moment, and the rest up
/// to four times as fast.
ClockPair filmPace(const FilmEvents& events, double most_s);

}  // namespace afterglow::nodes
