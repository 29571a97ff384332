/// \file
/// Films of `afterglow render --film`: the room that a behavior lights, with captions and sound.
///
/// A behavior that a verb is given by words or as a bag, and the store it lies in.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "nodes/behavior_view/moment_painter.hpp"
#include "replay/store/store.hpp"

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
  /// For each film, words before it, and behind it over its brightest picture; empty: none.
  std::vector<std::string> titles, closings;
};

/// Makes the films, all of the same pictures, each at its own pace (filmPace()), with progress on
/// stderr. Throws std::runtime_error, one line.
void makeFilms(const FilmOptions& options);

/// Tells a line on stderr, unless it is empty.
void tell(const std::string& remark);
/// Tells a dark picture's reasons in one line; of a lit one a line for each thing that it does not
/// show.
void tellDark(const std::vector<std::string>& reasons, const char* what, bool is_lit);

struct BehaviorSource {
  std::unique_ptr<replay::Store> store;
  replay::Behavior behavior;
  std::string name;  ///< name for people
};

/// Opens a behavior: `what` selects one of the store at `store` (findBehavior()); what is a file,
/// or looks like the name of one, is a bag. A bag is read into memory, with progress on stderr.
/// Throws replay::StoreError, and std::runtime_error for a bag that cannot be read.
BehaviorSource openBehavior(const std::string& what, const std::string& store);

/// Returns how long the behavior is, seconds (endOf()).
double secondsOf(const BehaviorSource& source);

}  // namespace afterglow::nodes
