#include "render/scene/cut.hpp"

#include <array>
#include <cmath>

namespace afterglow::render {
namespace {

/// The least weight; with smaller ones, content that a viewer sees almost along the surface would
/// lie a thousand times too far.
constexpr double kMinWeight = 1e-3;
constexpr int kMaxSplits = 24;  // halvings; 12 of an edge as long as the image leave < 1 px

CutVertex mix(const CutVertex& a, const CutVertex& b, double weight_a, double weight_b) {
  CutVertex mixed;
  mixed.p_optical = weight_a * a.p_optical + weight_b * b.p_optical;
  mixed.color = static_cast<float>(weight_a) * a.color + static_cast<float>(weight_b) * b.color;
  mixed.height = weight_a * a.height + weight_b * b.height;
  return mixed;
}

/// The point of an edge on the ray half-way between its ends' rays.
CutVertex imageMiddle(const CutVertex& a, const CutVertex& b) {
  const double da = a.p_optical.head<3>().norm(), db = b.p_optical.head<3>().norm();
  return mix(a, b, db / (da + db), da / (da + db));
}

double foldDistance(const LensDomain& domain, const Eigen::Vector2d& normal,
                    const Eigen::Vector4d& p) {
  return domain.foldInnerRadius() * p.z() - normal.dot(p.head<2>());
}

}  // namespace

bool isInside(const LensDomain& domain, const CutVertex& vertex) {
  const Eigen::Vector4d& p = vertex.p_optical;
  if (!(p.w() >= kMinWeight) || !(p.z() >= LensDomain::kNear * p.w())) return false;
  const Eigen::Vector2d n = normalized(vertex);
  return (n.array() >= domain.min().array()).all() && (n.array() <= domain.max().array()).all() &&
         n.norm() <= domain.foldInnerRadius();
}

unsigned bordersBeyond(const LensDomain& domain, const CutVertex& vertex) {
  const Eigen::Vector4d& p = vertex.p_optical;
  const Eigen::Vector2d &low = domain.min(), &high = domain.max();
  const double distances[] = {p.w() - kMinWeight,      p.z() - LensDomain::kNear * p.w(),
                              p.x() - low.x() * p.z(), high.x() * p.z() - p.x(),
                              p.y() - low.y() * p.z(), high.y() * p.z() - p.y()};
  unsigned bits = 0;
  for (unsigned i = 0; i < 6; ++i) bits |= distances[i] < 0 ? 1u << i : 0u;
  return bits;
}

CutVertex mixed(const CutVertex& from, const CutVertex& to, double share) {
  return mix(from, to, 1 - share, share);
}

/// Sutherland-Hodgman against distance(p) >= 0. A cut is computed from the inner end to the outer,
/// whichever way round the triangle has it, so that neighbors agree to the last bit.
template <typename Distance>
void TriangleCutter::clip(Distance distance) {
  clipped_.clear();
  for (std::size_t i = 0; i < polygon_.size(); ++i) {
    const CutVertex& a = polygon_[i];
    const CutVertex& b = polygon_[(i + 1) % polygon_.size()];
    const double da = distance(a.p_optical), db = distance(b.p_optical);
    if (da >= 0) clipped_.push_back(a);
    if ((da >= 0) == (db >= 0)) continue;
    const bool a_inside = da >= 0;
    const double inner = a_inside ? da : db, outer = a_inside ? db : da;
    const double t = inner / (inner - outer);
    clipped_.push_back(mix(a_inside ? a : b, a_inside ? b : a, 1 - t, t));
  }
  polygon_.swap(clipped_);
}

void TriangleCutter::clipToFold() {
  for (const Eigen::Vector2d& normal : domain_.foldNormals()) {
    bool outside = false;
    for (const CutVertex& vertex : polygon_) {
      outside = outside || foldDistance(domain_, normal, vertex.p_optical) < 0;
    }
    if (outside) {
      clip([&](const Eigen::Vector4d& p) { return foldDistance(domain_, normal, p); });
    }
  }
}

/// The rest of polygon_, with w = 1.
void TriangleCutter::clipToDomain() {
  const Eigen::Vector2d low = domain_.min(), high = domain_.max();
  clip([](const Eigen::Vector4d& p) { return p.w() - kMinWeight; });
  clip([](const Eigen::Vector4d& p) { return p.z() - LensDomain::kNear * p.w(); });
  clip([&](const Eigen::Vector4d& p) { return p.x() - low.x() * p.z(); });
  clip([&](const Eigen::Vector4d& p) { return high.x() * p.z() - p.x(); });
  clip([&](const Eigen::Vector4d& p) { return p.y() - low.y() * p.z(); });
  clip([&](const Eigen::Vector4d& p) { return high.y() * p.z() - p.y(); });
  clipToFold();
  for (CutVertex& vertex : polygon_) vertex.p_optical /= vertex.p_optical.w();
}

const std::vector<CutVertex>& TriangleCutter::cut(const CutVertex& a, const CutVertex& b,
                                                  const CutVertex& c) {
  output_.clear();
  polygon_.assign({a, b, c});
  clipToDomain();
  for (std::size_t i = 2; i < polygon_.size(); ++i) {
    split(polygon_[0], polygon_[i - 1], polygon_[i], 0);
  }
  return output_;
}

const std::vector<CutVertex>& TriangleCutter::cutOutline(const std::vector<CutVertex>& corners) {
  output_.clear();
  polygon_ = corners;
  clipToDomain();
  for (std::size_t i = 0; i < polygon_.size(); ++i) {
    splitEdge(polygon_[i], polygon_[(i + 1) % polygon_.size()], 0);
  }
  return output_;
}

/// Adds the edge without its last vertex.
void TriangleCutter::splitEdge(const CutVertex& from, const CutVertex& to, int depth) {
  if (depth == kMaxSplits || domain_.isStraight(normalized(from), normalized(to))) {
    output_.push_back(from);
    return;
  }
  const CutVertex middle = imageMiddle(from, to);
  splitEdge(from, middle, depth + 1);
  splitEdge(middle, to, depth + 1);
}

/// Halves the longest bent edge. Whether an edge is split depends on the edge alone.
void TriangleCutter::split(const CutVertex& a, const CutVertex& b, const CutVertex& c, int depth) {
  const std::array<const CutVertex*, 3> v = {&a, &b, &c};
  const std::array<Eigen::Vector2d, 3> n = {normalized(a), normalized(b), normalized(c)};
  int longest = -1;
  double length = 0;
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector2d &from = n[i], &to = n[(i + 1) % 3];
    if (domain_.isStraight(from, to) || (to - from).squaredNorm() <= length) continue;
    length = (to - from).squaredNorm();
    longest = i;
  }
  if (longest < 0 || depth == kMaxSplits) {
    output_.insert(output_.end(), {a, b, c});
    return;
  }
  const CutVertex &from = *v[longest], &to = *v[(longest + 1) % 3], &other = *v[(longest + 2) % 3];
  const CutVertex middle = imageMiddle(from, to);
  split(from, middle, other, depth + 1);
  split(middle, to, other, depth + 1);
}

}  // namespace afterglow::render
