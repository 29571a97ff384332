#include "render/scene/eye.hpp"

namespace afterglow::render {

Eye eyeOfLayer(const Layer& layer, const Rigid<Projector, World>& T_projector_world,
               double focal_px) {
  const Rigid<World, Projector> T_world_projector = T_projector_world.inverse();
  Eye eye;
  eye.focal_px = focal_px;
  eye.p_lens = T_world_projector.matrix().translation();
  if (layer.placement == Placement::Direct || !layer.surface) {
    eye.R_world_eye = T_world_projector.matrix().linear();
    eye.p_world = eye.p_lens;
    return eye;
  }
  const Eigen::Matrix3d R_world_surface = layer.surface->T_world_surface.matrix().linear();
  eye.R_world_eye.col(0) = R_world_surface.col(0);
  eye.R_world_eye.col(1) = -R_world_surface.col(1);
  eye.R_world_eye.col(2) = -R_world_surface.col(2);
  eye.parallel = layer.placement == Placement::Drape;
  eye.p_world = layer.p_viewer;
  eye.letters_face_it = layer.placement == Placement::Viewer;
  if (layer.placement == Placement::Drape) eye.reader = layer.reader;
  return eye;
}

Eigen::Matrix3d axesOfLetters(const Eye& eye, const Eigen::Vector3d& p) {
  Eigen::Matrix3d R = eye.R_world_eye;
  R.col(1) = -R.col(1);
  R.col(2) = -R.col(2);
  const Eigen::Vector3d n = R.col(2);
  if (eye.reader) {
    const Eigen::Vector3d to_reader =
        eye.reader->p_world - (eye.reader->is_direction ? 0.0 : 1.0) * p;
    const Eigen::Vector3d up = n * n.dot(to_reader) - to_reader;
    if (!(up.norm() > 1e-6)) return R;  // right above the text there is no side
    R.col(1) = up.normalized();
    R.col(0) = R.col(1).cross(n);
  } else if (eye.letters_face_it) {
    const Eigen::Vector3d toward = (eye.p_world - p).normalized();
    const Eigen::Vector3d right = n.cross(toward);
    if (!(right.norm() > 1e-6)) return R;
    R.col(0) = right.normalized();
    R.col(1) = toward.cross(R.col(0));
    R.col(2) = toward;
  }
  return R;
}

}  // namespace afterglow::render
