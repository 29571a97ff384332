/// \file
/// Films of `afterglow render --film`: the room that a behavior lights, with captions and sound.
#pragma once

#include <string>
#include <vector>

#include "nodes/behavior_view/moment_painter.hpp"

namespace afterglow::nodes {

struct FilmOptions {
  std::string what;  ///< a behavior's id, or a bag
  std::string store;
  PictureOptions pictures;
  std::vector<std::string> out;
  int fps = 30;
  std::string beside;             ///< a second behavior; empty: none
  std::string caption;            ///< empty: what is recorded
  std::vector<double> at_most_s;  ///< for each film, seconds; empty: as long as the behavior
};

/// Makes the films, all of the same pictures, each at its own pace (filmPace()), with progress on
/// stderr. Throws std::runtime_error, one line.
void makeFilms(const FilmOptions& options);

/// Tells a line on stderr, unless it is empty.
void tell(const std::string& remark);
/// Tells a dark picture's reasons in one line; of a lit one a line for each thing that it does not
/// show.
void tellDark(const std::vector<std::string>& reasons, const char* what, bool is_lit);

}  // namespace afterglow::nodes
