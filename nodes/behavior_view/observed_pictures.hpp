/// \file
/// `afterglow render --view observer` and `--film`: the room as a bystander sees it, with the
/// projected light falling on it.
#pragma once

#include <CLI/App.hpp>
#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "nodes/fetch/robot_model.hpp"
#include "nodes/observer/room_view.hpp"
#include "nodes/projector/recorded_scene.hpp"
#include "render/gl/observer_renderer.hpp"

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

}  // namespace afterglow::nodes
