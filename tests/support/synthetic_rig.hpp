/// \file
/// A camera, a projector, a board and a floor of known truth, and a photographer of them: ray-cast,
/// in linear light. Ranges and light as in the referee, tests/referee/procam_sim.py.
/// World: the projector's stand, z up, the floor z = 0. Everything is repeatable from its seeds.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "calib/detection/observe.hpp"
#include "calib/solver/calibration.hpp"

namespace afterglow::test {

enum class RigKind { Standard, LensShift, Wide, ShortThrow };

using BoardPose = Rigid<World, Surface>;

/// Plain values: change any before use. What is printed (`board`) may differ from the layout that
/// the code under test is given.
struct SyntheticRig {
  calib::Lens camera, projector;
  Rigid<World, Camera> T_world_camera;
  Rigid<World, Projector> T_world_projector;
  calib::Board board;      ///< A2 by default
  calib::Pattern pattern;  ///< of the projector's resolution
  /// The board sags by so much over its length, and its corners stand so far off its plane, two
  /// above and two below it; in views of corners, not in photographs.
  double sag_m = 0, twist_m = 0;
  double ambient = 0.25, projector_gain = 3, blur_px = 0.6, noise_gray = 1.5;

  /// Of a place on the board above its frame's plane.
  double height_m(const Eigen::Vector2d& on_board) const;
  /// What a perfect calibration finds; covariance zero.
  calib::ProjectorEstimate truth() const;
};

/// The camera looks the same way whatever its resolution (4:3).
SyntheticRig makeRig(RigKind kind, std::uint32_t seed, int camera_width = 1280);

/// A standard rig of fewer pixels (projector 640 x 400, camera 800 x 600), whose pictures are made
/// and read in a third of the time.
SyntheticRig makeSmallRig(std::uint32_t seed);

/// Random poses in the beam, 1 to 1.8 m away, whole in the camera's picture, tilted up to 35
/// degrees and turned toward the camera. Throws std::runtime_error if too few fit.
std::vector<BoardPose> boardPoses(const SyntheticRig& rig, int count, std::uint32_t seed);

/// What the projector shows.
calib::Picture patternPicture(const calib::Pattern& pattern);
calib::Picture grayPicture(int width, int height, std::uint8_t gray = 160);
/// `shown` seen through a homography of the projector's pixels (as keystone correction does):
/// H_shown_from maps a pixel of the result to one of `shown`; black outside.
calib::Picture warped(const calib::Picture& shown, const Eigen::Matrix3d& H_shown_result);

/// Photographs the rig; two threads.
class Photographer {
 public:
  explicit Photographer(const SyntheticRig& rig);
  ~Photographer();
  Photographer(Photographer&&) noexcept;

  /// Without a pose there is only the floor. `shown` may have any size: the projector stretches it
  /// to its own.
  calib::Picture photograph(const std::optional<BoardPose>& pose, const calib::Picture& shown,
                            std::uint32_t seed) const;
  /// Pattern and plain picture of a pose.
  calib::Photographs photographs(const std::string& name, const BoardPose& pose,
                                 std::uint32_t seed) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// A picture through Photographer, for those who take few.
calib::Picture photograph(const SyntheticRig& rig, const std::optional<BoardPose>& pose,
                          const calib::Picture& shown, std::uint32_t seed);

/// Where the middle of light sent through a projector pixel meets the board: meters in its frame.
std::optional<Eigen::Vector2d> lightOnBoard(const SyntheticRig& rig, const BoardPose& pose,
                                            const Eigen::Vector2d& projector_px);

/// A view without pictures: the true corners of all printed tags, and of the projected ones in the
/// board's free middle, with Gaussian noise of sigma_px on each coordinate (and in the
/// covariances).
calib::View cornerView(const SyntheticRig& rig, const std::string& name, const BoardPose& pose,
                       double sigma_px, std::uint32_t seed);
/// Of random poses: view_00, view_01, ...
std::vector<calib::View> cornerViews(const SyntheticRig& rig, int count, double sigma_px,
                                     std::uint32_t seed);

/// A name as the referee's pictures have it: view_03.
std::string viewName(int index);

/// Points spread through the part of the beam that the camera sees, 1 to 2 m from the projector:
/// in the camera's frame.
std::vector<Eigen::Vector3d> pointsInBeam(const SyntheticRig& rig, int count, std::uint32_t seed);

/// 95th percentile of the distance between where truth and estimate send light meant for
/// pointsInBeam, in millimeters on a surface facing the beam.
double errorP95_mm(const SyntheticRig& rig, const calib::ProjectorEstimate& estimate);

}  // namespace afterglow::test
