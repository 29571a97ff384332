#include "render/scene/thin_lines.hpp"

namespace afterglow::render {
namespace {

/// Cuts the part behind the lens off the end at `to`.
bool clipEnd(const CutVertex& from, CutVertex& to) {
  const auto distance = [](const CutVertex& v) {
    return v.p_optical.z() - LensDomain::kNear * v.p_optical.w();
  };
  const double at_from = distance(from), at_to = distance(to);
  if (at_to >= 0) return true;
  if (at_from < 0) return false;
  to = mixed(from, to, at_from / (at_from - at_to));
  return true;
}

CutVertex moved(const CutVertex& vertex, const Eigen::Vector2d& by) {
  CutVertex out = vertex;
  out.p_optical.head<2>() += by * vertex.p_optical.z();
  return out;
}

void addPiece(const LensDomain& domain, const CutVertex& from, const CutVertex& to, double width_px,
              int depth, std::vector<CutVertex>& out) {
  constexpr int kMostHalvings = 12;
  const Eigen::Vector2d a = normalized(from), b = normalized(to);
  if (depth < kMostHalvings && !domain.isStraight(a, b)) {
    const double za = from.p_optical.z(), zb = to.p_optical.z();
    const CutVertex middle = mixed(from, to, za / (za + zb));  // half-way on the image
    addPiece(domain, from, middle, width_px, depth + 1, out);
    addPiece(domain, middle, to, width_px, depth + 1, out);
    return;
  }
  Eigen::Vector2d along = (b - a).cwiseProduct(domain.focal());
  along = along.norm() > 1e-9 ? along.normalized() : Eigen::Vector2d::UnitX();
  const Eigen::Vector2d half = (0.5 * width_px * along).cwiseQuotient(domain.focal());
  const Eigen::Vector2d side =
      (0.5 * width_px * Eigen::Vector2d(-along.y(), along.x())).cwiseQuotient(domain.focal());
  const CutVertex corners[] = {moved(from, -half - side), moved(to, half - side),
                               moved(to, half + side), moved(from, -half + side)};
  for (const int i : {0, 1, 2, 0, 2, 3}) out.push_back(corners[i]);
}

}  // namespace

void addThinLine(const LensDomain& domain, const CutVertex& from, const CutVertex& to,
                 double width_px, std::vector<CutVertex>& out) {
  CutVertex a = from, b = to;
  if (!(a.p_optical.w() > 0 && b.p_optical.w() > 0)) return;  // seen along the surface
  if (!clipEnd(a, b) || !clipEnd(b, a)) return;
  a.p_optical /= a.p_optical.w();
  b.p_optical /= b.p_optical.w();
  addPiece(domain, a, b, width_px, 0, out);
}

}  // namespace afterglow::render
