/// \file
/// A video with the sound of what is said in it.
///
/// The pace of a film: which second of a recording it shows when.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "nodes/speaker/sound.hpp"
#include "nodes/tools/video_writer.hpp"
#include "render/scene/image.hpp"

namespace afterglow::nodes {

/// Images at a constant rate. Errors are VideoWriter's.
class Film {
 public:
  Film(const std::string& path, int width, int height, int fps);

  /// Shows the image after those that were added before.
  void add(const render::Image& image);
  /// Finishes the film, which is either whole or not there. The onsets in `said` count from its
  /// beginning; what sounds is as loud as spoken video usually is. A film without an image is an
  /// error. Where its sound cannot be made, the error says where the film without sound is.
  void close(const std::vector<Utterance>& said);

 private:
  const std::string path_, silent_path_;
  const int fps_;
  std::int64_t count_ = 0;  ///< images written
  VideoWriter writer_;
};

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
