#include "render/scene/tessellate.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iterator>

namespace afterglow::render {
namespace {

constexpr int kUsualSides = 32;        ///< sides of round things that are not for a lens
constexpr double kOutlineError = 0.1;  ///< px; half of it outwards, half inwards
const ColorList kNone;

// ------------------------------------------- lines as ribbons that face an eye, with round joins
struct RibbonPoint {
  Eigen::Vector3d p_world;
  Rgba color;
};

/// Unit vector from a point toward the eye.
Eigen::Vector3d toward(const Eye& eye, const Eigen::Vector3d& p_world) {
  if (eye.parallel) return -eye.R_world_eye.col(2);
  return (eye.p_world - p_world).normalized();
}

std::uint32_t add(Mesh& mesh, const Eigen::Vector3d& p, const Rgba& color) {
  mesh.points.push_back(p);
  mesh.colors.push_back(color);
  return static_cast<std::uint32_t>(mesh.points.size() - 1);
}

/// Half the width, across the segment and across the line of sight; zero where they coincide.
Eigen::Vector3d sideways(const Eye& eye, const Eigen::Vector3d& along, const Eigen::Vector3d& p,
                         double width) {
  const Eigen::Vector3d side = along.cross(toward(eye, p));
  const double length = side.norm();
  if (!(length > 1e-12 * along.norm())) return Eigen::Vector3d::Zero();
  return side * (0.5 * width / length);
}

void addSegment(const RibbonPoint& a, const RibbonPoint& b, double width, const Eye& eye,
                Mesh& mesh) {
  if (!a.p_world.allFinite() || !b.p_world.allFinite()) return;
  const Eigen::Vector3d along = b.p_world - a.p_world;
  const Eigen::Vector3d side_a = sideways(eye, along, a.p_world, width);
  const Eigen::Vector3d side_b = sideways(eye, along, b.p_world, width);
  const std::uint32_t first = add(mesh, a.p_world - side_a, a.color);
  add(mesh, b.p_world - side_b, b.color);
  add(mesh, b.p_world + side_b, b.color);
  add(mesh, a.p_world + side_a, a.color);
  mesh.triangles.push_back({first, first + 1, first + 2});
  mesh.triangles.push_back({first, first + 2, first + 3});
}

/// The gap between the ends of two segments on the outer side of their corner: part of a disc
/// of the line's width.
void addJoin(const RibbonPoint& from, const RibbonPoint& point, const RibbonPoint& to, double width,
             const Eye& eye, Mesh& mesh) {
  if (!from.p_world.allFinite() || !point.p_world.allFinite() || !to.p_world.allFinite()) return;
  constexpr double kStep = M_PI / 6;
  const Eigen::Vector3d n = toward(eye, point.p_world);
  Eigen::Vector3d a = sideways(eye, point.p_world - from.p_world, point.p_world, width);
  Eigen::Vector3d b = sideways(eye, to.p_world - point.p_world, point.p_world, width);
  const double turn = std::atan2(a.cross(b).dot(n), a.dot(b));
  if (turn < 0) {  // sideways is on the right-hand side, as the eye sees it: outside of a left turn
    a = -a;
    b = -b;
  }
  const int steps = static_cast<int>(std::ceil(std::abs(turn) / kStep));
  const std::uint32_t center = add(mesh, point.p_world, point.color);
  std::uint32_t last = add(mesh, point.p_world + a, point.color);
  for (int i = 1; i <= steps; ++i) {
    const Eigen::Vector3d side = Eigen::AngleAxisd(turn * i / steps, n) * a;
    const std::uint32_t next = add(mesh, point.p_world + side, point.color);
    mesh.triangles.push_back({center, last, next});
    last = next;
  }
}

/// Consecutive points joined. A point that is not finite interrupts the strip.
void addStrip(const std::vector<RibbonPoint>& points, double width, const Eye& eye, Mesh& mesh) {
  for (std::size_t i = 0; i + 1 < points.size(); ++i) {
    addSegment(points[i], points[i + 1], width, eye, mesh);
    if (i > 0) addJoin(points[i - 1], points[i], points[i + 1], width, eye, mesh);
  }
}

/// Pairs of points joined; a last one without its pair is left out.
void addSegments(const std::vector<RibbonPoint>& points, double width, const Eye& eye, Mesh& mesh) {
  for (std::size_t i = 0; i + 1 < points.size(); i += 2) {
    addSegment(points[i], points[i + 1], width, eye, mesh);
  }
}

// ------------------------------------------------------------------------------------- how many
constexpr std::size_t kOfCube = 8, kOfSphere = 1 + 2 * kLeastSides, kOfSquare = 4;

std::size_t stepOf(std::size_t count, std::size_t corners_each) {
  return std::max<std::size_t>(1, (count * corners_each + kMostCorners - 1) / kMostCorners);
}

struct CornerCounter {
  std::size_t operator()(const Arrow&) const { return 4 * kLeastSides; }
  std::size_t operator()(const Cube&) const { return kOfCube; }
  std::size_t operator()(const Sphere&) const { return kOfSphere; }
  std::size_t operator()(const Cylinder&) const { return 2 * kLeastSides; }
  std::size_t operator()(const Lines& lines) const {
    return (lines.strip ? 8 : 2) * lines.points.size();
  }
  std::size_t operator()(const ShapeList& list) const {
    const bool cubes = list.kind == ShapeList::Kind::Cubes;
    return std::min((cubes ? kOfCube : kOfSphere) * list.points.size(), kMostCorners);
  }
  std::size_t operator()(const Triangles& triangles) const { return triangles.points.size(); }
  std::size_t operator()(const PointCloud& cloud) const { return cloud.points.size(); }
  std::size_t operator()(const Text& text) const {
    return text.letters ? text.letters->points.size() : 0;
  }
  std::size_t operator()(const MeshInstance& mesh) const {
    return mesh.body ? mesh.body->points.size() : 0;
  }
};

// --------------------------------------------------------------------------------------- shapes

/// Draws one drawable's shape into a tessellation.
class Tessellator {
 public:
  Tessellator(const Drawable& drawable, const Eye& eye, Tessellation& out)
      : pose_(drawable.pose.matrix()), color_(drawable.color), eye_(eye), out_(out) {}

  void operator()(const Arrow& arrow) {
    const double head = std::min(arrow.head_length, arrow.length);
    const double shaft = arrow.length - head, d = arrow.shaft_diameter, D = arrow.head_diameter;
    // The shaft ends within the head, not at it: there they would have to share pixels' edges.
    const double end = shaft + (D > d ? 0.5 * head * (1 - d / D) : 0);
    Eigen::Affine3d along_x = Eigen::Affine3d::Identity();
    along_x.linear() << 0, 0, end, d, 0, 0, 0, d, 0;
    along_x.translation() = Eigen::Vector3d(end / 2, 0, 0);
    if (shaft > 0) addSolid(unitCylinder(sides(along_x)), along_x, asBytes(color_));
    Eigen::Affine3d tip = Eigen::Affine3d::Identity();
    tip.linear() = Eigen::Vector3d(head, D, D).asDiagonal();
    tip.translation() = Eigen::Vector3d(shaft, 0, 0);
    addSolid(unitCone(sides(tip)), tip, asBytes(color_));
  }

  void operator()(const Cube& cube) { addSolid(unitCube(), scaled(cube.size), asBytes(color_)); }
  void operator()(const Sphere& sphere) { addSphere(scaled(sphere.size), asBytes(color_)); }
  void operator()(const Cylinder& cylinder) {
    const Eigen::Affine3d shape = scaled(cylinder.size);
    addSolid(unitCylinder(sides(shape)), shape, asBytes(color_));
  }

  void operator()(const Lines& lines) {
    std::vector<RibbonPoint> points(lines.points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      points[i] = {world(lines.points[i]), colorAt(lines.colors, i)};
    }
    if (lines.width_px > 0) {
      addThinLines(points, lines);
    } else if (lines.strip) {
      addStrip(points, lines.width, eye_, out_.mesh);
    } else {
      addSegments(points, lines.width, eye_, out_.mesh);
    }
  }

  void operator()(const ShapeList& list) {
    addSolids(list.kind == ShapeList::Kind::Cubes, list.points, list.colors.get(), list.size);
  }

  void operator()(const Triangles& triangles) {
    const std::size_t count = triangles.points.size() / 3;
    const bool per_face = triangles.colors.size() == count;
    for (std::size_t i = 0; i < count; ++i) {
      const auto* corner = &triangles.points[3 * i];
      if (!corner[0].allFinite() || !corner[1].allFinite() || !corner[2].allFinite()) continue;
      const std::uint32_t first = size();
      for (std::size_t j = 0; j < 3; ++j) {
        addPoint(world(corner[j]), colorAt(triangles.colors, per_face ? i : 3 * i + j));
      }
      out_.mesh.triangles.push_back({first, first + 1, first + 2});
    }
  }

  void operator()(const Text& text) {
    if (!text.letters) return;
    Eigen::Affine3d M = Eigen::Affine3d::Identity();
    M.linear() = axesOfLetters(eye_, pose_.translation());
    M.translation() = pose_.translation();
    addBody(*text.letters, M, kNone);
  }

  void operator()(const MeshInstance& mesh) {
    if (!mesh.body) return;
    addBody(*mesh.body, pose_ * scaled(mesh.scale), mesh.own_colors ? mesh.body->colors : kNone);
  }

  void operator()(const PointCloud& cloud) {
    switch (cloud.style) {
      case PointStyle::Points:
        return addSplats(cloud);
      case PointStyle::Squares:
      case PointStyle::FlatSquares:  // they differ in RViz's lighting alone; light has none
        return addSquares(cloud);
      case PointStyle::Spheres:
      case PointStyle::Boxes:
        return addSolids(cloud.style == PointStyle::Boxes, cloud.points, cloud.colors.get(),
                         Eigen::Vector3f::Constant(cloud.size));
    }
  }

 private:
  /// The drawable's color where the shape has none; its alpha multiplies theirs.
  Rgba colorAt(const ColorList& colors, std::size_t i) const {
    if (i >= colors.size()) return asBytes(color_);
    Color color = colors[i];
    color.a *= color_.a;
    return asBytes(color);
  }
  Rgba colorAt(const ByteColorList& colors, std::size_t i) const {
    if (i >= colors.size()) return asBytes(color_);
    if (color_.a == 1) return colors[i];
    Color color = asShares(colors[i]);
    color.a *= color_.a;
    return asBytes(color);
  }

  std::uint32_t size() const { return static_cast<std::uint32_t>(out_.mesh.points.size()); }
  Eigen::Vector3d world(const Eigen::Vector3f& p) const { return pose_ * p.cast<double>(); }
  static Eigen::Affine3d scaled(const Eigen::Vector3f& size) {
    return Eigen::Affine3d(Eigen::Scaling(Eigen::Vector3d(size.cast<double>())));
  }

  void addPoint(const Eigen::Vector3d& p, const Rgba& color) {
    out_.mesh.points.push_back(p);
    out_.mesh.colors.push_back(color);
  }

  /// Returns how many sides a round shape of diameter 1 needs where it is.
  int sides(const Eigen::Affine3d& shape) const {
    if (!(eye_.focal_px > 0)) return std::min(kUsualSides, most_sides_);
    const Eigen::Affine3d M = pose_ * shape;
    const double distance = (M.translation() - eye_.p_lens).norm();
    const double radius = 0.5 * M.linear().colwise().norm().maxCoeff();
    const double radius_px = eye_.focal_px * radius / std::max(distance, radius);
    const double share = std::min(kOutlineError / radius_px, 1.0);
    const double enough = M_PI / std::acos(1 - share);
    return enough < most_sides_ ? static_cast<int>(std::ceil(enough)) : most_sides_;
  }

  /// The eye as a unit body sees it that M puts into the world; absent: nothing can be left out.
  std::optional<Eigen::Vector3d> eyeIn(const Eigen::Affine3d& M) const {
    if (!(eye_.focal_px > 0)) return std::nullopt;
    const Eigen::Matrix3d inverse = M.linear().inverse();
    const Eigen::Vector3d eye = eye_.parallel
                                    ? Eigen::Vector3d(inverse * -eye_.R_world_eye.col(2))
                                    : Eigen::Vector3d(inverse * (eye_.p_world - M.translation()));
    if (!eye.allFinite()) return std::nullopt;
    return eye;
  }

  void addSphere(const Eigen::Affine3d& shape, const Rgba& color) {
    const int count = sides(shape);
    const auto eye = eyeIn(pose_ * shape);
    const bool is_outside = eye && (eye_.parallel || eye->norm() > 0.501);
    if (!is_outside) return addSolid(unitSphere(count), shape, color);
    seenOfUnitSphere(*eye, eye_.parallel, count, seen_);
    addFaces(seen_, pose_ * shape, color, [](const auto&) { return true; });
  }

  void addSolid(const Solid& solid, const Eigen::Affine3d& shape, const Rgba& color) {
    const Eigen::Affine3d M = pose_ * shape;
    const auto eye = eyeIn(M);
    const auto isSeen = [&](const auto& t) { return faces(solid.points, t, *eye); };
    const bool is_outside =
        eye && std::any_of(solid.triangles.begin(), solid.triangles.end(), isSeen);
    addFaces(solid, M, color, [&](const auto& t) { return !is_outside || isSeen(t); });
  }

  template <typename IsSeen>
  void addFaces(const Solid& solid, const Eigen::Affine3d& M, const Rgba& color,
                const IsSeen& is_seen) {
    if (!M.matrix().allFinite()) return;
    const std::uint32_t first = size();
    out_.convex_parts.push_back(first);
    for (const Eigen::Vector3d& p : solid.points) addPoint(M * p, color);
    for (const auto& t : solid.triangles) {
      if (is_seen(t)) out_.mesh.triangles.push_back({first + t[0], first + t[1], first + t[2]});
    }
  }

  void addBody(const Body& body, const Eigen::Affine3d& M, const ColorList& colors) {
    if (!M.matrix().allFinite()) return;
    const std::uint32_t first = size();
    for (std::size_t i = 0; i < body.points.size(); ++i) {
      addPoint(M * body.points[i].cast<double>(), tinted(colors, i));
    }
    const auto eye = body.is_closed ? eyeIn(M) : std::nullopt;
    const bool is_outside = eye && (eye_.parallel || !isWithin(body, *eye));
    for (const auto& t : body.triangles) {
      if (is_outside && !faces(body.points, t, *eye)) continue;
      out_.mesh.triangles.push_back({first + t[0], first + t[1], first + t[2]});
    }
  }

  static bool isWithin(const Body& body, const Eigen::Vector3d& eye) {
    Eigen::AlignedBox3f box;
    for (const Eigen::Vector3f& p : body.points) box.extend(p);
    return box.contains(eye.cast<float>());
  }

  /// Returns true if a counterclockwise triangle is seen from there.
  template <typename Points>
  bool faces(const Points& points, const std::array<std::uint32_t, 3>& t,
             const Eigen::Vector3d& eye) const {
    const Eigen::Vector3d a = points[t[0]].template cast<double>();
    const Eigen::Vector3d b = points[t[1]].template cast<double>();
    const Eigen::Vector3d c = points[t[2]].template cast<double>();
    return (b - a).cross(c - a).dot(eye_.parallel ? eye : Eigen::Vector3d(eye - a)) > 0;
  }

  Rgba tinted(const ColorList& colors, std::size_t i) const {
    if (i >= colors.size()) return asBytes(color_);
    const Color& own = colors[i];
    return asBytes(Color{own.r * color_.r, own.g * color_.g, own.b * color_.b, own.a * color_.a});
  }

  template <typename Colors>
  void addSolids(bool cubes, const PointList& points, const Colors& colors,
                 const Eigen::Vector3f& sizes) {
    const std::size_t step = stepOf(points.size(), cubes ? kOfCube : kOfSphere);
    const std::size_t each = kMostCorners / (points.size() / step + 1);
    most_sides_ = sidesUpTo(
        static_cast<int>(std::clamp<std::size_t>((each - 1) / 2, kLeastSides, kMostSides)));
    Eigen::Affine3d shape = scaled(sizes);
    for (std::size_t i = 0; i < points.size(); i += step) {
      shape.translation() = points[i].cast<double>();
      if (cubes) {
        addSolid(unitCube(), shape, colorAt(colors, i));
      } else {
        addSphere(shape, colorAt(colors, i));
      }
    }
  }

  void addThinLines(const std::vector<RibbonPoint>& points, const Lines& lines) {
    const std::size_t step = lines.strip ? 1 : 2;
    for (std::size_t i = 0; i + 1 < points.size(); i += step) {
      const RibbonPoint &a = points[i], &b = points[i + 1];
      if (!a.p_world.allFinite() || !b.p_world.allFinite()) continue;
      out_.thin_lines.push_back(
          {a.p_world, b.p_world, a.color, b.color, static_cast<double>(lines.width_px)});
    }
  }

  void addSquares(const PointCloud& cloud) {
    const double height = cloud.size_y > 0 ? cloud.size_y : cloud.size;
    const Eigen::Vector3d x = eye_.R_world_eye.col(0) * (0.5 * cloud.size);
    const Eigen::Vector3d y = eye_.R_world_eye.col(1) * (0.5 * height);
    const std::size_t step = stepOf(cloud.points.size(), kOfSquare);
    for (std::size_t i = 0; i < cloud.points.size(); i += step) {
      if (!cloud.points[i].allFinite()) continue;
      const Eigen::Vector3d p = world(cloud.points[i]);
      const Rgba color = colorAt(cloud.colors, i);
      const std::uint32_t first = size();
      addPoint(p - x - y, color);
      addPoint(p + x - y, color);
      addPoint(p + x + y, color);
      addPoint(p - x + y, color);
      out_.mesh.triangles.push_back({first, first + 1, first + 2});
      out_.mesh.triangles.push_back({first, first + 2, first + 3});
    }
  }

  void addSplats(const PointCloud& cloud) {
    for (std::size_t i = 0; i < cloud.points.size(); ++i) {
      if (!cloud.points[i].allFinite()) continue;
      out_.splats.push_back({world(cloud.points[i]), colorAt(cloud.colors, i), cloud.size});
    }
  }

  const Eigen::Isometry3d& pose_;
  const Color color_;
  const Eye& eye_;
  Tessellation& out_;
  Solid seen_;
  int most_sides_ = kMostSides;  ///< sides of round things, at most
};

}  // namespace

std::size_t cornersOf(const Shape& shape) { return std::visit(CornerCounter(), shape); }

void tessellate(const Drawable& drawable, const Eye& eye, Tessellation& out) {
  out.mesh.clear();
  out.splats.clear();
  out.thin_lines.clear();
  out.convex_parts.clear();
  if (!drawable.pose.matrix().matrix().allFinite()) return;
  std::visit(Tessellator(drawable, eye, out), drawable.shape);
}

namespace {

constexpr std::array<int, 9> kSides = {kLeastSides, 16, 24, 32, 48, 64, 96, 128, kMostSides};

/// Makes a polygon's area its circle's.
double widened(double radius, int sides) {
  const double angle = 2 * M_PI / sides;
  return radius * std::sqrt(angle / std::sin(angle));
}

Eigen::Vector3d onCircle(int i, int count, double radius, double z) {
  const double angle = 2 * M_PI * i / count;
  return {radius * std::cos(angle), radius * std::sin(angle), z};
}

std::uint32_t add(Solid& solid, const Eigen::Vector3d& p) {
  solid.points.push_back(p);
  return static_cast<std::uint32_t>(solid.points.size() - 1);
}

/// A ring of `count` points; returns the index of its first.
std::uint32_t addRing(Solid& solid, int count, double radius, double z) {
  const auto first = static_cast<std::uint32_t>(solid.points.size());
  radius = widened(radius, count);
  for (int i = 0; i < count; ++i) solid.points.push_back(onCircle(i, count, radius, z));
  return first;
}

void joinRings(Solid& solid, std::uint32_t below, std::uint32_t above, int count) {
  for (int i = 0; i < count; ++i) {
    const std::uint32_t j = static_cast<std::uint32_t>((i + 1) % count), k = i;
    solid.triangles.push_back({below + k, below + j, above + j});
    solid.triangles.push_back({below + k, above + j, above + k});
  }
}

/// Triangles from a point to a ring.
void joinTip(Solid& solid, std::uint32_t tip, std::uint32_t ring, int count, bool ring_below) {
  for (int i = 0; i < count; ++i) {
    const std::uint32_t k = ring + i, j = ring + static_cast<std::uint32_t>((i + 1) % count);
    if (ring_below) {
      solid.triangles.push_back({tip, k, j});
    } else {
      solid.triangles.push_back({tip, j, k});
    }
  }
}

/// The disc within a ring, as a fan around one of its points: each triangle continues the one before.
void addDisc(Solid& solid, std::uint32_t ring, int count, bool from_above) {
  const auto sides = static_cast<std::uint32_t>(count);
  const auto at = [&](std::uint32_t k) { return ring + (from_above ? k : sides - k); };
  for (std::uint32_t k = 1; k + 1 < sides; ++k) {
    solid.triangles.push_back({ring, at(k), at(k + 1)});
  }
}

Solid makeCube() {
  Solid cube;
  for (int i = 0; i < 8; ++i) {
    cube.points.emplace_back(i & 1 ? 0.5 : -0.5, i & 2 ? 0.5 : -0.5, i & 4 ? 0.5 : -0.5);
  }
  // Counterclockwise from outside.
  const std::array<std::uint32_t, 4> faces[] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                                {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  for (const auto& f : faces) {
    cube.triangles.push_back({f[0], f[1], f[2]});
    cube.triangles.push_back({f[0], f[2], f[3]});
  }
  return cube;
}

Solid makeSphere(int slices) {
  const int stacks = slices / 2;
  Solid sphere;
  const std::uint32_t south = add(sphere, {0, 0, -0.5});
  std::uint32_t previous = 0;
  for (int i = 1; i < stacks; ++i) {
    const double polar = M_PI * i / stacks;
    const std::uint32_t ring =
        addRing(sphere, slices, 0.5 * std::sin(polar), -0.5 * std::cos(polar));
    if (i == 1) {
      joinTip(sphere, south, ring, slices, false);
    } else {
      joinRings(sphere, previous, ring, slices);
    }
    previous = ring;
  }
  joinTip(sphere, add(sphere, {0, 0, 0.5}), previous, slices, true);
  return sphere;
}

Solid makeCylinder(int sides) {
  Solid cylinder;
  const std::uint32_t bottom = addRing(cylinder, sides, 0.5, -0.5);
  const std::uint32_t top = addRing(cylinder, sides, 0.5, 0.5);
  joinRings(cylinder, bottom, top, sides);
  addDisc(cylinder, bottom, sides, false);
  addDisc(cylinder, top, sides, true);
  return cylinder;
}

Solid makeCone(int sides) {
  Solid cone;
  const std::uint32_t base = addRing(cone, sides, 0.5, 0);
  joinTip(cone, add(cone, {0, 0, 1}), base, sides, true);
  addDisc(cone, base, sides, false);
  // Around x instead of z: a rotation of the axes, so that the winding stays.
  for (Eigen::Vector3d& p : cone.points) p = Eigen::Vector3d(p.z(), p.x(), p.y());
  return cone;
}

using Solids = std::array<Solid, kSides.size()>;

Solids makeAll(Solid (*make)(int sides)) {
  Solids solids;
  std::transform(kSides.begin(), kSides.end(), solids.begin(), make);
  return solids;
}

std::size_t indexOf(int sides) {
  const auto enough = std::lower_bound(kSides.begin(), kSides.end() - 1, sides);
  return static_cast<std::size_t>(enough - kSides.begin());
}

}  // namespace

const Solid& unitCube() {
  static const Solid cube = makeCube();
  return cube;
}

const Solid& unitSphere(int sides) {
  static const Solids spheres = makeAll(makeSphere);
  return spheres[indexOf(sides)];
}

const Solid& unitCylinder(int sides) {
  static const Solids cylinders = makeAll(makeCylinder);
  return cylinders[indexOf(sides)];
}

const Solid& unitCone(int sides) {
  static const Solids cones = makeAll(makeCone);
  return cones[indexOf(sides)];
}

/// Returns the sides of a sphere, whose outline is the circle where lines of sight touch it.
/// Between that and the nearest point one more ring makes depths right to a thirtieth of the
/// radius.
int sidesUpTo(int sides) {
  return *std::prev(std::upper_bound(kSides.begin() + 1, kSides.end(), sides));
}

void seenOfUnitSphere(const Eigen::Vector3d& eye, bool is_direction, int sides, Solid& out) {
  out.points.clear();
  out.triangles.clear();
  const int count = kSides[indexOf(sides)];
  Eigen::Matrix3d axes;
  axes.col(2) = eye.normalized();
  axes.col(0) = axes.col(2).unitOrthogonal();
  axes.col(1) = axes.col(2).cross(axes.col(0));
  const double outline = is_direction ? M_PI / 2 : std::acos(0.5 / eye.norm());
  const std::uint32_t tip = add(out, {0, 0, 0.5});
  const auto ring = [&](double polar) {
    return addRing(out, count, 0.5 * std::sin(polar), 0.5 * std::cos(polar));
  };
  const std::uint32_t inner = ring(outline / 2), outer = ring(outline);
  joinTip(out, tip, inner, count, true);
  joinRings(out, outer, inner, count);
  for (Eigen::Vector3d& p : out.points) p = axes * p;
}

}  // namespace afterglow::render
