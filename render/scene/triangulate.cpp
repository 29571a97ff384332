#include "render/scene/triangulate.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace afterglow::render {
namespace {

using Ring = std::vector<std::uint32_t>;
using Point = Eigen::Vector2d;

/// Twice the area of a triangle, positive if counterclockwise.
double cross(const Point& a, const Point& b, const Point& c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
}

/// Returns true within a counterclockwise triangle, its rim included.
bool inTriangle(const Point& p, const Point& a, const Point& b, const Point& c) {
  return cross(a, b, p) >= 0 && cross(b, c, p) >= 0 && cross(c, a, p) >= 0;
}

class EarClipper {
 public:
  EarClipper(const Outline& outer, const std::vector<Outline>& holes) {
    ring_ = add(outer, true);
    std::vector<Ring> cuts;
    for (const Outline& hole : holes) {
      if (hole.size() >= 3) cuts.push_back(add(hole, false));
    }
    // From the right: a bridge from one hole then never runs through another.
    for (Ring& cut : cuts) std::rotate(cut.begin(), rightmost(cut), cut.end());
    std::sort(cuts.begin(), cuts.end(), [this](const Ring& a, const Ring& b) {
      return points_[a.front()].x() > points_[b.front()].x();
    });
    for (const Ring& cut : cuts) bridge(cut);
  }

  std::vector<std::array<std::uint32_t, 3>> clip() {
    std::vector<std::array<std::uint32_t, 3>> triangles;
    while (ring_.size() >= 3) {
      const std::size_t i = nextEar();
      const std::uint32_t a = before(i), b = ring_[i], c = after(i);
      if (cross(points_[a], points_[b], points_[c]) > 0) triangles.push_back({a, b, c});
      ring_.erase(ring_.begin() + static_cast<std::ptrdiff_t>(i));
      // Ears side by side would make a fan of slivers: go on one further.
      start_ = ring_.empty() ? 0 : (i + 1) % ring_.size();
    }
    return triangles;
  }

 private:
  Ring add(const Outline& outline, bool counterclockwise) {
    Ring ring;
    for (const Point& p : outline) {
      ring.push_back(static_cast<std::uint32_t>(points_.size()));
      points_.push_back(p);
    }
    if ((signedArea(outline) > 0) != counterclockwise) std::reverse(ring.begin(), ring.end());
    return ring;
  }

  Ring::iterator rightmost(Ring& ring) const {
    return std::max_element(ring.begin(), ring.end(), [this](std::uint32_t a, std::uint32_t b) {
      return points_[a].x() < points_[b].x();
    });
  }

  std::uint32_t before(std::size_t i) const { return ring_[(i + ring_.size() - 1) % ring_.size()]; }
  std::uint32_t after(std::size_t i) const { return ring_[(i + 1) % ring_.size()]; }

  /// Joins a hole to the ring by a cut from its rightmost point to a point of the ring it sees.
  void bridge(const Ring& hole) {
    const std::size_t at = visibleFrom(points_[hole.front()]);
    Ring joined(ring_.begin(), ring_.begin() + static_cast<std::ptrdiff_t>(at) + 1);
    joined.insert(joined.end(), hole.begin(), hole.end());
    joined.push_back(hole.front());
    joined.insert(joined.end(), ring_.begin() + static_cast<std::ptrdiff_t>(at), ring_.end());
    ring_ = std::move(joined);
  }

  /// D. Eberly, "Triangulation by Ear Clipping", section 3: the ring's edge to the right of m, and
  /// of its ends and the reflex corners before it the one nearest in angle.
  std::size_t visibleFrom(const Point& m) const {
    double nearest = std::numeric_limits<double>::infinity();
    std::size_t best = 0;
    for (std::size_t i = 0; i < ring_.size(); ++i) {
      const Point &a = points_[ring_[i]], &b = points_[after(i)];
      if (!(a.y() <= m.y() && b.y() >= m.y()) || a.y() == b.y())
        continue;  // upward: its left is in
      const double x = a.x() + (m.y() - a.y()) * (b.x() - a.x()) / (b.y() - a.y());
      if (x < m.x() || x >= nearest) continue;
      nearest = x;
      best = a.x() > b.x() ? i : (i + 1) % ring_.size();
    }
    const Point hit(nearest, m.y()), corner = points_[ring_[best]];
    double flattest = slope(m, corner), closest = (corner - m).norm();
    for (std::size_t i = 0; i < ring_.size() && std::isfinite(nearest); ++i) {
      const Point& p = points_[ring_[i]];
      const bool reflex = cross(points_[before(i)], p, points_[after(i)]) < 0;
      const bool inside =
          corner.y() < m.y() ? inTriangle(p, m, corner, hit) : inTriangle(p, m, hit, corner);
      const bool between = p.x() >= m.x() && p.x() <= nearest;
      if (!reflex || !inside || !between || p == corner) continue;
      const double steep = slope(m, p), far = (p - m).norm();
      if (steep < flattest || (steep == flattest && far < closest)) {
        flattest = steep;
        closest = far;
        best = i;
      }
    }
    return facing(best, m);
  }

  /// Earlier bridges have left two corners in one place: the one that opens toward m.
  std::size_t facing(std::size_t best, const Point& m) const {
    const Point& p = points_[ring_[best]];
    for (std::size_t i = 0; i < ring_.size(); ++i) {
      if (points_[ring_[i]] != p) continue;
      const Point &a = points_[before(i)], &c = points_[after(i)];
      const bool left_of_in = cross(a, p, m) >= 0, left_of_out = cross(p, c, m) >= 0;
      const bool convex = cross(a, p, c) > 0;
      if (convex ? left_of_in && left_of_out : left_of_in || left_of_out) return i;
    }
    return best;
  }

  static double slope(const Point& m, const Point& p) {
    return std::abs(p.y() - m.y()) / std::max(1e-12, p.x() - m.x());
  }

  /// A corner to cut off; where crossing outlines leave none, the first convex one.
  std::size_t nextEar() const {
    std::size_t convex = start_;
    bool found_convex = false;
    for (std::size_t k = 0; k < ring_.size(); ++k) {
      const std::size_t i = (start_ + k) % ring_.size();
      const double area = cross(points_[before(i)], points_[ring_[i]], points_[after(i)]);
      if (area == 0) return i;
      if (area < 0) continue;
      if (isEar(i)) return i;
      if (!found_convex) convex = i;
      found_convex = true;
    }
    return convex;
  }

  bool isEar(std::size_t i) const {
    const Point &a = points_[before(i)], &b = points_[ring_[i]], &c = points_[after(i)];
    return std::none_of(ring_.begin(), ring_.end(), [&](std::uint32_t other) {
      const Point& p = points_[other];
      return p != a && p != b && p != c && inTriangle(p, a, b, c);
    });
  }

  std::vector<Point> points_;
  Ring ring_;  ///< counterclockwise
  std::size_t start_ = 0;
};

}  // namespace

std::vector<std::array<std::uint32_t, 3>> triangulate(const Outline& outer,
                                                      const std::vector<Outline>& holes) {
  if (outer.size() < 3) return {};
  return EarClipper(outer, holes).clip();
}

}  // namespace afterglow::render
