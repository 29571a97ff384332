/// \file
/// A live calibration from the first view to the check, as a state machine: fed with what the
/// camera saw, it says what to project, what to photograph, when to solve, and what to tell the
/// person with the board. It owns no clock, thread, file or topic.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "calib/detection/observe.hpp"
#include "calib/frames.hpp"
#include "calib/guide/view_taker.hpp"
#include "calib/landing.hpp"
#include "calib/solver/calibration.hpp"
#include "calib/targets/board.hpp"
#include "calib/targets/pattern.hpp"

namespace afterglow::calib {

/// Returns how far the board's face is turned away from the camera, as the camera sees it: x to the
/// right, y down; radians, zero where it looks straight into the lens.
Eigen::Vector2d boardTilt(const Rigid<Camera, Surface>& T_camera_board);

/// A ninth of the projector's picture, counted from its top left.
struct PictureNinth {
  static constexpr int kSide = 3;  ///< ninths a side
  int row = 0, column = 0;
};
/// Returns the ninths in which boards were hardly lit, the emptiest first.
std::vector<PictureNinth> missingPlaces(const Coverage& coverage);

/// Tilts are named as the camera sees them (left, right, up, down), places in the light as they are
/// in the projector's image. Most urgent first; empty if nothing is missing. `now`: where the board
/// is held, if it is seen.
std::vector<std::string> adviceFor(const std::vector<Rigid<Camera, Surface>>& taken,
                                   const Coverage& coverage,
                                   const std::optional<Rigid<Camera, Surface>>& now);

/// Returns true if all boards are so nearly parallel that the projector's lens cannot be told from
/// them.
bool areParallel(const std::vector<Rigid<Camera, Surface>>& taken);

/// A sentence to the person who holds the board.
struct Utterance {
  std::string text;
  bool is_spoken = true;   ///< else only written
  bool is_advice = false;  ///< else an event
};

/// Chooses when to speak: events at once, advice only when it has been the same for a while, and
/// not over and over. Has no clock: times are the stamps of images.
class Prompter {
 public:
  /// An event: written and spoken, but not spoken twice in a row within seconds.
  void tell(const std::string& text, std::int64_t now_ns);
  /// Advice for the present image. True if the same advice was repeated because nothing came of it,
  /// so that another should be tried.
  bool advise(const std::string& text, std::int64_t now_ns);
  /// The utterances since the last call.
  std::vector<Utterance> take();

 private:
  std::vector<Utterance> waiting_;
  std::string candidate_, written_, spoken_;
  std::string told_;
  std::int64_t candidate_since_ns_ = 0, spoken_at_ns_ = 0, told_at_ns_ = 0;
};

struct GuideOptions {
  TakerOptions taker;
  int views = 16;         ///< enough if they reach `coverage`; twice as many are always enough
  double coverage = 0.5;  ///< share of the projector's image that was lit on boards
  bool times_delay = false;  ///< whether the projector's delay is measured after the check
};

/// Idle: not started, or stopped. Solving: the owner solves and calls solved or refused.
/// Verifying: the next view is the check; the owner calls checked. Timing: the owner measures the
/// projector's delay and calls timed. Done: until start.
enum class GuidePhase { Idle, Collecting, Solving, Verifying, Timing, Done };

/// "collecting", ...
std::string phaseName(GuidePhase phase);

/// The state machine.
class Guide {
 public:
  Guide(Board board, Pattern pattern, const Lens& camera, GuideOptions options = {});

  /// Forgets all views and begins.
  void start();
  void stop();
  /// The next image that shows the board begins a view. False if no views are being taken.
  bool forceView();
  /// Goes on to Solving with the views there are. False without a view, or while it is solving.
  bool solveNow();
  /// Forgets the last view and returns its name; empty if there is none or it is too late.
  std::optional<std::string> discardLast();

  /// The next image. The answer keeps images only while views are taken.
  TakerAnswer see(const WatchedImage& image);
  /// Adds the view of a complete pair of photographs, or discards it with a reason. Returns whether
  /// it was added; false also if the calibration has been stopped meanwhile.
  bool addView(const View& view, const Rigid<Camera, Surface>& T_camera_board);

  void solved(const Calibration& calibration);
  /// Tells the reasons and goes on collecting views.
  void refused(const std::vector<std::string>& reasons);
  /// The check view's errors. Without corners nothing was measured, and another view is needed.
  void checked(const ErrorSummary& errors);
  /// `words`: the delay that was measured, or why it was not, for people.
  void timed(const std::string& words);
  /// Something the owner has to tell (a file that cannot be written, a camera that is silent).
  void tell(const std::string& text);

  std::vector<Utterance> takeUtterances() { return prompter_.take(); }
  GuidePhase phase() const { return phase_; }
  /// Returns the picture that the projector has to show now.
  Shown shown() const;
  const std::vector<View>& views() const { return views_; }
  /// "view_07", for the view that comes next.
  std::string nextName() const;
  int viewsWanted() const { return views_wanted_; }
  int discarded() const { return discarded_; }
  const Coverage& coverage() const { return coverage_; }
  /// "7 of 16 views, coverage 63 %"
  std::string progress() const;

 private:
  void collect();
  void discard(const std::string& reason);
  void advise(const TakerAnswer& answer, const WatchedImage& image);
  std::string adviceText(const TakerAnswer& answer, const WatchedImage& image) const;
  bool isEnough() const;

  Board board_;
  Pattern pattern_;
  GuideOptions options_;
  ViewTaker taker_;
  Prompter prompter_;
  GuidePhase phase_ = GuidePhase::Idle;
  Shown wanted_ = Shown::Plain;  ///< the taker's wish
  std::vector<View> views_;
  std::vector<Rigid<Camera, Surface>> poses_;  ///< the poses of views_
  Coverage coverage_;
  int views_wanted_ = 0, discarded_ = 0, named_ = 0;
  std::size_t turn_ = 0;  ///< counts the turns of several pieces of advice
  double promised_mm_ = 0;
  std::int64_t now_ns_ = 0;
};

}  // namespace afterglow::calib
