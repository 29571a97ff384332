/// \file
/// A projector of projector_node: its lens, its pictures of the one scene, its topics, and the
/// hand-over to its window.
#pragma once

#include <ros/ros.h>
#include <sensor_msgs/Image.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "calib/lens.hpp"
#include "nodes/conversion/camera_messages.hpp"
#include "nodes/projector/output_config.hpp"
#include "nodes/projector/stage_times.hpp"
#include "render/compose/light_census.hpp"
#include "render/light_output.hpp"
#include "render/paint/dark_mask.hpp"
#include "render/projector_renderer.hpp"

namespace afterglow::nodes {

class ProjectorOutput {
 public:
  /// Topics lie below `own`, those of a projector with a name below that. The beam (beamMarkers) is
  /// published so long, in meters; 0: not at all. `is_blended`: it shares light with others. Throws
  /// std::runtime_error: the lens's file, and why.
  ProjectorOutput(const OutputConfig& config, const ros::NodeHandle& own, double beam_m,
                  bool is_blended);

  const calib::Lens& lens() const { return lens_; }
  const OutputConfig& config() const { return config_; }

  // In the drawing thread, where the context is.
  void startDrawing(render::GlContext& context);
  /// Begins a picture; black without a pose. A GPU draws on while other outputs' are begun.
  /// `avoided`: stays dark; null: light avoids nothing.
  void beginDrawing(const render::Scene& scene,
                    const std::optional<Rigid<Projector, World>>& T_projector_world,
                    const std::vector<render::AvoidedPoints>* avoided);
  /// Publishes that picture, begun at ROS time `now` and expected to take so long, and lays it out
  /// for takePicture(). `light`: its pixels'; nullptr: all of theirs.
  void finishDrawing(ros::Time now, std::int64_t drawing_ns, const render::PixelLight* light,
                     StageTimes& times);
  /// Counts for census(), once a second; behind the drawing, which does not wait for it.
  void takeCensus(const render::Scene& scene,
                  const std::optional<Rigid<Projector, World>>& T_projector_world);
  void stopDrawing();  ///< called before the context ends

  /// Publishes the last picture, after drawing has ended.
  void publishBlack();

  // In the window's thread.
  /// The newest picture that has not been taken.
  std::optional<render::Image> takePicture();
  /// A taken picture, for its memory.
  void giveBack(render::Image&& picture);
  render::Image black() const;
  /// Sets why its window is not on its screen; empty: it is, or there is none.
  void setWindowProblem(const std::string& problem);

  // In any thread.
  std::string renderer() const;
  std::string windowProblem() const;
  /// Returns the census of a picture of the last seconds, by layer; empty: there is none, or it had
  /// no pose.
  std::vector<render::LayerCensus> census() const;
  /// Returns the share of the last picture that is kept dark; empty: light avoids nothing, or it
  /// had no pose.
  std::optional<double> avoidedShare() const;
  /// Returns what became of the last picture's light on textured surfaces.
  std::vector<render::TextureReport> textures() const;

 private:
  void publish(render::Image& image, ros::Time drawn_for);

  OutputConfig config_;
  calib::Lens lens_;
  render::LightOutput light_;
  std::unique_ptr<render::ProjectorRenderer> renderer_;
  std::unique_ptr<render::DarkMask> mask_;  ///< mask, where light avoids something
  bool is_masked_ = false;  ///< true if the picture that was begun is to be kept dark in part
  /// Of the picture that was begun: its pose, if it has light, and surfaces, if any is textured.
  std::optional<Rigid<Projector, World>> T_projector_world_;
  std::vector<render::SurfacePatch> surfaces_;
  std::chrono::steady_clock::duration begun_in_{0};
  render::LightCensus counter_;
  std::chrono::steady_clock::time_point counted_at_{};
  ros::Publisher image_publisher_, camera_info_publisher_, beam_publisher_;
  sensor_msgs::Image message_;  ///< lends its header; the pixels are the picture's

  mutable std::mutex mutex_;  ///< guards what follows
  std::optional<render::Image> picture_;
  render::Image spare_;  ///< memory to draw into next
  std::string description_;
  std::string window_problem_;
  std::vector<render::LayerCensus> census_;
  std::optional<double> avoided_share_;
  std::vector<render::TextureReport> textures_;
};

}  // namespace afterglow::nodes
