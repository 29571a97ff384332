/// \file
/// Squares of a few pixels, each pixel getting the share that is covered, as shaders/point.frag
/// has it: drawn by the CPU, which is many times faster at it than OpenGL without a GPU.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "render/splat/screen_point.hpp"
#include "render/splat/workers.hpp"

namespace afterglow::render {

/// The image is painted in bands of rows that fit a core's cache: points are put in their bands'
/// bins, ordered there, and blended. A minimum of depth and colour per pixel would need no order,
/// but a pixel that the nearest point covers in part also shows the next one.
/// Keeps its buffers from frame to frame.
class PointPainter {
 public:
  static constexpr float kLargest = 24;  ///< px; a larger point would reach over three bands

  PointPainter(int width, int height, Workers& workers);
  PointPainter(const PointPainter&) = delete;
  PointPainter& operator=(const PointPainter&) = delete;

  /// Paints runs one over the other on black; 3 bytes a pixel, rows from the top, no padding.
  void paintRgb(const std::vector<ScreenPoint>& points, const std::vector<PointRun>& runs,
                std::uint8_t* rgb);
  /// Paints runs on nothing: r, g, b multiplied by alpha, and alpha, from the lowest byte on.
  void paintRgba(const std::vector<ScreenPoint>& points, const std::vector<PointRun>& runs,
                 std::uint32_t* rgba);

 private:
  static constexpr int kBandRows = 32;
  /// Four components in the lanes of 64 bits: two pixels are blended at once.
  using Pixel = std::uint64_t;
  struct Bin {
    std::size_t first = 0, count = 0;  ///< of binned_
  };
  struct Bench {
    std::vector<Pixel> pixels;         ///< of one band, and one more
    std::vector<ScreenPoint> sorting;  ///< half of them is room to move to
    std::vector<std::size_t> filled;   ///< by band
  };

  template <typename Write>
  void paint(const std::vector<ScreenPoint>& points, const std::vector<PointRun>& runs,
             const Write& write);
  void fillBins(const ScreenPoint* points, const PointRun& run, Bin* bins);
  template <typename Visit>
  void eachBand(const ScreenPoint& point, int size, const Visit& visit) const;
  void paintBand(int band, const std::vector<PointRun>& runs, Bench& bench) const;
  void paintSquare(const ScreenPoint& point, int size, int row_begin, int row_end,
                   Pixel* pixels) const;

  int width_, height_, bands_;
  Workers& workers_;
  std::vector<ScreenPoint> binned_;
  std::vector<Bin> bins_;  ///< a band's of each run, run by run
  std::array<Bench, Workers::kCount> benches_;
};

}  // namespace afterglow::render
