#include "render/paint/cpu_drawer.hpp"

#include <algorithm>
#include <atomic>
#include <utility>

#include "render/scene/scene.hpp"

namespace afterglow::render {
namespace {

/// A part of the steps is so long, or longer where they are many: shorter ones than a worker's
/// whole share, since some steps take longer than others.
constexpr std::size_t kLeastPart = 16, kPartsEach = 4;

/// Returns true if its own points are shared by the workers.
bool isShared(const Drawable& drawable) {
  if (pixelCloud(drawable.shape) != nullptr) return true;
  const auto list = spriteList(drawable.shape);
  return list && Workers::areMany(list->points->size());
}

/// Returns true if a cloud has another one's very lists: to look into them would take as long as to
/// place their points.
bool sharesLists(const PointCloud& cloud, const PointCloud* other) {
  return other != nullptr && &cloud.points.get() == &other->points.get() &&
         &cloud.colors.get() == &other->colors.get();
}

}  // namespace

CpuDrawer::CpuDrawer(const calib::Lens& lens, int threads)
    : workers_(threads), point_projector_(lens), painter_(lens, workers_) {
  for (int i = 0; i < workers_.count(); ++i) expanders_.emplace_back(lens);
}

void CpuDrawer::begin(const ComposedImage& composed) {
  std::swap(now_, before_);
  now_.is_finished = false;
  PaintList& list = now_.list;
  list.steps.clear();
  list.steps.triangles.begin(composed);
  list.runs.clear();
  list.layers.clear();
  screen_point_count_ = 0;
  now_.masks = composed.masks;
  now_.layers.clear();
  now_.steps.resize(composed.layers.size());
  for (const ComposedLayer& layer : composed.layers) {
    const std::size_t first_piece = list.steps.pieces.size();
    addLayer(layer, now_.steps[now_.layers.size()]);
    now_.layers.push_back({layer.placed, layer.eye, layer.relief, layer.mask, {}});
    list.layers.push_back({layer.mask, layer.placed.flattened,
                           {list.steps.pieces.begin() + static_cast<std::ptrdiff_t>(first_piece),
                            list.steps.pieces.end()}});
    sortForDrawing(list.layers.back().pieces);
  }
}

void CpuDrawer::finish(Image& image) {
  painter_.project(now_.list);
  findDamage();
  const auto damaged = static_cast<std::size_t>(std::count(damage_.begin(), damage_.end(), 1));
  const bool is_little = 2 * damaged <= damage_.size();
  if (is_little && !kept_.empty()) {
    painter_.paint(now_.list, damage_, kept_.data());
    image.rgb = kept_;
  } else {
    kept_.clear();
    painter_.paint(now_.list, painter_.allBands(), image.rgb.data());
    if (is_little) kept_ = image.rgb;
  }
  now_.is_finished = true;
  // Clouds are large: the memory of the image before is wanted for the next.
  for (std::vector<Step>& steps : before_.steps) steps.clear();
}

/// New things by the thousand, or old ones' end, differ anywhere: one thread would look for long.
void CpuDrawer::findDamage() {
  damage_ = painter_.allBands();
  const auto areMany = [](const Step& step) { return isShared(step.drawable); };
  const std::size_t count = now_.layers.size();
  const bool is_alike = before_.is_finished && before_.layers.size() == count;
  if (!is_alike || !isSame(now_.masks, before_.masks)) return;
  for (std::size_t i = 0; i < count; ++i) {
    const std::vector<Step>* old = stepsBefore(now_.layers[i], i);
    const bool is_limited =
        old != nullptr && std::equal(now_.steps[i].begin(), now_.steps[i].end(), old->begin(),
                                     old->end(), [&](const Step& step, const Step& before) {
                                       return !step.is_new || !(areMany(step) || areMany(before));
                                     });
    if (!is_limited) return;
  }
  damage_ = painter_.noBands();
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t k = 0; k < now_.steps[i].size(); ++k) {
      const Step &step = now_.steps[i][k], &old = before_.steps[i][k];
      if (!step.is_new) continue;
      painter_.mark(now_.list, step.from, step.to, damage_);
      painter_.mark(before_.list, old.from, old.to, damage_);
    }
  }
}

const std::vector<CpuDrawer::Step>* CpuDrawer::stepsBefore(const ComposedLayer& layer,
                                                           std::size_t index) const {
  const bool is_known = before_.is_finished && index < before_.layers.size() &&
                        isSamePlace(layer, before_.layers[index]);
  return is_known ? &before_.steps[index] : nullptr;
}

void CpuDrawer::addLayer(const ComposedLayer& layer, std::vector<Step>& steps) {
  const std::size_t count = layer.steps.size();
  steps.resize(count);
  steps_before_ = stepsBefore(layer, now_.layers.size());
  for (std::size_t i = 0; i < count;) {
    const auto shared = static_cast<std::size_t>(
        std::find_if(layer.steps.begin() + static_cast<std::ptrdiff_t>(i), layer.steps.end(),
                     [](const Drawable* drawable) { return isShared(*drawable); }) -
        layer.steps.begin());
    addAmongWorkers(layer, i, shared, steps);
    if (shared < count) addStep(expanders_.front(), layer, shared, steps[shared], now_.list.steps);
    i = shared + 1;
  }
}

void CpuDrawer::addStep(StepExpander& expander, const ComposedLayer& layer, std::size_t index,
                        Step& step, ExpandedSteps& out) {
  const Drawable& drawable = *layer.steps[index];
  const PointCloud* cloud = pixelCloud(drawable.shape);
  const bool has_old = steps_before_ != nullptr && index < steps_before_->size();
  const Step* old = has_old ? &(*steps_before_)[index] : nullptr;
  step.is_new = old == nullptr ||
                (cloud != nullptr && !sharesLists(*cloud, pixelCloud(old->drawable.shape))) ||
                !isSame(drawable, old->drawable);
  step.drawable = drawable;
  step.from = out.ends();
  if (cloud != nullptr) {
    addPoints(drawable, layer);
  } else if (!step.is_new) {
    out.append(before_.list.steps, old->from, old->to);
  } else {
    expander.expand(drawable, layer, workers_, out);
  }
  step.to = out.ends();
}

void CpuDrawer::addPoints(const Drawable& drawable, const ComposedLayer& layer) {
  PaintList& list = now_.list;
  const PointRun run = point_projector_.project(
      *pixelCloud(drawable.shape), drawable.color, pointPlacement(drawable, layer.placed),
      workers_, list.screen_points, screen_point_count_);
  if (run.count == 0) return;
  const auto index = static_cast<std::uint32_t>(list.runs.size());
  list.runs.push_back(run);
  list.steps.pieces.push_back({Piece::Kind::Points, false, index, 1, run.mean_depth});
}

void CpuDrawer::addAmongWorkers(const ComposedLayer& layer, std::size_t begin, std::size_t end,
                                std::vector<Step>& steps) {
  const std::size_t count = end - begin, most = kPartsEach * expanders_.size();
  const std::size_t parts = std::min(count / kLeastPart, most);
  if (parts < 2 || expanders_.size() == 1) {
    for (std::size_t i = begin; i < end; ++i) {
      addStep(expanders_.front(), layer, i, steps[i], now_.list.steps);
    }
    return;
  }
  if (parts_.size() < parts) parts_.resize(parts);
  const auto first = [&](std::size_t part) { return begin + count * part / parts; };
  std::atomic<std::size_t> next{0};
  workers_.run([&](int worker) {
    StepExpander& expander = expanders_[static_cast<std::size_t>(worker)];
    for (std::size_t part = next++; part < parts; part = next++) {
      parts_[part].clear();
      for (std::size_t i = first(part); i < first(part + 1); ++i) {
        addStep(expander, layer, i, steps[i], parts_[part]);
      }
    }
  });
  for (std::size_t part = 0; part < parts; ++part) {
    const StepEnds here = now_.list.steps.ends();
    now_.list.steps.append(parts_[part], {}, parts_[part].ends());
    for (std::size_t i = first(part); i < first(part + 1); ++i) {
      steps[i].from += here;
      steps[i].to += here;
    }
  }
}

}  // namespace afterglow::render
