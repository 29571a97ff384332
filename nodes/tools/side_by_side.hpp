/// \file
/// A short film out of two long ones: then on the left, now on the right, without the seconds in
/// which nothing happens.
#pragma once

#include <string>
#include <vector>

namespace afterglow::nodes {

/// A span of a film, seconds from its beginning.
struct FilmSpan {
  double begin_s = 0, end_s = 0;
};
/// The same moment in both films.
struct FilmMoment {
  double then_s = 0, now_s = 0;
};

/// Returns what is worth seeing of `whole`, all in the seconds of now: the surroundings of the
/// moments and all that is said; ordered, apart from each other, and in all at most `most_s` long
/// as far as what is said is. The surroundings are as wide as fits.
std::vector<FilmSpan> keptSpans(const std::vector<FilmMoment>& moments,
                                const std::vector<FilmSpan>& speech, const FilmSpan& whole,
                                double most_s);

struct SideBySide {
  std::string then, now;        ///< MP4 files of one size and rate; may be the same one
  std::string then_label = "THEN", now_label = "NOW";  ///< labels in the pictures' corners
  int width = 1280, strip = 112;  ///< width of both; the strip below their pictures
  int height = 720;               ///< height with the strip
  double then_begin_s = 0;      ///< then's first image; before it then stands still
  FilmSpan lead;                ///< lead of now, first; then stands still meanwhile
  std::vector<FilmSpan> spans;  ///< spans of now, at least one
  std::vector<FilmMoment> moments;  ///< moments that are the same in both
};

/// Returns the second of then for a second of now: as far from the nearest moment.
double thenAt(const std::vector<FilmMoment>& moments, double now_s);

/// ffmpeg's filter graph: sound and strip are those of now, of both pictures the middle is kept.
/// Inputs: then and now for each span, in turns. Outputs: [picture], and [sound] if there is any.
std::string sideBySideGraph(const SideBySide& films, bool has_sound);

/// Writes MP4. `path` is either whole or untouched. Throws std::runtime_error with the path and
/// ffmpeg's own words, std::invalid_argument without a span.
void makeSideBySide(const SideBySide& films, const std::string& path);

}  // namespace afterglow::nodes
