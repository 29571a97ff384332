/// \file
/// The shape of the printed board: how its paper bends, twists and is stretched. One shape for all
/// views: the sheet is glued onto something.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "calib/frames.hpp"
#include "calib/lens.hpp"
#include "calib/targets/board.hpp"

namespace afterglow::calib {

/// Stretch; then the modes of the height above the board's plane, m at the edge: with u, v from -1
/// to 1 across and up the sheet u^2, v^2 (bending), u v (twist), u^3, u^2 v, u v^2, v^3, u^4, v^4.
constexpr int kShapeSize = 10;
using ShapeVector = Eigen::Matrix<double, kShapeSize, 1>;

struct BoardShape {
  /// [0]: the print is wider than its layout by this share, its height being right.
  ShapeVector parameters = ShapeVector::Zero();
  Eigen::Vector2d half_m = Eigen::Vector2d::Ones();  ///< half the sheet

  static BoardShape flat(const Board& board);
  bool isFlat() const { return parameters.isZero(0); }
  /// d height / d parameters at a place on the sheet (m).
  ShapeVector modesAt(const Eigen::Vector2d& at_m) const;
  /// Above the board's plane, m.
  double height(const Eigen::Vector2d& at_m) const;
  Eigen::Vector2d slope(const Eigen::Vector2d& at_m) const;
  /// Returns the position of a place of the layout, in the board's frame.
  Eigen::Vector3d place(const Eigen::Vector2d& layout_m) const;

  /// The plane that fits the sheet best: its height is plane().dot({x, y, 1}).
  Eigen::Vector3d plane() const;
  /// Returns the height between the lowest and the highest place of the sheet, over the best plane,
  /// m.
  double unevenness() const;
  /// The greatest departure of the middle from the line between two opposite edges: across, up.
  Eigen::Vector2d bends() const;
  /// Returns how far the corners stand off the board's plane, two above and two below it.
  double twist() const;
};

/// Standard deviations of boards that somebody made with care.
ShapeVector usualShape();

/// Returns the point where a ray from the origin of the frame meets the sheet; NaN if it does not.
Eigen::Vector3d meetSheet(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                          const Eigen::Isometry3d& T_frame_board, const BoardShape& shape);
/// Returns the point where light through a projector pixel lands, in layout coordinates that ignore
/// the stretch.
std::optional<Eigen::Vector3d> landingOnSheet(const Lens& projector, const Eigen::Vector2d& pixel,
                                              const Rigid<Projector, Surface>& T_projector_board,
                                              const BoardShape& shape);

/// "bends by 1.1 mm over its width"; empty if nobody would see it.
std::string shapeText(const BoardShape& shape);
std::vector<std::string> shapeWarnings(const BoardShape& shape);
/// Refuses shapes that the modes cannot carry.
std::vector<std::string> shapeRefusals(const BoardShape& shape);

}  // namespace afterglow::calib
