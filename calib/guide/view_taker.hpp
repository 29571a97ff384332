/// \file
/// The moments at which to photograph the board: once it is still and held in a new way, under
/// plain light, then with the pattern on it, then under plain light again, each only when the
/// camera really shows it.
///
/// Cameras and projectors lag, by an image or by many. Whether an image shows the pattern is told
/// by the pattern's tags in it, never by its time. The printed tags before and after the pattern
/// tell whether the board moved in between.
///
/// Makes views of the board, and the check of a calibration, of a camera's images.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "calib/detection/observe.hpp"
#include "calib/frames.hpp"
#include "calib/lens.hpp"
#include "calib/solver/calibration.hpp"
#include "calib/targets/board.hpp"
#include "calib/targets/tag.hpp"
#include "calib/verify/view_check.hpp"

namespace afterglow::calib {

/// A picture for the projector.
enum class Shown { Black, Plain, Pattern };

/// Gray level of Shown::Plain.
constexpr std::uint8_t kPlainGray = 160;

/// The tags and the brightness of one image of the camera.
struct WatchedImage {
  std::int64_t stamp_ns = 0;  ///< time of the photograph
  std::vector<Tag> board;     ///< printed tags, corners in px
  std::set<int> unknown;      ///< ids of tags that are neither the board's nor the pattern's
  int pattern_tags = 0;       ///< number of the pattern's tags in it, wherever they lie
  double mean_level = 0;      ///< gray levels
};

struct TakerOptions {
  std::int64_t still_ns = 500'000'000;  ///< so long the board must not have moved
  double still_px = 0.5;                ///< root mean square of the corners' movement
  std::size_t still_images = 3;         ///< least number of images within still_ns
  int settle_images = 2;                ///< images to wait once the camera shows what is projected
  double settled_levels = 2;            ///< the mean gray of two such images differs by less
  std::int64_t patience_ns = 4'000'000'000;  ///< time that the camera has to show what is projected
  std::size_t fewest_board_tags = 4;
  int fewest_pattern_tags = 3;
  double new_turn_rad = 0.16;  ///< a board is new if its normal is turned by so much,
  double new_shift = 0.12;     ///< or its middle has moved by so much of its distance
};

/// The consequences of an image.
struct TakerAnswer {
  enum class Keep { Nothing, Pattern, Plain };
  Shown show = Shown::Plain;
  Keep keep = Keep::Nothing;  ///< the photograph that this image is; Plain is 2nd
  bool is_complete = false;   ///< true once both photographs are there
  std::string discarded;      ///< the reason for giving up a view that was begun, with an advice
  /// The reason why no view is begun.
  enum class Lack { Nothing, Light, Board, WholeBoard, Stillness, News } lack = Lack::Nothing;
  std::optional<Rigid<Camera, Surface>> T_camera_board;
};

/// Has no clock and no thread.
class ViewTaker {
 public:
  ViewTaker(Board board, const Lens& camera, TakerOptions options = {});

  /// Frames in the order of their stamps; one that is older than the last is ignored. `taken`:
  /// where the board was in the views there are.
  TakerAnswer see(const WatchedImage& image, const std::vector<Rigid<Camera, Surface>>& taken);
  /// Begins with the next image that shows the board, even if it moves or was held so before.
  void force() { is_forced_ = true; }
  /// Gives up the view that was begun and forgets all images.
  void reset();

 private:
  enum class Step { Watch, AwaitPattern, AwaitPlain };
  TakerAnswer watch(const WatchedImage& image, const std::vector<Rigid<Camera, Surface>>& taken);
  TakerAnswer awaitPattern(const WatchedImage& image);
  TakerAnswer awaitPlain(const WatchedImage& image);
  TakerAnswer giveUp(const std::string& reason);
  std::optional<Rigid<Camera, Surface>> poseOf(const WatchedImage& image) const;
  bool isStill() const;
  bool isNew(const Rigid<Camera, Surface>& T_camera_board,
             const std::vector<Rigid<Camera, Surface>>& taken) const;
  bool isSettled(const WatchedImage& image, bool is_right);
  void await(Step step, std::int64_t now_ns);

  Board board_;
  Lens camera_;
  TakerOptions options_;
  Step step_ = Step::Watch;
  bool is_forced_ = false;
  std::int64_t last_stamp_ns_ = 0, awaited_since_ns_ = 0;
  std::deque<WatchedImage> recent_;  ///< images under plain light, the last still_ns
  WatchedImage before_;              ///< the last under plain light before the pattern
  std::optional<Rigid<Camera, Surface>> T_camera_board_;
  int right_images_ = 0;
  double last_level_ = 0;
};

class TagDetector;

/// Builds views of one board, pattern and camera, of which it keeps copies. One thread at a time.
class ViewBuilder {
 public:
  /// Throws std::invalid_argument for families that libapriltag does not know.
  ViewBuilder(const Board& board, const Pattern& pattern, const Lens& camera);
  ~ViewBuilder();

  const Lens& camera() const { return camera_; }
  /// The quick look at every image: which tags of the board and of the pattern are in it. At half
  /// the resolution where the image has enough of it. Throws std::invalid_argument for images below
  /// 16 px a side.
  WatchedImage look(const Picture& picture, std::int64_t stamp_ns) const;
  /// Keeps the image as a photograph of the view of this name, if it is one.
  void keep(TakerAnswer::Keep kind, const std::string& view_name, Picture picture);

  /// The photographs of the view that is being taken.
  const Photographs& photographs() const { return photographs_; }
  /// The view that the photographs show.
  View read() const;
  /// Measures how far light lands from where the calibration has it, in a view that read() gave.
  ViewCheck check(const View& view, const Calibration& calibration) const;

 private:
  const Board board_;
  const Pattern pattern_;
  const Lens camera_;
  const ViewReader reader_;
  std::set<int> board_ids_, pattern_ids_;
  std::unique_ptr<TagDetector> detector_;
  std::unique_ptr<TagDetector> pattern_detector_;  ///< null if the families are the same
  Photographs photographs_;
};

}  // namespace afterglow::calib
