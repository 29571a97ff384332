/// \file
/// The eye that shapes are made for.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "calib/frames.hpp"
#include "render/scene/scene.hpp"

namespace afterglow::render {

/// The place to which flat things (lines, squares) turn.
struct Eye {
  /// x right, y down, z forward: squares lie parallel to x and y.
  Eigen::Matrix3d R_world_eye = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();
  bool parallel = false;  ///< looks along z from everywhere instead of from p_world
  /// Letters stand before p_world, upright against z, instead of parallel to x and y.
  bool letters_face_it = false;
  std::optional<Reader> reader;  ///< letters turn to him in the plane of x and y
  /// More than 0: shapes are made for this eye alone, without the faces that it does not see, and
  /// so round that the pixels of a lens at p_lens show no corners. 0: whole bodies.
  double focal_px = 0;
  Eigen::Vector3d p_lens = Eigen::Vector3d::Zero();
};

/// Direct: the projector. Drape and Viewer: flat things lie parallel to the surface, facing along
/// its normal or toward the viewer.
Eye eyeOfLayer(const Layer& layer, const Rigid<Projector, World>& T_projector_world,
               double focal_px);

/// Right, up and toward the eye, of letters at a place.
Eigen::Matrix3d axesOfLetters(const Eye& eye, const Eigen::Vector3d& p_world);

}  // namespace afterglow::render
