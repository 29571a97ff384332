/// \file
/// Pictures of a recorded behavior's moments, for `afterglow render`, for pages and for the
/// console.
///
/// `afterglow render --view observer` and `--film`: the room as a bystander sees it, with the
/// projected light falling on it.
#pragma once

#include <CLI/App.hpp>
#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "calib/lens.hpp"
#include "nodes/behavior_view/behavior_page.hpp"
#include "nodes/fetch/robot_model.hpp"
#include "nodes/observer/room_view.hpp"
#include "nodes/projector/projector_config.hpp"
#include "nodes/projector/recorded_scene.hpp"
#include "render/compose/light_census.hpp"
#include "render/gl/gl_context.hpp"
#include "render/gl/observer_renderer.hpp"
#include "render/light_blend.hpp"
#include "render/projector_renderer.hpp"
#include "replay/store/store.hpp"

namespace afterglow::nodes {

struct ObserverOptions {
  std::string eye, look_at;  ///< "x,y,z": fixed frame, meters; both or none
  std::string room;          ///< file, as assets/demo/view.yaml
  std::string place;         ///< place to look from, one of the room's
  std::string urdf;
  std::vector<int> size;  ///< width, height, pixels; empty: the room's

  bool isGiven() const { return !(eye + room + urdf).empty() || !size.empty(); }
};

/// --eye, --look-at, --room, --place and --urdf.
void addObserverOptions(CLI::App& verb, ObserverOptions& options);

/// Solid are the recorded /room/solids, the robot where tf had it (of a URDF that is given, else of
/// the recording), the configuration's surfaces, floor and walls. Where nobody says where to look
/// from and what room it is, roomAround() does. The store must outlive this; the thread of
/// `context`.
class ObservedPictures {
 public:
  /// Throws std::runtime_error for a room, a place or a URDF that cannot be used.
  ObservedPictures(render::GlContext& context, const replay::Store& store,
                   const replay::Behavior& behavior, const ProjectorConfig& config,
                   const calib::Lens& lens, const ObserverOptions& options);

  int width() const { return room_view_.width; }
  /// The height of a picture so many pixels wide.
  int heightOf(int width) const {
    return std::max(1, width * room_view_.height / room_view_.width);
  }
  /// Draws the room in this size. `projected` is the image of `snapshot` through the lens. Moments
  /// must not decrease.
  render::Image seeAt(int width, int height, replay::Stamp moment, const SceneSnapshot& snapshot,
                      render::Image projected);
  /// Returns true if the last picture shows something that is gone.
  bool hasGhosts() const { return has_ghosts_; }

  /// Begins anew: now moments may lie before the last one.
  void restart();

 private:
  Look lookAt(replay::Stamp moment, bool is_lit);
  std::vector<render::Drawable> solids(replay::Stamp moment, const SceneSnapshot& snapshot);

  const replay::Store& store_;
  const replay::Behavior behavior_;
  const std::string fixed_frame_;
  const calib::Lens lens_;
  RoomView room_view_;
  std::optional<RecordedScene> room_;  ///< /room/solids, and tf for the robot
  std::optional<FrameLookup> frames_;
  std::optional<RobotModel> robot_;
  render::ObserverRenderer renderer_;
  bool has_ghosts_ = false;
  std::optional<replay::Stamp> last_;  ///< last picture's moment; empty: none since the beginning
  double closeness_ = 0;               ///< 0 at the place, 1 near to what is lit
};

/// Files and names on a command line, or in a node's parameters.
struct PictureOptions {
  std::string config, calibration, projector;
  ObserverOptions observer;
};

/// --config, --calibration, --projector and the options of the room.
void addPictureOptions(CLI::App& verb, PictureOptions& options);

/// The light and the place of a bystander's eyes.
struct PictureSettings {
  /// That of a single projector; behind it come those that it shares its light with.
  ProjectorConfig config;
  calib::Lens lens;                 ///< its camera_info's
  std::vector<calib::Lens> others;  ///< lenses of those behind it
  std::string remark;               ///< remark on the lens's file, or empty
  ObserverOptions observer;
};

/// Reads the configuration and chooses its projector by name, or its only one. Throws
/// std::runtime_error, one line.
PictureSettings readPictureSettings(const PictureOptions& options);

/// Returns the same lens as if its picture was so many pixels wide.
calib::Lens lensOfWidth(const calib::Lens& lens, int width);

/// Draws one behavior in one view, moment by moment: going on is faster than going back, which
/// begins again. The store has to outlive it; the thread of `context`.
class MomentPainter {
 public:
  /// `width`: pixels; 0: as many as the projector's image, or the room's, has. Throws
  /// replay::StoreError, and std::runtime_error where it cannot be drawn.
  MomentPainter(render::GlContext& context, const replay::Store& store,
                const replay::Behavior& behavior, const PictureSettings& settings, PictureView view,
                int width = 0);

  const replay::Behavior& behavior() const { return behavior_; }
  replay::Stamp begin() const { return behavior_.begin; }
  /// The last moment of the behavior.
  replay::Stamp last() const { return last_; }
  // Of picture().
  int width() const;
  int height() const;

  /// Throws as RecordedScene::at().
  void moveTo(replay::Stamp moment);
  /// Moves so many seconds into the behavior, or to its begin or end where it has no such moment.
  void moveTo(double t);

  /// Returns the first moment at which the projector's image has light, of some fifty, evenly over
  /// the behavior, in seconds since its begin; empty if none has any, or it takes seconds to find.
  /// Goes there.
  std::optional<double> moveToLight();

  // At this moment:
  /// Returns true if the projector is known and a layer has content, in its image or beside it.
  bool hasContent() const;
  /// Returns true if the projector's image has any light.
  bool isLit() { return render::isLit(lensImage()); }
  /// Returns a line for each thing that is not shown, with the reason (RecordedScene::whyDark).
  std::vector<std::string> whyDark(bool is_lit);
  /// The image as it is sent to the projector.
  render::Image projected();
  /// The image as the view has it: projected(), or the room that it lights.
  render::Image picture();
  /// The room in another size. Needs the view of a bystander.
  render::Image room(int width, int height);
  /// Returns true if the last picture shows something that is gone.
  bool hasGhosts() const { return observed_ && observed_->hasGhosts(); }
  /// The image through the lens, without what is done to what is sent.
  const render::Image& lensImage();
  /// picture() as JPEG, with the reasons of what is dark.
  MomentJpeg jpeg();

 private:
  void restart();

  const replay::Store& store_;
  const replay::Behavior behavior_;
  const PictureSettings settings_;
  const int width_;
  const calib::Lens lens_;
  const replay::Stamp last_;
  render::LightOutput light_;
  std::unique_ptr<render::LightBlend> blend_;  ///< where light is shared
  render::ProjectorRenderer renderer_;
  render::LightCensus census_;  ///< counts by the lens itself, however small the picture
  std::optional<RecordedScene> scene_;
  std::optional<ObservedPictures> observed_;
  replay::Stamp now_;  ///< moment that moveTo() went to last
  SceneSnapshot snapshot_;
  std::optional<render::Image> image_;  ///< image through the lens, once it is drawn
};

}  // namespace afterglow::nodes
