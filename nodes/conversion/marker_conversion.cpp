#include "nodes/conversion/marker_conversion.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "nodes/conversion/geometry_conversion.hpp"
#include "render/scene/typeface.hpp"

namespace afterglow::nodes {
namespace {

/// Names the first of the characters that are missing.
std::string remarkOn(const std::u32string& missing) {
  if (missing.empty()) return {};
  const auto first = static_cast<std::uint32_t>(missing.front());
  return fmt::format(
      "no font has U+{:04X}{}: install one that has (fonts-noto-core, fonts-noto-cjk, "
      "fonts-symbola)",
      first, missing.size() > 1 ? fmt::format(" and {} more", missing.size() - 1) : "");
}

}  // namespace

Converted<render::SharedBody> MarkerAssets::text(const std::string& text, double capital_height) {
  const auto known = texts_.find({text, capital_height});
  if (known != texts_.end()) {
    if (auto letters = known->second.letters.lock()) {
      return {std::move(letters), known->second.remark};
    }
  }
  constexpr std::size_t kLongestCharacter = 4;                           // bytes
  const bool hopeless = text.size() > kLongestCharacter * kMostLetters;  // too many letters
  const std::u32string letters = hopeless ? std::u32string() : render::decodeUtf8(text);
  if (hopeless || letters.size() > kMostLetters) {
    return refused<render::SharedBody>("text of more than 4096 characters");
  }
  try {
    if (!typeface_) typeface_ = std::make_unique<render::Typeface>();
    render::TextBlock block = typeface_->set(letters, capital_height);
    const std::string remark = remarkOn(block.missing);
    auto body = std::make_shared<const render::Body>(std::move(block.letters));
    texts_.insert_or_assign({text, capital_height}, Known{body, remark});
    if (texts_.size() >= sweep_at_) forgetUnseen();
    return {std::move(body), remark};
  } catch (const std::runtime_error& error) {
    return refused<render::SharedBody>(error.what());
  }
}

void MarkerAssets::forgetUnseen() {
  for (auto it = texts_.begin(); it != texts_.end();) {
    it = it->second.letters.expired() ? texts_.erase(it) : std::next(it);
  }
  sweep_at_ = 2 * texts_.size() + 64;
}

namespace {

// --------------------------------------------------------------------------------------- arrows

struct PlacedArrow {
  Eigen::Isometry3d T_marker_arrow = Eigen::Isometry3d::Identity();
  /// An Arrow, or Triangles if width and height differ: its cross-section is then an ellipse.
  render::Shape shape;
};

constexpr float kHeadShare = 0.23f;   // of the length
constexpr float kHeadToShaft = 2.0f;  // diameters
constexpr int kSegments = 24;         // of an elliptic cross-section

/// A frustum about +x between two cross-sections, and the disc that closes it behind.
void addFrustum(render::PointList& triangles, float x0, const Eigen::Vector2f& radii0, float x1,
                const Eigen::Vector2f& radii1) {
  const auto at = [](float x, const Eigen::Vector2f& radii, int i) {
    const float angle = 2 * static_cast<float>(M_PI) * static_cast<float>(i) / kSegments;
    return Eigen::Vector3f(x, radii.x() * std::cos(angle), radii.y() * std::sin(angle));
  };
  for (int i = 0; i < kSegments; ++i) {
    const Eigen::Vector3f a = at(x0, radii0, i), b = at(x0, radii0, i + 1);
    const Eigen::Vector3f c = at(x1, radii1, i), d = at(x1, radii1, i + 1);
    for (const Eigen::Vector3f& corner : {a, c, b}) triangles.push_back(corner);
    if (!radii1.isZero()) {
      for (const Eigen::Vector3f& corner : {b, c, d}) triangles.push_back(corner);
    }
    for (const Eigen::Vector3f& corner : {a, b, Eigen::Vector3f(x0, 0, 0)}) {
      triangles.push_back(corner);
    }
  }
}

render::Triangles ellipticArrow(float length, float width, float height) {
  const Eigen::Vector2f shaft(width / 2, height / 2);
  const float neck = length * (1 - kHeadShare);
  render::PointList arrow;
  addFrustum(arrow, 0, shaft, neck, shaft);
  addFrustum(arrow, neck, kHeadToShaft * shaft, length, Eigen::Vector2f::Zero());
  return {std::move(arrow), {}};
}

Converted<PlacedArrow> arrowAlongX(const Eigen::Vector3f& scale) {
  const float height = scale.z() == 0 ? scale.y() : scale.z();
  if (scale.x() <= 0 || scale.y() <= 0 || height <= 0) {
    return refused<PlacedArrow>("arrow's length or width is not positive");
  }
  const Eigen::Isometry3d here = Eigen::Isometry3d::Identity();
  if (height != scale.y()) {
    return {PlacedArrow{here, ellipticArrow(scale.x(), scale.y(), height)}, {}};
  }
  const render::Arrow arrow{scale.x(), scale.y(), kHeadToShaft * scale.y(),
                            kHeadShare * scale.x()};
  return {PlacedArrow{here, arrow}, {}};
}

Converted<PlacedArrow> arrowBetween(const Eigen::Vector3d& start, const Eigen::Vector3d& end,
                                    const Eigen::Vector3f& scale) {
  const Eigen::Vector3d along = end - start;
  const auto length = static_cast<float>(along.norm());
  if (length <= 0) return refused<PlacedArrow>("arrow's start and end coincide");
  if (scale.minCoeff() < 0 || scale.head<2>().maxCoeff() == 0) {
    return refused<PlacedArrow>("arrow's length or width is not positive");
  }
  Eigen::Isometry3d T_marker_arrow = Eigen::Isometry3d::Identity();
  T_marker_arrow.translation() = start;
  T_marker_arrow.linear() =
      Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitX(), along).toRotationMatrix();
  const float head = scale.z() == 0 ? kHeadShare * length : std::min(scale.z(), length);
  return {PlacedArrow{T_marker_arrow, render::Arrow{length, scale.x(), scale.y(), head}}, {}};
}

/// The two forms of an ARROW marker. Semantics: RViz 1.14, markers/arrow_marker.cpp.
/// Without points: along +x, scale = length, width, height (height 0: as the width), shaft 77 % and
/// head 23 % of the length, the head twice as wide. With two: from the first to the second, scale =
/// shaft diameter, head diameter, head length (at most the distance; 0: 23 % of it).
/// Refused: another number of points, a length or width that is not positive.
Converted<PlacedArrow> toArrow(const render::PointList& points, const Eigen::Vector3f& scale) {
  if (points.empty()) return arrowAlongX(scale);
  if (points.size() != 2) return refused<PlacedArrow>("ARROW of neither 0 nor 2 points");
  return arrowBetween(points[0].cast<double>(), points[1].cast<double>(), scale);
}

// -------------------------------------------------------------------------------- other markers

using visualization_msgs::Marker;
using MaybeShape = Converted<render::Shape>;

/// Thickness of a flat solid: no pixel shows it, but it gives the solid two sides.
constexpr float kFlat = 1e-9f;

MaybeShape fault(const char* reason) { return refused<render::Shape>(reason); }

/// The lists that a type uses: points, or points and colors. Of others the lists are not looked at.
enum class ListUse { None, Points, PointsAndColors };

ListUse listUse(int type) {
  switch (type) {
    case Marker::ARROW:
      return ListUse::Points;
    case Marker::LINE_STRIP:
    case Marker::LINE_LIST:
    case Marker::CUBE_LIST:
    case Marker::SPHERE_LIST:
    case Marker::POINTS:
    case Marker::TRIANGLE_LIST:
      return ListUse::PointsAndColors;
    default:
      return ListUse::None;
  }
}

/// The extents that the type uses, 0 for the others. Absent if one of the used is not finite or
/// absurdly large.
std::optional<Eigen::Vector3f> usedScale(const Marker& marker) {
  const geometry_msgs::Vector3& scale = marker.scale;
  switch (marker.type) {
    case Marker::LINE_STRIP:
    case Marker::LINE_LIST:
      return toVector(scale.x, 0, 0);
    case Marker::POINTS:
      return toVector(scale.x, scale.y, 0);
    case Marker::TEXT_VIEW_FACING:
      return toVector(0, 0, scale.z);
    default:
      return toVector(scale.x, scale.y, scale.z);
  }
}

/// Text faces its viewer, whatever its orientation.
Converted<Eigen::Isometry3d> usedPose(const Marker& marker) {
  geometry_msgs::Pose pose = marker.pose;
  if (marker.type == Marker::TEXT_VIEW_FACING) pose.orientation = geometry_msgs::Quaternion();
  return toPose(pose);
}

/// A marker's lists, checked once.
struct Lists {
  render::PointList points;
  render::ColorList colors;
};

Converted<Lists> readLists(const Marker& marker) {
  Lists lists;
  const ListUse use = listUse(marker.type);
  if (use == ListUse::None) return {std::move(lists), {}};
  if (marker.points.size() > kMostPoints) return refused<Lists>("too many points");
  lists.points.reserve(marker.points.size());
  for (const geometry_msgs::Point& point : marker.points) {
    const auto vector = toVector(point.x, point.y, point.z);
    if (!vector) return refused<Lists>("a point is not finite or absurdly far");
    lists.points.push_back(*vector);
  }
  if (use == ListUse::Points) return {std::move(lists), {}};
  const std::size_t count = marker.points.size();
  const bool a_triangle = marker.type == Marker::TRIANGLE_LIST && marker.colors.size() == count / 3;
  if (!marker.colors.empty() && marker.colors.size() != count && !a_triangle) {
    return refused<Lists>("colors are not as many as points");
  }
  lists.colors.reserve(marker.colors.size());
  for (const std_msgs::ColorRGBA& message : marker.colors) {
    const auto color = toColor(message);
    if (!color) return refused<Lists>("a color is not finite");
    lists.colors.push_back(*color);
  }
  return {std::move(lists), {}};
}

/// Full extents of a solid. A negative extent mirrors the solid, which does not change it; with one
/// extent of 0 it is flat but visible, with two it is a line and invisible.
Converted<Eigen::Vector3f> solidSize(const Eigen::Vector3f& scale) {
  const Eigen::Vector3f size = scale.cwiseAbs();
  if ((size.array() == 0).count() > 1) return refused<Eigen::Vector3f>("scale is 0");
  return {size.cwiseMax(kFlat), {}};
}

template <typename Solid>
MaybeShape toSolid(const Eigen::Vector3f& scale) {
  auto size = solidSize(scale);
  if (!size.value) return refused<render::Shape>(std::move(size.reason));
  return {Solid{*size.value}, {}};
}

MaybeShape toShapeList(render::ShapeList::Kind kind, Lists lists, const Eigen::Vector3f& scale) {
  if (lists.points.empty()) return fault("no points");
  auto size = solidSize(scale);
  if (!size.value) return refused<render::Shape>(std::move(size.reason));
  return {render::ShapeList{kind, std::move(lists.points), std::move(lists.colors), *size.value},
          {}};
}

MaybeShape toLines(bool strip, Lists lists, float width) {
  if (lists.points.size() < 2) return fault("fewer than two points for a line");
  if (!strip && lists.points.size() % 2 != 0) return fault("LINE_LIST of an odd number of points");
  if (width <= 0) return fault("line width is not positive");
  return {render::Lines{std::move(lists.points), std::move(lists.colors), width, strip}, {}};
}

MaybeShape toPoints(Lists lists, const Eigen::Vector3f& scale) {
  if (lists.points.empty()) return fault("no points");
  if (scale.x() <= 0 || scale.y() <= 0) return fault("point size is not positive");
  render::PointCloud cloud;
  cloud.points = std::move(lists.points);
  cloud.colors = asBytes(lists.colors);
  cloud.style = render::PointStyle::Squares;
  cloud.size = scale.x();
  cloud.size_y = scale.y();
  return {std::move(cloud), {}};
}

MaybeShape toTriangles(Lists lists, const Eigen::Vector3f& scale) {
  if (lists.points.empty()) return fault("no points");
  if (lists.points.size() % 3 != 0) return fault("TRIANGLE_LIST of incomplete triangles");
  if ((scale.array() == 0).count() > 1) return fault("scale is 0");
  for (Eigen::Vector3f& point : lists.points) {
    point = point.cwiseProduct(scale);
    if (point.cwiseAbs().maxCoeff() > static_cast<float>(kFarthest)) {
      return fault("a point is not finite or absurdly far");
    }
  }
  return {render::Triangles{std::move(lists.points), std::move(lists.colors)}, {}};
}

MaybeShape toText(const Marker& marker, float height, MarkerAssets& assets) {
  if (height <= 0) return fault("text height (scale.z) is not positive");
  auto letters = assets.text(marker.text, height);
  if (!letters.value) return refused<render::Shape>(std::move(letters.reason));
  return {render::Text{std::move(*letters.value)},
          marker.text.empty() ? "text is empty" : letters.reason};
}

MaybeShape toMesh(const Marker& marker, const Eigen::Vector3f& scale, MarkerAssets& assets,
                  const MeshLibrary::Mesh* mesh) {
  if ((scale.array() == 0).count() > 1) return fault("scale is 0");
  MeshLibrary::Mesh body = mesh != nullptr ? *mesh : assets.meshes().get(marker.mesh_resource);
  if (!body.value) return refused<render::Shape>(std::move(body.reason));
  return {
      render::MeshInstance{std::move(*body.value), scale, marker.mesh_use_embedded_materials != 0},
      {}};
}

/// All types but ARROW, whose shape has a pose.
MaybeShape toShape(const Marker& marker, Lists lists, const Eigen::Vector3f& scale,
                   MarkerAssets& assets, const MeshLibrary::Mesh* mesh) {
  switch (marker.type) {
    case Marker::CUBE:
      return toSolid<render::Cube>(scale);
    case Marker::SPHERE:
      return toSolid<render::Sphere>(scale);
    case Marker::CYLINDER:
      return toSolid<render::Cylinder>(scale);
    case Marker::LINE_STRIP:
    case Marker::LINE_LIST:
      return toLines(marker.type == Marker::LINE_STRIP, std::move(lists), scale.x());
    case Marker::CUBE_LIST:
      return toShapeList(render::ShapeList::Kind::Cubes, std::move(lists), scale);
    case Marker::SPHERE_LIST:
      return toShapeList(render::ShapeList::Kind::Spheres, std::move(lists), scale);
    case Marker::POINTS:
      return toPoints(std::move(lists), scale);
    case Marker::TRIANGLE_LIST:
      return toTriangles(std::move(lists), scale);
    case Marker::TEXT_VIEW_FACING:
      return toText(marker, scale.z(), assets);
    case Marker::MESH_RESOURCE:
      return toMesh(marker, scale, assets, mesh);
    default:
      return fault("unknown type");
  }
}

/// A mesh's own colors replace the marker's color, unless it has one to multiply them with.
render::Color colorBesides(const render::Shape& shape, const render::Color& color) {
  const auto* mesh = std::get_if<render::MeshInstance>(&shape);
  const bool untinted = mesh != nullptr && mesh->own_colors && color == render::Color{0, 0, 0, 0};
  return untinted ? render::Color{} : color;
}

}  // namespace

Converted<render::Drawable> toDrawable(const Marker& marker, MarkerAssets& assets,
                                       const MeshLibrary::Mesh* mesh) {
  auto pose = usedPose(marker);
  if (!pose.value) return refused<render::Drawable>(std::move(pose.reason));
  const auto scale = usedScale(marker);
  if (!scale) return refused<render::Drawable>("scale is not finite or absurdly large");
  auto lists = readLists(marker);
  if (!lists.value) return refused<render::Drawable>(std::move(lists.reason));
  // Colors of points replace the marker's color and its alpha.
  const auto color = lists.value->colors.empty() ? toColor(marker.color) : render::Color{};
  if (!color) return refused<render::Drawable>("color is not finite");

  if (marker.type == Marker::ARROW) {
    auto arrow = toArrow(lists.value->points, *scale);
    if (!arrow.value) return refused<render::Drawable>(std::move(arrow.reason));
    const Rigid<World, World> placed(*pose.value * arrow.value->T_marker_arrow);
    return {render::Drawable{placed, std::move(arrow.value->shape), *color}, pose.reason};
  }
  auto shape = toShape(marker, std::move(*lists.value), *scale, assets, mesh);
  if (!shape.value) return refused<render::Drawable>(std::move(shape.reason));
  const render::Color used = colorBesides(*shape.value, *color);
  return {render::Drawable{Rigid<World, World>(*pose.value), std::move(*shape.value), used},
          pose.reason.empty() ? shape.reason : pose.reason};
}

}  // namespace afterglow::nodes
