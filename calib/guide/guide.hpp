/// \file
/// A live calibration from the first view to the check, as a state machine: fed with what the
/// camera saw, it says what to project, what to photograph, when to solve, and what to tell the
/// person with the board. It owns no clock, thread, file or topic.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calib/detection/view.hpp"
#include "calib/guide/prompter.hpp"
#include "calib/guide/view_taker.hpp"
#include "calib/landing.hpp"
#include "calib/solver/calibration.hpp"
#include "calib/targets/board.hpp"
#include "calib/targets/pattern.hpp"

namespace afterglow::calib {

struct GuideOptions {
  TakerOptions taker;
  int views = 16;         ///< are enough, if they
  double coverage = 0.5;  ///< have lit this share of the projector's picture; twice as many always
};

/// Idle: not started, or stopped. Solving: the owner solves and calls solved or refused.
/// Verifying: the next view is the check; the owner calls checked. Done: until start.
enum class GuidePhase { Idle, Collecting, Solving, Verifying, Done };

/// "collecting", ...
std::string phaseName(GuidePhase phase);

class Guide {
 public:
  Guide(Board board, Pattern pattern, Lens camera, GuideOptions options = {});

  /// Forgets all views and begins.
  void start();
  void stop();
  /// The next frame that shows the board begins a view. False if no views are being taken.
  bool forceView();
  /// Goes on to Solving with what there is. False without a view, or while it is solving.
  bool solveNow();
  /// The view taken last is forgotten; its name, or nothing if there is none or it is too late.
  std::optional<std::string> discardLast();

  /// The next frame. Keep and is_complete only while views are taken.
  TakerAnswer see(const WatchedFrame& frame);
  /// What the photographs of a complete view showed: becomes a view, or is discarded with a reason.
  /// True if it is one; false also if somebody has stopped in the meantime.
  bool addView(const View& view, const Rigid<Camera, Surface>& T_camera_board);

  void solved(const Calibration& calibration);
  /// The reasons are told; views are collected on.
  void refused(const std::vector<std::string>& reasons);
  /// The check view's errors; without corners it could not be measured, and another one is needed.
  void checked(const ErrorSummary& errors);
  /// Something the owner has to tell (a file that cannot be written, a camera that is silent).
  void tell(const std::string& text);

  std::vector<Utterance> takeUtterances() { return prompter_.take(); }
  GuidePhase phase() const { return phase_; }
  /// What the projector has to show now.
  Shown shown() const;
  const std::vector<View>& views() const { return views_; }
  /// "view_07", for the view that comes next.
  std::string nextName() const;
  int viewsWanted() const { return views_wanted_; }
  int discarded() const { return discarded_; }
  double coverage() const { return coverage_.share(); }
  /// "7 of 16 views, coverage 63 %"
  std::string progress() const;

 private:
  void collect();
  void discard(const std::string& reason);
  void advise(const TakerAnswer& answer, const WatchedFrame& frame);
  std::string adviceText(const TakerAnswer& answer, const WatchedFrame& frame) const;
  bool isEnough() const;

  Board board_;
  Pattern pattern_;
  GuideOptions options_;
  ViewTaker taker_;
  Prompter prompter_;
  GuidePhase phase_ = GuidePhase::Idle;
  Shown wanted_ = Shown::Plain;  ///< by the taker
  std::vector<View> views_;
  std::vector<Rigid<Camera, Surface>> poses_;  ///< of views_
  Coverage coverage_;
  int views_wanted_ = 0, discarded_ = 0, named_ = 0;
  std::size_t turn_ = 0;  ///< which of several wishes is uttered
  double promised_mm_ = 0;
  std::int64_t now_ns_ = 0;
};

}  // namespace afterglow::calib
