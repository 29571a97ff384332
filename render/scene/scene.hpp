/// \file
/// The content to be drawn: plain values in world coordinates, RViz's terms, no GL. Semantics of
/// every shape and style are RViz 1.14's (visualization_msgs/Marker, PointCloud2, Path displays).
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "calib/frames.hpp"
#include "render/scene/mesh.hpp"

namespace afterglow::render {

/// A value as std::vector is: a change of a copy changes that copy alone. The last copy to go frees
/// the elements. Different copies may be used in different threads.
template <typename T>
class SharedList {
 public:
  using value_type = T;
  using const_iterator = typename std::vector<T>::const_iterator;
  using iterator = const_iterator;  ///< elements are changed through edit() alone

  SharedList() = default;
  SharedList(std::vector<T> elements)
      : elements_(std::make_shared<std::vector<T>>(std::move(elements))) {}
  SharedList(std::initializer_list<T> elements) : SharedList(std::vector<T>(elements)) {}

  const std::vector<T>& get() const {
    static const std::vector<T> none;
    return elements_ ? *elements_ : none;
  }
  operator const std::vector<T>&() const { return get(); }
  std::size_t size() const { return get().size(); }
  bool empty() const { return get().empty(); }
  const_iterator begin() const { return get().begin(); }
  const_iterator end() const { return get().end(); }
  const T& operator[](std::size_t i) const { return get()[i]; }
  const T& at(std::size_t i) const { return get().at(i); }
  const T& front() const { return get().front(); }
  const T& back() const { return get().back(); }

  /// Elements that are this copy's own, to be changed before it is copied again.
  std::vector<T>& edit() {
    if (!elements_) {
      elements_ = std::make_shared<std::vector<T>>();
    } else if (elements_.use_count() > 1) {
      elements_ = std::make_shared<std::vector<T>>(*elements_);
    }
    return *elements_;
  }
  void push_back(const T& element) { edit().push_back(element); }
  template <typename... Arguments>
  void emplace_back(Arguments&&... arguments) {
    edit().emplace_back(std::forward<Arguments>(arguments)...);
  }

  friend bool operator==(const SharedList& a, const SharedList& b) { return a.get() == b.get(); }

 private:
  std::shared_ptr<std::vector<T>> elements_;
};

using PointList = std::vector<Eigen::Vector3f>;  ///< meters, in the drawable's frame

// ------------------------------------------------------------------------------------------ shapes
/// Along +x from the origin: shaft 77 % of the length, head 23 %; diameters as given.
struct Arrow {
  float length = 1, shaft_diameter = 0.1f, head_diameter = 0.2f;
  float head_length = 0.23f;
};
struct Cube { Eigen::Vector3f size = Eigen::Vector3f::Ones(); };      ///< full sizes
struct Sphere { Eigen::Vector3f size = Eigen::Vector3f::Ones(); };    ///< full diameters
struct Cylinder { Eigen::Vector3f size = Eigen::Vector3f::Ones(); };  ///< x, y diameters, z height
/// Width in meters, facing the viewer; strip: consecutive points joined; else pairs.
struct Lines {
  SharedList<Eigen::Vector3f> points;  ///< a PointList
  SharedList<Color> colors;            ///< a ColorList
  float width = 0.01f;
  bool strip = true;
  float width_px = 0;  ///< more than 0: the width in pixels of the image instead
};
/// A cube or sphere of the same size at every point.
struct ShapeList {
  enum class Kind { Cubes, Spheres } kind = Kind::Cubes;
  SharedList<Eigen::Vector3f> points;
  SharedList<Color> colors;
  Eigen::Vector3f size = Eigen::Vector3f::Ones();
};
/// Triples of points; colors per point or per triangle (a third as many). Seen from both sides.
struct Triangles {
  SharedList<Eigen::Vector3f> points;
  SharedList<Color> colors;
};

/// Triangles made once and shared by every copy of the drawables that show them; never changed.
struct Body {
  PointList points;
  ColorList colors;  ///< empty, or one a point
  std::vector<std::array<std::uint32_t, 3>> triangles;
  /// The edges around a flat body, all turning around its inside the same way; a body that is not
  /// flat has none.
  std::vector<std::array<std::uint32_t, 2>> outline = {};
  bool is_closed = false;  ///< clockwise sides are not seen from outside (closed_body.hpp)
};
using SharedBody = std::shared_ptr<const Body>;
/// Letters around the origin of their own plane: x along the line, y up. Of the pose only the
/// position counts: they face the projector or the viewer, or lie on the surface (Reader).
struct Text { SharedBody letters; };
/// A mesh file's triangles times a scale, in their own colors, which the drawable's multiplies, or
/// in the drawable's alone.
struct MeshInstance {
  SharedBody body;
  Eigen::Vector3f scale = Eigen::Vector3f::Ones();
  bool own_colors = false;
};

enum class PointStyle {
  Points,       ///< squares of `size` pixels
  Squares,      ///< `size` meters, facing the viewer
  FlatSquares,  ///< the same, unlit (RViz's default)
  Spheres,
  Boxes,
};
constexpr float kLargestPoint = 250;  ///< px; of PointStyle::Points
struct PointCloud {
  SharedList<Eigen::Vector3f> points;
  SharedList<Rgba> colors;
  PointStyle style = PointStyle::FlatSquares;
  float size = 0.01f;  ///< meters; for PointStyle::Points pixels
  /// Height of a square where it differs from its width (Marker POINTS); 0: the same.
  float size_y = 0;
};

using Shape = std::variant<Arrow, Cube, Sphere, Cylinder, Lines, ShapeList, Triangles, PointCloud,
                           Text, MeshInstance>;

/// The shape, if it is a cloud of PointStyle::Points; else nullptr.
const PointCloud* pixelCloud(const Shape& shape);

/// A shape somewhere in the world.
struct Drawable {
  Rigid<World, World> pose;  ///< carries shape coordinates into world coordinates
  Shape shape;
  Color color;  ///< the color of a shape without colors; its alpha multiplies theirs
};

// ---------------------------------------------------------------------------------- where it lands
class Relief;

/// A flat part of the world that light may fall on: the z = 0 plane of its frame.
struct SurfacePatch {
  std::string name;
  Rigid<World, Surface> T_world_surface;
  std::vector<Eigen::Vector2d> polygon;  ///< meters, the surface's frame; empty: unbounded
  std::shared_ptr<const Relief> relief = nullptr;  ///< measured heights over its plane
};

enum class Placement {
  Direct,  ///< content lies where it says: the ray finds it
  Drape,   ///< along the surface's normal onto its plane
  Viewer,  ///< projection from a viewer's eye through the content onto the plane
};

/// The reader of text that lies on a surface: the feet of its lines point there.
struct Reader {
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();
  bool is_direction = false;  ///< p_world is a direction, the same for all texts
  friend bool operator==(const Reader& a, const Reader& b) {
    return a.p_world == b.p_world && a.is_direction == b.is_direction;
  }
};

/// Content of one topic.
struct Layer {
  std::string name;  ///< topic
  std::vector<Drawable> drawables;
  Placement placement = Placement::Direct;
  std::optional<SurfacePatch> surface;  ///< needed by Drape and Viewer; clips to its outline
  Eigen::Vector3d p_viewer = Eigen::Vector3d::Zero();  ///< world; for Placement::Viewer
  std::optional<Reader> reader;  ///< Drape's; else letters point to the surface's -y
  float gain = 1;  ///< factor on its light, before sRGB's curve; for surfaces darker or farther
};

/// The content of one image, drawn in order.
struct Scene {
  std::vector<Layer> layers;
  /// All surfaces that are known to catch light: light of a layer for one of them is left out where
  /// it would fall on another one before it.
  std::vector<SurfacePatch> surfaces = {};
};

/// The 4x4 matrix that carries world points onto the layer's surface (identity for Direct).
/// Throws std::logic_error if the placement needs a surface the layer does not have.
Eigen::Matrix4d placementMatrix(const Layer& layer);

/// Compares by value, bit by bit; lists, bodies and reliefs that both share are not looked into.
/// False is always allowed: equal bodies that are not shared are taken for different. The first
/// difference mostly decides.
bool isSame(const Scene& a, const Scene& b);
bool isSame(const Drawable& a, const Drawable& b);

}  // namespace afterglow::render
