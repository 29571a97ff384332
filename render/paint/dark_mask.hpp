/// \file
/// The part of a projector's image that stays dark, because its light would hit what must not be
/// lit: people, the robot's arm, anything that stands on a surface.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "calib/frames.hpp"
#include "calib/lens.hpp"
#include "render/paint/float_lens.hpp"
#include "render/scene/image.hpp"
#include "render/scene/scene.hpp"

namespace afterglow::render {

/// Points that no light may come near, and how near. Meters.
struct AvoidedPoints {
  Rigid<World, World> pose;  ///< carries the points into world coordinates
  SharedList<Eigen::Vector3f> points;
  float padding = 0;
};

/// Returns the points that stand more than `height` meters above a surface and lie on no other:
/// what is within that height of a surface, inside its outline, lies on it (over its relief, where
/// that is known). What lies below all surfaces is not reached by their light. `pose` carries the
/// points into world coordinates; points that are not finite are left out. Pure.
PointList standingPoints(const PointList& points, const Rigid<World, World>& pose,
                         const std::vector<SurfacePatch>& surfaces, double height);

/// Returns the points that are no measurements of `own`, a robot's surface whose points lie no
/// farther apart than a quarter of their padding: those that are not nearer to it than about that
/// quarter. None is left out that is not within the padding, so that it stays avoided. All of `own`
/// have one padding; very many cells of a quarter of it leave nothing out. Pure.
PointList foreignPoints(const PointList& points, const Rigid<World, World>& pose,
                        const std::vector<AvoidedPoints>& own);

/// Returns upright columns of points, `spacing` meters apart, in world coordinates: one for each
/// point that stands on a surface, from there `reach` meters up. A range finder sees people's legs
/// alone. Pure.
PointList standingColumns(const PointList& points, const Rigid<World, World>& pose,
                          const std::vector<SurfacePatch>& surfaces, double reach, double spacing);

/// Returns points on a shape, in its own frame, so dense that none of its surface is farther than
/// `spacing` meters from one. Throws std::invalid_argument for a shape that is no solid: solids are
/// Cube, Sphere, Cylinder and MeshInstance; and std::runtime_error for one that is not finite or so
/// large that a million points are not enough, as meshes in millimeters are.
PointList surfacePoints(const Shape& shape, double spacing);

/// Dark is every ray of the lens that comes nearer to an avoided point than its padding, and at
/// most a few pixels more: the image is decided in squares of kCell pixels. A point that is nearer
/// to the lens than its padding darkens everything. One thread at a time.
class DarkMask {
 public:
  static constexpr int kCell = 4;  ///< px

  explicit DarkMask(const calib::Lens& lens);

  /// Replaces the mask.
  void draw(const std::vector<AvoidedPoints>& avoided,
            const Rigid<Projector, World>& T_projector_world);
  /// Makes an image of the lens's size black where it has to be dark.
  void apply(Image& image) const;
  /// Returns the share of the image that is dark.
  double share() const;

 private:
  void add(const AvoidedPoints& avoided, const Rigid<Projector, World>& T_projector_world);
  void addNear(const Eigen::Vector3f& p, float padding);
  void spread();

  int width_, height_;
  int columns_, rows_;  ///< cells of the image and of a margin around it
  FloatLens lens_;
  float px_per_radian_;  ///< the largest magnification of the image
  float widest_;         ///< radians: no ray of the image is farther off the axis
  bool is_all_dark_ = false;
  /// The square of how far, in cells, it is dark around each cell; negative: it is not.
  std::vector<float> power_;
  std::vector<float> turned_;  ///< the same spread along rows, column by column, without the margin
  std::vector<float> dark_;    ///< the same spread along columns, of the image's cells
};

}  // namespace afterglow::render
