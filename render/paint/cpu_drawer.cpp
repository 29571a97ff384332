#include "render/paint/cpu_drawer.hpp"

#include <algorithm>
#include <atomic>

namespace afterglow::render {
namespace {

/// A part of the steps is so long, or longer where they are many: shorter ones than a worker's
/// whole share, since some steps take longer than others.
constexpr std::size_t kLeastPart = 16, kPartsEach = 4;

/// Whether its own points are shared by the workers.
bool isShared(const Drawable& drawable) {
  if (pixelCloud(drawable.shape) != nullptr) return true;
  const auto list = spriteList(drawable.shape);
  return list && Workers::areMany(list->points->size());
}

}  // namespace

CpuDrawer::CpuDrawer(const calib::Lens& lens, int threads)
    : workers_(threads), point_projector_(lens), painter_(lens, workers_) {
  for (int i = 0; i < workers_.count(); ++i) expanders_.emplace_back(lens);
}

void CpuDrawer::begin(const ComposedImage& composed) {
  list_.steps.clear();
  list_.steps.triangles.begin(composed);
  list_.runs.clear();
  list_.layers.clear();
  screen_point_count_ = 0;
  for (const ComposedLayer& layer : composed.layers) {
    list_.steps.pieces.clear();
    addSteps(layer);
    list_.layers.push_back({layer.mask, layer.placed.flattened, list_.steps.pieces});
    sortForDrawing(list_.layers.back().pieces);
  }
}

void CpuDrawer::finish(Image& image) { painter_.paint(list_, image.rgb.data()); }

void CpuDrawer::addSteps(const ComposedLayer& layer) {
  for (Steps step = layer.steps.begin(); step != layer.steps.end();) {
    const Steps shared = std::find_if(step, layer.steps.end(),
                                      [](const Drawable* drawable) { return isShared(*drawable); });
    addAmongWorkers(step, shared, layer);
    step = shared;
    if (step == layer.steps.end()) break;
    const Drawable& drawable = **step++;
    if (pixelCloud(drawable.shape) != nullptr) {
      addPoints(drawable, layer);
    } else {
      expanders_.front().expand(drawable, layer, workers_, list_.steps);
    }
  }
}

void CpuDrawer::addPoints(const Drawable& drawable, const ComposedLayer& layer) {
  const PointRun run = point_projector_.project(
      *pixelCloud(drawable.shape), drawable.color, pointPlacement(drawable, layer.placed),
      workers_, list_.screen_points, screen_point_count_);
  if (run.count == 0) return;
  const auto index = static_cast<std::uint32_t>(list_.runs.size());
  list_.runs.push_back(run);
  list_.steps.pieces.push_back({Piece::Kind::Points, false, index, 1, run.mean_depth});
}

void CpuDrawer::addAmongWorkers(Steps begin, Steps end, const ComposedLayer& layer) {
  const auto count = static_cast<std::size_t>(end - begin);
  const std::size_t most = kPartsEach * expanders_.size();
  const std::size_t parts = std::min(count / kLeastPart, most);
  // A relief's placer is used by one thread at a time.
  if (parts < 2 || expanders_.size() == 1 || layer.relief != nullptr) {
    for (Steps step = begin; step != end; ++step) {
      expanders_.front().expand(**step, layer, workers_, list_.steps);
    }
    return;
  }
  if (parts_.size() < parts) parts_.resize(parts);
  std::atomic<std::size_t> next{0};
  workers_.run([&](int worker) {
    StepExpander& expander = expanders_[static_cast<std::size_t>(worker)];
    for (std::size_t part = next++; part < parts; part = next++) {
      parts_[part].clear();
      for (std::size_t i = count * part / parts; i < count * (part + 1) / parts; ++i) {
        expander.expand(*begin[static_cast<std::ptrdiff_t>(i)], layer, workers_, parts_[part]);
      }
    }
  });
  for (std::size_t part = 0; part < parts; ++part) list_.steps.append(parts_[part]);
}

}  // namespace afterglow::render
