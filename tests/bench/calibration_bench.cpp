// The calibration: how fast tags are read and how well, against what the pictures allow, and a
// whole solve.
//
// The bound on a corner's error is Cramer and Rao's for straight edges: an edge of contrast A
// (gray), blurred by s (px) under noise n (gray) tells A^2 / (2 sqrt(pi) s n^2) about its place,
// for every pixel of its length; a line fitted to a side of length L is sure of its end to
// 2 / sqrt(I L). It knows nothing of the tag's inner edges, of which the refit makes use too.
#include <benchmark/benchmark.h>

#include <cmath>
#include <map>

#include "calib/detection/observe.hpp"
#include "calib/detection/tag_detector.hpp"
#include "calib/solver/solve.hpp"
#include "tests/support/synthetic_rig.hpp"

namespace afterglow::calib {
namespace {

/// Pictures of boards, and where their corners are.
struct Material {
  test::SyntheticRig rig = test::makeRig(test::RigKind::Standard, 1);
  std::vector<Photographs> photographs;
  std::vector<View> truth;

  explicit Material(int views) {
    const test::Photographer photographer(rig);
    for (const test::BoardPose& pose : test::boardPoses(rig, views, 1)) {
      const int index = static_cast<int>(photographs.size());
      photographs.push_back(
          photographer.photographs(test::viewName(index), pose, std::uint32_t(index)));
      truth.push_back(test::cornerView(rig, test::viewName(index), pose, 0, 1));
    }
  }
};

/// Root mean square per axis, as seen and as the bound has it.
class CornerErrors {
 public:
  template <typename AnyTag>
  void add(const std::vector<AnyTag>& seen, const std::vector<SeenTag>& truth,
           const Picture& picture) {
    std::map<int, const SeenTag*> by_id;
    for (const SeenTag& tag : truth) by_id[tag.id] = &tag;
    for (const AnyTag& tag : seen) {
      const auto known = by_id.find(tag.id);
      if (known == by_id.end()) continue;
      const auto& corners = known->second->corners;
      for (std::size_t i = 0; i < 4; ++i) {
        squares_ += (tag.corners[i] - corners[i]).squaredNorm() / 2;
        bound_squares_ += std::pow(bound(picture, corners), 2);
        ++count_;
      }
    }
  }
  void report(benchmark::State& state, const std::string& of) const {
    state.counters[of + "_px"] = std::sqrt(squares_ / count_);
    state.counters[of + "_bound_px"] = std::sqrt(bound_squares_ / count_);
  }

 private:
  static double bound(const Picture& picture, const std::array<Eigen::Vector2d, 4>& corners) {
    constexpr double kBlur_px = 0.67,
                     kNoise_gray = 1.5;  // lens and pixel; photographer and rounding
    double side = 0;
    for (std::size_t i = 0; i < 4; ++i) side += (corners[(i + 1) % 4] - corners[i]).norm() / 4;
    const double contrast = contrastOf(picture, corners);
    const double information =
        contrast * contrast / (2 * std::sqrt(3.14159265) * kBlur_px * kNoise_gray * kNoise_gray);
    return 2 / std::sqrt(information * side);
  }
  /// Gray levels between the tag's dark frame and the white rim round it, by its middle edge.
  static double contrastOf(const Picture& picture, const std::array<Eigen::Vector2d, 4>& corners) {
    const Eigen::Vector2d middle = (corners[0] + corners[2]) / 2;
    const Eigen::Vector2d edge = (corners[0] + corners[1]) / 2;
    const auto gray = [&](double outwards) {
      const Eigen::Vector2d at = middle + (edge - middle) * outwards;
      return double(picture.at(int(std::lround(at.x())), int(std::lround(at.y()))));
    };
    return std::max(gray(1.125) - gray(0.875), 10.0);
  }

  double squares_ = 0, bound_squares_ = 0;
  int count_ = 0;
};

void detect(benchmark::State& state) {
  const Material material(1);
  const Picture& picture = *material.photographs[0].plain;
  const TagDetector detector("tag36h11", double(state.range(0)));
  std::size_t tags = 0;
  for (auto _ : state) tags = detector.detect(picture).size();
  state.counters["tags"] = double(tags);
  // Prints as seconds: 100m is 100 ms a megapixel.
  state.counters["s_per_megapixel"] = benchmark::Counter(
      double(picture.pixels.size()) * 1e-6,
      benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}
BENCHMARK(detect)->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->UseRealTime();

/// AprilTag's corners as they are; printed and projected ones, 6 views.
void cornersOfDetector(benchmark::State& state) {
  const Material material(6);
  const TagDetector detector("tag36h11");
  CornerErrors printed, projected;
  for (auto _ : state) {
    for (std::size_t i = 0; i < material.truth.size(); ++i) {
      const Photographs& photographs = material.photographs[i];
      printed.add(detector.detect(*photographs.plain), material.truth[i].board, *photographs.plain);
      projected.add(detector.detect(photographs.pattern), material.truth[i].projected,
                    photographs.pattern);
    }
  }
  printed.report(state, "printed");
  projected.report(state, "projected");
}
BENCHMARK(cornersOfDetector)->Unit(benchmark::kMillisecond)->Iterations(1)->UseRealTime();

/// The same pictures, corners refitted in linear light; the projector's lens not known (0) or
/// known (1).
void cornersOfRefit(benchmark::State& state) {
  const Material material(6);
  const ViewReader reader(material.rig.board, material.rig.pattern, material.rig.camera);
  CornerErrors printed, projected;
  for (auto _ : state) {
    for (std::size_t i = 0; i < material.truth.size(); ++i) {
      const Photographs& photographs = material.photographs[i];
      View view = reader.observe(photographs);
      if (state.range(0) == 1) {
        view = reader.observeAgain(view, photographs, material.rig.projector);
      }
      printed.add(view.board, material.truth[i].board, *photographs.plain);
      projected.add(view.projected, material.truth[i].projected, photographs.pattern);
    }
  }
  printed.report(state, "printed");
  projected.report(state, "projected");
}
BENCHMARK(cornersOfRefit)
    ->Arg(0)
    ->Arg(1)
    ->Unit(benchmark::kMillisecond)
    ->Iterations(1)
    ->UseRealTime();

/// From pictures to the result: 24 photographs are 12 pairs.
void solve(benchmark::State& state) {
  const Material material(static_cast<int>(state.range(0)));
  double error_mm = 0;
  for (auto _ : state) {
    const Calibration result = solvePhotographs(material.photographs, material.rig.board,
                                                material.rig.pattern, material.rig.camera);
    error_mm = test::errorP95_mm(material.rig, result.estimate);
  }
  state.counters["error_p95_mm"] = error_mm;
}
BENCHMARK(solve)->Arg(12)->Arg(24)->Unit(benchmark::kSecond)->Iterations(1)->UseRealTime();

}  // namespace
}  // namespace afterglow::calib
