#include "tests/support/synthetic_rig.hpp"

#include <algorithm>
#include <cmath>
#include <random>
#include <stdexcept>

#include "tests/support/optics.hpp"

namespace afterglow::test {
namespace {

constexpr int kMostTries = 4000;
/// Camera pixels a tag's side must have to be counted as seen.
constexpr double kSmallestTag_px = 14;

Eigen::Matrix3d euler(double x, double y, double z) {
  return (Eigen::AngleAxisd(x, Eigen::Vector3d::UnitX()) *
          Eigen::AngleAxisd(y, Eigen::Vector3d::UnitY()) *
          Eigen::AngleAxisd(z, Eigen::Vector3d::UnitZ()))
      .toRotationMatrix();
}

template <typename Frame>
Rigid<World, Frame> turned(const Rigid<World, Frame>& T, const Eigen::Matrix3d& by) {
  Eigen::Isometry3d matrix = T.matrix();
  matrix.linear() = matrix.linear() * by;
  return Rigid<World, Frame>(matrix);
}

class Uniform {
 public:
  explicit Uniform(std::uint32_t seed) : random_(seed) {}
  double operator()(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }

 private:
  std::mt19937 random_;
};

struct KindValues {
  double focal, center_y;  ///< center in picture heights
  std::vector<double> D;
  double camera_focal;
};

KindValues valuesOf(RigKind kind) {
  switch (kind) {
    case RigKind::Standard:
      return {1900, 0.55, {-0.02, 0.01, 0, 0, 0}, 1150};
    case RigKind::LensShift:
      return {1900, 1.02, {-0.03, 0.02, 0.0004, -0.0003, 0}, 1150};
    case RigKind::Wide:
      return {1050, 0.55, {-0.19, 0.06, 0.0012, -0.0008, -0.01}, 760};
    case RigKind::ShortThrow:
      return {760, 1.15, {-0.06, 0.02, 0.0008, 0.0005, 0}, 640};
  }
  throw std::logic_error("no such kind of rig");
}

calib::Lens makeCamera(double focal, int width, Uniform& uniform) {
  const double scale = width / 1280.0;
  const double f = focal * uniform(0.98, 1.02);
  const double cx = 640 + uniform(-9, 9), cy = 480 + uniform(-9, 9);
  return lens(width, static_cast<int>(std::lround(960 * scale)), f * scale,
              (cx + 0.5) * scale - 0.5, (cy + 0.5) * scale - 0.5,
              {-0.11, 0.07, 0.0006, -0.0004, 0.0});
}

std::vector<Eigen::Vector3d> sheetCorners(const calib::Board& board) {
  const double w = board.size_m.x() / 2, h = board.size_m.y() / 2;
  return {{-w, h, 0}, {w, h, 0}, {w, -h, 0}, {-w, -h, 0}};
}

bool isInPicture(const calib::Lens& lens, const Eigen::Vector2d& pixel, double margin) {
  return pixel.x() > margin && pixel.y() > margin && pixel.x() < lens.width - 1 - margin &&
         pixel.y() < lens.height - 1 - margin;
}

bool isPoseVisible(const SyntheticRig& rig, const BoardPose& pose) {
  for (const Eigen::Vector3d& corner : sheetCorners(rig.board)) {
    if ((pose * corner).z() < 0.05) return false;
    const auto pixel = project(rig.camera, rig.T_world_camera.inverse() * (pose * corner));
    if (!pixel || !isInPicture(rig.camera, *pixel, 5)) return false;
  }
  return true;
}

BoardPose randomPose(const SyntheticRig& rig, Uniform& uniform) {
  const calib::Lens& lens = rig.projector;
  const Eigen::Vector2d pixel(uniform(0.08, 0.92) * lens.width, uniform(0.08, 0.92) * lens.height);
  const Eigen::Vector3d ray = unproject(lens, pixel).value();
  const Eigen::Vector3d middle = rig.T_world_projector * (ray * uniform(1.05, 1.75));
  const Eigen::Vector3d between = 0.5 * (rig.T_world_projector.matrix().translation() +
                                         rig.T_world_camera.matrix().translation());
  const Eigen::Vector3d z = (between - middle).normalized();
  const Eigen::Vector3d x = Eigen::Vector3d(0, 1, 0.2).cross(z).normalized();
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() << x, z.cross(x), z;
  T.translation() = middle;
  const double tilt_x = uniform(-0.6, 0.6), tilt_y = uniform(-0.6, 0.6);
  return turned(BoardPose(T), euler(tilt_x, tilt_y, uniform(-0.4, 0.4)));
}

/// Printed tags with their white rims, where no projected tag may lie.
bool isOnPrint(const calib::Board& board, const std::array<Eigen::Vector2d, 4>& corners) {
  Eigen::Vector2d low = corners[0], high = corners[0];
  for (const Eigen::Vector2d& corner : corners) {
    low = low.cwiseMin(corner);
    high = high.cwiseMax(corner);
  }
  return std::any_of(board.tags.begin(), board.tags.end(), [&](const calib::Tag& tag) {
    const double rim = (tag.corners[1].x() - tag.corners[0].x()) / 8;
    return high.x() > tag.corners[0].x() - rim && low.x() < tag.corners[1].x() + rim &&
           high.y() > tag.corners[3].y() - rim && low.y() < tag.corners[0].y() + rim;
  });
}

/// Where the camera sees a tag given by its corners on the board; empty if it does not.
std::optional<calib::SeenTag> seen(const SyntheticRig& rig, const BoardPose& pose, int id,
                                   const std::array<Eigen::Vector2d, 4>& on_board) {
  calib::SeenTag tag;
  tag.id = id;
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector3d p_board(on_board[i].x(), on_board[i].y(), rig.height_m(on_board[i]));
    const Eigen::Vector3d p_world = pose * p_board;
    const auto pixel = project(rig.camera, rig.T_world_camera.inverse() * p_world);
    if (!pixel || !isInPicture(rig.camera, *pixel, 2)) return std::nullopt;
    tag.corners[i] = *pixel;
  }
  for (std::size_t i = 0; i < 4; ++i) {
    if ((tag.corners[i] - tag.corners[(i + 1) % 4]).norm() < kSmallestTag_px) return std::nullopt;
  }
  return tag;
}

std::optional<std::array<Eigen::Vector2d, 4>> litCorners(const SyntheticRig& rig,
                                                         const BoardPose& pose,
                                                         const calib::Tag& tag) {
  std::array<Eigen::Vector2d, 4> corners;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto at = lightOnBoard(rig, pose, tag.corners[i]);
    if (!at || (at->cwiseAbs() - rig.board.size_m / 2).maxCoeff() > 0) return std::nullopt;
    corners[i] = *at;
  }
  if (isOnPrint(rig.board, corners)) return std::nullopt;
  return corners;
}

}  // namespace

double SyntheticRig::height_m(const Eigen::Vector2d& on_board) const {
  // A shelf on two supports under its own weight.
  const double t = on_board.x() / board.size_m.x() + 0.5, up = on_board.y() / board.size_m.y();
  return -3.2 * sag_m * (t - 2 * t * t * t + t * t * t * t) + 4 * twist_m * (t - 0.5) * up;
}

calib::ProjectorEstimate SyntheticRig::truth() const {
  calib::ProjectorEstimate estimate;
  estimate.projector = projector;
  estimate.T_camera_projector = T_world_camera.inverse() * T_world_projector;
  return estimate;
}

SyntheticRig makeRig(RigKind kind, std::uint32_t seed, int camera_width) {
  Uniform uniform(seed);
  const KindValues values = valuesOf(kind);
  SyntheticRig rig;
  const int width = 1280, height = 800;
  const double f = values.focal * uniform(0.97, 1.03);
  Eigen::Matrix3d K = Eigen::Matrix3d::Identity();
  K(0, 0) = f;
  K(1, 1) = f * uniform(0.998, 1.002);
  K(0, 2) = width / 2 + uniform(-12, 12);
  K(1, 2) = values.center_y * height + uniform(-8, 8);
  rig.projector = calib::makeLens(width, height, K, values.D);
  rig.camera = makeCamera(values.camera_focal, camera_width, uniform);
  const double rx = uniform(-.03, .03), ry = uniform(-.03, .03), rz = uniform(-.03, .03);
  rig.T_world_projector = turned(lookAt<Projector>({0, 0, 1.5}, {0, 1, 0.35}), euler(rx, ry, rz));
  const Eigen::Vector3d eye(0.35 + uniform(-.05, .05), 0.05, 1.62);
  rig.T_world_camera =
      turned(lookAt<Camera>(eye, {0.02, 1, 0.55}), euler(0, 0, uniform(-.05, .05)));
  rig.board = calib::makeBoard({0.594, 0.42});
  rig.pattern = calib::makePattern(width, height);
  return rig;
}

SyntheticRig makeSmallRig(std::uint32_t seed) {
  SyntheticRig rig = makeRig(RigKind::Standard, seed, 800);
  Eigen::Matrix3d K = rig.projector.K;
  K.topRows<2>() /= 2;
  K(0, 2) -= 0.25;  // pixels' middles, not their corners, are whole numbers
  K(1, 2) -= 0.25;
  const std::array<double, 8>& D = rig.projector.D;
  rig.projector = calib::makeLens(640, 400, K, {D[0], D[1], D[2], D[3], D[4]});
  rig.pattern = calib::makePattern(640, 400);
  return rig;
}

std::vector<BoardPose> boardPoses(const SyntheticRig& rig, int count, std::uint32_t seed) {
  Uniform uniform(seed);
  std::vector<BoardPose> poses;
  for (int i = 0; i < kMostTries && static_cast<int>(poses.size()) < count; ++i) {
    const BoardPose pose = randomPose(rig, uniform);
    if (isPoseVisible(rig, pose)) poses.push_back(pose);
  }
  if (static_cast<int>(poses.size()) < count) {
    throw std::runtime_error("only " + std::to_string(poses.size()) +
                             " poses of the board fit the camera's picture");
  }
  return poses;
}

std::optional<Eigen::Vector2d> lightOnBoard(const SyntheticRig& rig, const BoardPose& pose,
                                            const Eigen::Vector2d& projector_px) {
  const auto ray = unproject(rig.projector, projector_px);
  if (!ray) return std::nullopt;
  const Rigid<Surface, Projector> T_board_projector = pose.inverse() * rig.T_world_projector;
  const Eigen::Vector3d eye = T_board_projector.matrix().translation();
  const Eigen::Vector3d direction = T_board_projector.matrix().linear() * *ray;
  double distance = -eye.z() / direction.z();
  for (int i = 0; i < 6; ++i) {
    const double height = rig.height_m((eye + distance * direction).head<2>());
    distance = (height - eye.z()) / direction.z();
  }
  if (!(eye.z() > 0) || !(distance > 0)) return std::nullopt;
  return Eigen::Vector2d((eye + distance * direction).head<2>());
}

calib::View cornerView(const SyntheticRig& rig, const std::string& name, const BoardPose& pose,
                       double sigma_px, std::uint32_t seed) {
  calib::View view;
  view.name = name;
  for (const calib::Tag& tag : rig.board.tags) {
    if (const auto found = seen(rig, pose, tag.id, tag.corners)) view.board.push_back(*found);
  }
  for (const calib::Tag& tag : rig.pattern.tags) {
    const auto corners = litCorners(rig, pose, tag);
    if (!corners) continue;
    if (const auto found = seen(rig, pose, tag.id, *corners)) view.projected.push_back(*found);
  }
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, sigma_px);
  for (std::vector<calib::SeenTag>* tags : {&view.board, &view.projected}) {
    for (calib::SeenTag& tag : *tags) {
      for (Eigen::Vector2d& corner : tag.corners) {
        const double x = noise(random);
        corner += Eigen::Vector2d(x, noise(random));
      }
      tag.covariance = Eigen::Matrix<double, 8, 8>::Identity() * sigma_px * sigma_px;
    }
  }
  return view;
}

std::vector<calib::View> cornerViews(const SyntheticRig& rig, int count, double sigma_px,
                                     std::uint32_t seed) {
  std::vector<calib::View> views;
  for (const BoardPose& pose : boardPoses(rig, count, seed)) {
    const int index = static_cast<int>(views.size());
    views.push_back(cornerView(rig, viewName(index), pose, sigma_px,
                               seed * 1000 + static_cast<std::uint32_t>(index)));
  }
  return views;
}

std::string viewName(int index) {
  return (index < 10 ? "view_0" : "view_") + std::to_string(index);
}

std::vector<Eigen::Vector3d> pointsInBeam(const SyntheticRig& rig, int count, std::uint32_t seed) {
  Uniform uniform(seed);
  const Rigid<Camera, Projector> T_camera_projector = rig.truth().T_camera_projector;
  std::vector<Eigen::Vector3d> points;
  while (static_cast<int>(points.size()) < count) {
    const double u = uniform(0, rig.projector.width - 1), v = uniform(0, rig.projector.height - 1);
    const double distance = uniform(1, 2);
    const auto ray = unproject(rig.projector, {u, v});
    if (!ray) continue;
    const Eigen::Vector3d p_camera = T_camera_projector * (*ray * distance);
    const auto pixel = project(rig.camera, p_camera);
    if (pixel && isInPicture(rig.camera, *pixel, 20.0 * rig.camera.width / 1280)) {
      points.push_back(p_camera);
    }
  }
  return points;
}

double errorP95_mm(const SyntheticRig& rig, const calib::ProjectorEstimate& estimate) {
  const calib::ProjectorEstimate truth = rig.truth();
  std::vector<double> errors;
  for (const Eigen::Vector3d& p_camera : pointsInBeam(rig, 1000, 7)) {
    const Eigen::Vector3d p_projector = truth.T_camera_projector.inverse() * p_camera;
    const auto meant = project(truth.projector, p_projector);
    const auto sent = project(estimate.projector, estimate.T_camera_projector.inverse() * p_camera);
    const double px = sent ? (*sent - meant.value()).norm() : 1e4;
    errors.push_back(px * p_projector.z() / rig.projector.K(0, 0) * 1000);
  }
  const auto high = errors.begin() + std::ptrdiff_t(errors.size() * 95 / 100);
  std::nth_element(errors.begin(), high, errors.end());
  return *high;
}

}  // namespace afterglow::test
