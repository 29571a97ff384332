#include "render/splat/point_painter.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <utility>

#include "render/splat/point_order.hpp"

namespace afterglow::render {
namespace {

/// Two pixels' components: vector instructions where the machine has them (GCC and Clang).
using Lanes = std::uint16_t __attribute__((vector_size(16)));

std::uint64_t spread(std::uint32_t color) {
  const std::uint64_t c = color;
  return (c & 0xff) | (c & 0xff00) << 8 | (c & 0xff0000) << 16 | (c & 0xff000000u) << 24;
}

Lanes sourceOf(std::uint32_t color) {
  const std::uint64_t opaque = spread(color | 0xff000000u);
  const std::uint64_t both[2] = {opaque, opaque};
  Lanes source;
  std::memcpy(&source, both, sizeof(source));
  return source;
}

std::uint32_t gather(std::uint64_t pixel) {
  return static_cast<std::uint32_t>((pixel & 0xff) | (pixel >> 8 & 0xff00) |
                                    (pixel >> 16 & 0xff0000) | (pixel >> 24 & 0xff000000u));
}

/// Two pixels' shares of 255 in all their components.
Lanes sharesOf(unsigned first, unsigned second) {
  constexpr std::uint64_t kEach = 0x0001000100010001u;
  using Pair = std::uint64_t __attribute__((vector_size(16)));
  const Pair pair = {first * kEach, second * kEach};
  return reinterpret_cast<Lanes>(pair);
}

/// The source's shares over two pixels, rounded as division by 255 is.
void mix(std::uint64_t* pixels, Lanes source, Lanes shares) {
  Lanes below;
  std::memcpy(&below, pixels, sizeof(below));
  const Lanes sum = below * (255 - shares) + source * shares + 128;
  const Lanes mixed = (sum + (sum >> 8)) >> 8;
  std::memcpy(pixels, &mixed, sizeof(mixed));
}

int subpixels(float size_px) {
  return static_cast<int>(std::lround(std::max(0.f, size_px) * kSubpixels));
}

/// First subpixel of a square around `center`; pixel i begins at i * kSubpixels.
int begin(std::int32_t center, int size) { return center + kSubpixels / 2 - size / 2; }

/// How much of pixel i lies between two subpixels.
int overlap(int i, int from, int to) {
  return std::min(to, (i + 1) * kSubpixels) - std::max(from, i * kSubpixels);
}

}  // namespace

PointPainter::PointPainter(int width, int height, Workers& workers)
    : width_(width),
      height_(height),
      bands_((height + kBandRows - 1) / kBandRows),
      workers_(workers) {
  for (Bench& bench : benches_) {
    bench.pixels.resize(static_cast<std::size_t>(width) * kBandRows + 1);  // pairs reach over
    bench.filled.resize(static_cast<std::size_t>(bands_));
  }
}

void PointPainter::paintRgb(const std::vector<ScreenPoint>& points,
                            const std::vector<PointRun>& runs, std::uint8_t* rgb) {
  paint(points, runs, [rgb](std::size_t first, std::size_t count, const Pixel* pixels) {
    std::uint8_t* out = rgb + 3 * first;
    if (pixels == nullptr) {
      std::memset(out, 0, 3 * count);
      return;
    }
    for (std::size_t i = 0; i < count; ++i) {
      out[3 * i] = static_cast<std::uint8_t>(pixels[i]);
      out[3 * i + 1] = static_cast<std::uint8_t>(pixels[i] >> 16);
      out[3 * i + 2] = static_cast<std::uint8_t>(pixels[i] >> 32);
    }
  });
}

void PointPainter::paintRgba(const std::vector<ScreenPoint>& points,
                             const std::vector<PointRun>& runs, std::uint32_t* rgba) {
  paint(points, runs, [rgba](std::size_t first, std::size_t count, const Pixel* pixels) {
    if (pixels == nullptr) {
      std::memset(rgba + first, 0, 4 * count);
    } else {
      std::transform(pixels, pixels + count, rgba + first, gather);
    }
  });
}

template <typename Write>
void PointPainter::paint(const std::vector<ScreenPoint>& points, const std::vector<PointRun>& runs,
                         const Write& write) {
  const auto bands = static_cast<std::size_t>(bands_);
  bins_.assign(runs.size() * bands, Bin());
  std::size_t most = 0;
  for (const PointRun& run : runs) most += 2 * std::size_t{run.count};
  if (binned_.size() < most) binned_.resize(most);
  for (std::size_t i = 0; i < runs.size(); ++i) {
    fillBins(points.data() + runs[i].first, runs[i], &bins_[i * bands]);
  }
  std::atomic<int> next{0};
  workers_.run([&](int worker) {
    Bench& bench = benches_[static_cast<std::size_t>(worker)];
    for (int band = next++; band < bands_; band = next++) {
      const int rows = std::min(kBandRows, height_ - band * kBandRows);
      const auto width = static_cast<std::size_t>(width_);
      const std::size_t first = static_cast<std::size_t>(band) * kBandRows * width;
      const std::size_t count = static_cast<std::size_t>(rows) * width;
      bool is_empty = true;
      for (std::size_t i = static_cast<std::size_t>(band); i < bins_.size(); i += bands) {
        is_empty = is_empty && bins_[i].count == 0;
      }
      if (!is_empty) paintBand(band, runs, bench);
      write(first, count, is_empty ? nullptr : bench.pixels.data());
    }
  });
}

/// The bands whose rows a point touches: at most two.
template <typename Visit>
void PointPainter::eachBand(const ScreenPoint& point, int size, const Visit& visit) const {
  const int top = begin(point.v, size), bottom = top + size - 1;
  if (bottom < 0 || size <= 0) return;
  const int first = std::max(0, top) / (kBandRows * kSubpixels);
  const int last = std::min(bands_ - 1, bottom / (kBandRows * kSubpixels));
  for (int band = first; band <= last; ++band) visit(static_cast<std::size_t>(band));
}

/// Counted first, so that each worker knows where its half of the points goes, in their order.
void PointPainter::fillBins(const ScreenPoint* points, const PointRun& run, Bin* bins) {
  const int size = subpixels(run.size_px);
  const auto part = [&](int worker) { return std::size_t{run.count} * unsigned(worker) / 2; };
  workers_.run([&](int worker) {
    std::vector<std::size_t>& filled = benches_[static_cast<std::size_t>(worker)].filled;
    std::fill(filled.begin(), filled.end(), 0);
    for (std::size_t i = part(worker); i < part(worker + 1); ++i) {
      eachBand(points[i], size, [&](std::size_t band) { ++filled[band]; });
    }
  });
  std::size_t at = bins == bins_.data() ? 0 : (bins - 1)->first + (bins - 1)->count;
  for (std::size_t band = 0; band < static_cast<std::size_t>(bands_); ++band) {
    bins[band].first = at;
    for (Bench& bench : benches_) {
      const std::size_t count = std::exchange(bench.filled[band], at);
      at += count;
    }
    bins[band].count = at - bins[band].first;
  }
  workers_.run([&](int worker) {
    std::vector<std::size_t>& filled = benches_[static_cast<std::size_t>(worker)].filled;
    for (std::size_t i = part(worker); i < part(worker + 1); ++i) {
      eachBand(points[i], size, [&](std::size_t band) { binned_[filled[band]++] = points[i]; });
    }
  });
}

void PointPainter::paintBand(int band, const std::vector<PointRun>& runs, Bench& bench) const {
  std::fill(bench.pixels.begin(), bench.pixels.end(), 0);
  const int row_begin = band * kBandRows, row_end = std::min(height_, row_begin + kBandRows);
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const Bin& bin = bins_[i * static_cast<std::size_t>(bands_) + static_cast<std::size_t>(band)];
    const int size = subpixels(runs[i].size_px);
    const ScreenPoint* points = binned_.data() + bin.first;
    if (runs[i].is_ordered) points = sortByOrder(points, bin.count, bench.sorting);
    for (std::size_t k = 0; k < bin.count; ++k) {
      paintSquare(points[k], size, row_begin, row_end, bench.pixels.data());
    }
  }
}

void PointPainter::paintSquare(const ScreenPoint& point, int size, int row_begin, int row_end,
                               Pixel* pixels) const {
  const int left = begin(point.u, size), right = left + size;
  const int top = begin(point.v, size), bottom = top + size;
  // Shifts round down, also below zero.
  const int u_begin = std::max(0, left >> 8), u_end = std::min(width_, (right + 255) >> 8);
  const int v_begin = std::max(row_begin, top >> 8), v_end = std::min(row_end, (bottom + 255) >> 8);
  if (u_begin >= u_end) return;
  std::array<unsigned, static_cast<std::size_t>(kLargest) + 2> shares;
  for (int u = u_begin; u < u_end; ++u) {
    shares[static_cast<std::size_t>(u - u_begin)] = static_cast<unsigned>(overlap(u, left, right));
  }
  shares[static_cast<std::size_t>(u_end - u_begin)] = 0;
  const unsigned alpha = point.color >> 24;
  const Lanes source = sourceOf(point.color);
  for (int v = v_begin; v < v_end; ++v) {
    const unsigned row_share = static_cast<unsigned>(overlap(v, top, bottom)) * alpha;
    Pixel* row = pixels + static_cast<std::ptrdiff_t>(v - row_begin) * width_;
    for (int u = u_begin; u < u_end; u += 2) {
      const unsigned* pair = &shares[static_cast<std::size_t>(u - u_begin)];
      // A pixel past the end has no share and stays as it is.
      mix(row + u, source,
          sharesOf((pair[0] * row_share + 0x8000) >> 16, (pair[1] * row_share + 0x8000) >> 16));
    }
  }
}

}  // namespace afterglow::render
