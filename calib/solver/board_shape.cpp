#include "calib/solver/board_shape.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

namespace afterglow::calib {
namespace {

/// Light that a bend of this size moves is seen by nobody; beyond the second, modes and small
/// angles are no model of the sheet any more.
constexpr double kTold_m = 0.3e-3, kCarried_m = 6e-3;
constexpr int kSheetSteps = 12;

/// Places all over the sheet, row by row from its lower left corner.
std::vector<Eigen::Vector2d> places(const BoardShape& shape) {
  std::vector<Eigen::Vector2d> all;
  for (int row = 0; row <= kSheetSteps; ++row) {
    for (int column = 0; column <= kSheetSteps; ++column) {
      const Eigen::Vector2d share(2.0 * column / kSheetSteps - 1, 2.0 * row / kSheetSteps - 1);
      all.push_back(share.cwiseProduct(shape.half_m));
    }
  }
  return all;
}

std::string inMillimeters(double meters) { return fmt::format("{:.1f} mm", 1000 * meters); }

}  // namespace

BoardShape BoardShape::flat(const Board& board) {
  BoardShape shape;
  shape.half_m = board.size_m / 2;
  return shape;
}

ShapeVector BoardShape::modesAt(const Eigen::Vector2d& at_m) const {
  const double u = at_m.x() / half_m.x(), v = at_m.y() / half_m.y();
  ShapeVector modes;
  modes << 0, u * u, v * v, u * v, u * u * u, u * u * v, u * v * v, v * v * v, u * u * u * u,
      v * v * v * v;
  return modes;
}

double BoardShape::height(const Eigen::Vector2d& at_m) const {
  return modesAt(at_m).dot(parameters);
}

Eigen::Vector2d BoardShape::slope(const Eigen::Vector2d& at_m) const {
  const double u = at_m.x() / half_m.x(), v = at_m.y() / half_m.y();
  ShapeVector along_u, along_v;
  along_u << 0, 2 * u, 0, v, 3 * u * u, 2 * u * v, v * v, 0, 4 * u * u * u, 0;
  along_v << 0, 0, 2 * v, u, 0, u * u, 2 * u * v, 3 * v * v, 0, 4 * v * v * v;
  return {along_u.dot(parameters) / half_m.x(), along_v.dot(parameters) / half_m.y()};
}

Eigen::Vector3d BoardShape::place(const Eigen::Vector2d& layout_m) const {
  return {layout_m.x() * (1 + parameters[0]), layout_m.y(), height(layout_m)};
}

Eigen::Vector3d BoardShape::plane() const {
  const std::vector<Eigen::Vector2d> all = places(*this);
  Eigen::MatrixX3d rows(Eigen::Index(all.size()), 3);
  Eigen::VectorXd heights(Eigen::Index(all.size()));
  for (std::size_t i = 0; i < all.size(); ++i) {
    rows.row(Eigen::Index(i)) = all[i].homogeneous().transpose();
    heights[Eigen::Index(i)] = height(all[i]);
  }
  return (rows.transpose() * rows).ldlt().solve(rows.transpose() * heights);
}

double BoardShape::unevenness() const {
  const Eigen::Vector3d flat = plane();
  double lowest = 0, highest = 0;
  for (const Eigen::Vector2d& at : places(*this)) {
    const double above = height(at) - flat.dot(at.homogeneous());
    lowest = std::min(lowest, above);
    highest = std::max(highest, above);
  }
  return highest - lowest;
}

Eigen::Vector2d BoardShape::bends() const {
  const auto off = [&](const Eigen::Vector2d& edge) {
    return std::abs(0.5 * (height(edge) + height(-edge)) - height(Eigen::Vector2d::Zero()));
  };
  return {off({half_m.x(), 0}), off({0, half_m.y()})};
}

double BoardShape::twist() const { return std::abs(parameters[3]); }

ShapeVector usualShape() {
  ShapeVector usual;
  usual << 0.0005, 2e-3, 2e-3, 1e-3, 0.3e-3, 0.3e-3, 0.3e-3, 0.3e-3, 0.3e-3, 0.3e-3;
  return usual;
}

Eigen::Vector3d meetSheet(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                          const Eigen::Isometry3d& T_frame_board, const BoardShape& shape) {
  const Eigen::Vector3d o = T_frame_board.inverse() * origin;
  const Eigen::Vector3d d = T_frame_board.linear().transpose() * direction;
  double way = -o.z() / d.z();
  if (!shape.isFlat()) {
    // Slopes of paper are some percent: each step gains two decimals.
    constexpr int kNewtonSteps = 4;
    for (int i = 0; i < kNewtonSteps; ++i) {
      const Eigen::Vector3d at = o + way * d;
      const double steepness = d.z() - shape.slope(at.head<2>()).dot(d.head<2>());
      way -= (at.z() - shape.height(at.head<2>())) / steepness;
    }
  }
  if (!(way > 0)) return Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  return origin + way * direction;
}

std::optional<Eigen::Vector3d> landingOnSheet(const Lens& projector, const Eigen::Vector2d& pixel,
                                              const Rigid<Projector, Surface>& T_projector_board,
                                              const BoardShape& shape) {
  const auto ray = unproject(projector, pixel);
  if (!ray) return std::nullopt;
  const Eigen::Vector3d p_projector =
      meetSheet(Eigen::Vector3d::Zero(), *ray, T_projector_board.matrix(), shape);
  if (!p_projector.allFinite()) return std::nullopt;
  return Eigen::Vector3d(T_projector_board.inverse() * p_projector);
}

std::string shapeText(const BoardShape& shape) {
  const Eigen::Vector2d bends = shape.bends();
  const double uneven = shape.unevenness();
  if (!(uneven > kTold_m)) return "";
  const double largest = std::max(bends.maxCoeff(), shape.twist()), told = largest / 2;
  if (largest < 0.4 * uneven) return "is uneven by " + inMillimeters(uneven);
  std::vector<std::string> how;
  if (bends.x() > told) how.push_back("bends by " + inMillimeters(bends.x()) + " over its width");
  if (bends.y() > told) how.push_back("bends by " + inMillimeters(bends.y()) + " over its height");
  if (shape.twist() > told) how.push_back("is twisted by " + inMillimeters(shape.twist()));
  return fmt::format("{}", fmt::join(how, " and "));
}

std::vector<std::string> shapeWarnings(const BoardShape& shape) {
  const std::string text = shapeText(shape);
  if (text.empty()) return {};
  return {"the board " + text + ", which was reckoned with: glue it onto something stiffer"};
}

std::vector<std::string> shapeRefusals(const BoardShape& shape) {
  if (!(shape.unevenness() > kCarried_m)) return {};
  return {fmt::format("the board {}, at most {:.0f} mm can be reckoned with: glue it onto "
                      "something stiff, and take all views anew",
                      shapeText(shape), 1000 * kCarried_m)};
}

}  // namespace afterglow::calib
