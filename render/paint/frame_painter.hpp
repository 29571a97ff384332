/// \file
/// A whole frame of light drawn by the CPU: every edge with the exact share of each pixel. Without
/// a GPU that is many times faster than OpenGL, and it needs no OpenGL at all.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include "render/paint/band_bins.hpp"
#include "render/paint/canvas.hpp"
#include "render/paint/float_lens.hpp"
#include "render/paint/light_frame.hpp"
#include "render/paint/point_brush.hpp"
#include "render/paint/polygon_brush.hpp"
#include "render/paint/workers.hpp"

namespace afterglow::render {

/// Things are put into the bins of the bands that they touch; then each worker paints band after
/// band. Keeps its buffers from frame to frame. Used from one thread at a time.
class FramePainter {
 public:
  /// The workers must outlive it.
  FramePainter(const calib::Lens& lens, Workers& workers);
  FramePainter(const FramePainter&) = delete;
  FramePainter& operator=(const FramePainter&) = delete;

  /// 3 bytes a pixel, rows from the top, no padding; black where nothing is.
  void paint(const LightFrame& frame, std::uint8_t* rgb);

 private:
  /// A triangle, or two that are next to each other and of one color, as four corners.
  struct Face {
    std::uint32_t first = 0;  ///< of the frame's indices
    bool is_quad = false;
  };
  /// What is painted one after the other.
  struct Job {
    enum class Kind { Triangles, Sprites, Points, Flatten } kind;
    bool is_opaque = true;
    std::uint32_t bins = 0;             ///< which run of the bins of its kind
    const PointBrush* brush = nullptr;  ///< points
    bool is_ordered = false;
    int mask = -1;  ///< of the frame; -1: none
  };
  /// A worker's place.
  struct Bench {
    explicit Bench(int width)
        : canvas(width),
          glass(width),
          brush(width),
          mask_sums(canvasSize(width)),
          mask(mask_sums.size()) {}
    static std::size_t canvasSize(int width) { return static_cast<std::size_t>(width) * kBandRows; }
    Canvas canvas;
    Canvas glass;  ///< for one translucent thing
    PolygonBrush brush;
    std::vector<float> mask_sums;
    std::vector<std::uint16_t> mask;
    int mask_index = -1;  ///< of `mask`, in this band
    std::vector<ScreenPoint> sorting;
  };

  void project(const LightFrame& frame);
  template <bool kFisheye>
  void projectPart(const LightFrame& frame, int worker);
  void addJobs(const LightFrame& frame);
  void addTriangles(const LightFrame& frame, const LightStep& step);
  void addSprites(const Sprites& sprites, const SpriteRun& run);
  void addPoints(const LightFrame& frame, const PointRun& run, const PointBrush& brush);
  void paintBand(const LightFrame& frame, int band, Bench& bench, std::uint8_t* rgb) const;
  void paintPoints(const Job& job, int band, const std::uint16_t* mask, Bench& bench) const;
  void paintSolid(const LightFrame& frame, const Job& job, int band, const std::uint16_t* mask,
                  Bench& bench) const;
  void paintFace(const LightFrame& frame, const Face& face, int row_begin, int row_end,
                 const std::uint16_t* mask, Bench& bench, Canvas& canvas) const;
  void findFaces(const LightFrame& frame, const LightStep& step);
  const std::uint16_t* maskOf(const LightFrame& frame, const Job& job, int band,
                              Bench& bench) const;
  ScreenTriangle triangle(const LightFrame& frame, std::uint32_t first) const;

  int width_, height_, bands_;
  FloatLens lens_;
  Workers& workers_;
  std::vector<ScreenVertex> vertices_;
  std::vector<Job> jobs_;
  std::vector<Face> faces_;  ///< of one step
  BandBins<Face> face_bins_;
  BandBins<std::uint32_t> sprite_bins_;
  BandBins<ScreenPoint> point_bins_;
  std::map<float, PointBrush> brushes_;  ///< by size; sizes are configured, so they are few
  std::array<Bench, Workers::kCount> benches_;
};

}  // namespace afterglow::render
