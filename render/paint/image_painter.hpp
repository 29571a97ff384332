/// \file
/// A whole image drawn by the CPU: every edge with the exact share of each pixel. Without a GPU
/// that is many times faster than OpenGL, and it needs no OpenGL at all.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "render/compose/workers.hpp"
#include "render/paint/band_bins.hpp"
#include "render/paint/canvas.hpp"
#include "render/paint/float_lens.hpp"
#include "render/paint/point_brush.hpp"
#include "render/paint/polygon_brush.hpp"
#include "render/paint/step_expander.hpp"

namespace afterglow::render {

/// Steps expanded for the CPU. A piece is a part of `runs` or of what `steps` has.
struct PaintList {
  ExpandedSteps steps;                     ///< the layers have its pieces as they are drawn
  std::vector<ScreenVertex> vertices;      ///< corners of its triangles, by project()
  std::vector<ScreenPoint> screen_points;  ///< the points of `runs`, and after them room
  std::vector<PointRun> runs;
  std::vector<ExpandedLayer> layers;
};

/// Things are put into the bins of the bands that they touch; then each worker paints band after
/// band. Keeps its buffers from image to image. Used from one thread at a time.
class ImagePainter {
 public:
  /// The workers must outlive it.
  ImagePainter(const calib::Lens& lens, Workers& workers);
  ImagePainter(const ImagePainter&) = delete;
  ImagePainter& operator=(const ImagePainter&) = delete;

  /// A flag for each band of kBandRows rows.
  using Bands = std::vector<char>;
  Bands allBands() const { return Bands(static_cast<std::size_t>(bands_), 1); }
  Bands noBands() const { return Bands(static_cast<std::size_t>(bands_), 0); }

  /// Has to be done before a list is painted, or its bands are marked.
  void project(PaintList& list);
  /// Marks the bands that steps of a list touch, of which none is a cloud of pixels.
  void mark(const PaintList& list, const StepEnds& from, const StepEnds& to, Bands& bands) const;
  /// Paints bands. 3 bytes a pixel, rows from the top, no padding; black where nothing is.
  void paint(const PaintList& list, const Bands& bands, std::uint8_t* rgb);

 private:
  /// A triangle, or a fan of them in about one plane and of one color.
  struct Face {
    std::uint32_t first = 0;  ///< first of the list's indices
    std::uint32_t triangles = 1;
  };
  /// Jobs are done one after the other.
  struct Job {
    enum class Kind { Triangles, Sprites, Points, Flatten } kind;
    bool is_opaque = true;
    std::uint32_t bins = 0;             ///< the run of the bins of its kind
    const PointBrush* brush = nullptr;  ///< points
    bool is_ordered = false;
    int mask = -1;  ///< index in the list of masks; -1: no mask
  };
  /// A worker's place.
  struct Bench {
    explicit Bench(int width)
        : canvas(width),
          glass(width),
          brush(width),
          mask_sums(static_cast<std::size_t>(width) * kBandRows + kPixelsAtOnce),
          mask(mask_sums.size()) {}
    Canvas canvas;
    Canvas glass;  ///< a canvas for one translucent thing
    PolygonBrush brush;
    ScreenPolygon polygon;
    std::vector<float> mask_sums;
    std::vector<std::uint16_t> mask;
    int mask_index = -1;  ///< index of `mask`, in this band
    std::vector<ScreenPoint> sorting;
  };

  template <bool kFisheye>
  void projectPart(PaintList& list, std::size_t begin, std::size_t end) const;
  Rows rowsBetween(float top, float bottom) const;
  void addJobs(const PaintList& list);
  void addTriangles(const PaintList& list, const Piece& piece);
  void addSprites(const Sprites& sprites, const Piece& piece);
  void addPoints(const PaintList& list, const PointRun& run, const PointBrush& brush);
  void paintBand(const PaintList& list, int band, Bench& bench, std::uint8_t* rgb) const;
  void paintPoints(const Job& job, int band, const std::uint16_t* mask, Bench& bench) const;
  void paintSolid(const PaintList& list, const Job& job, int band, const std::uint16_t* mask,
                  Bench& bench) const;
  void paintFace(const PaintList& list, const Face& face, int row_begin, int row_end,
                 const std::uint16_t* mask, Bench& bench, Canvas& canvas) const;
  void findFaces(const PaintList& list, const Piece& piece);
  bool isDisc(const PaintList& list, const Face& fan);
  std::uint32_t fanLength(const PaintList& list, const std::uint32_t* first,
                          const std::uint32_t* end) const;
  void setPolygon(const PaintList& list, const Face& face, ScreenPolygon& out) const;
  const std::uint16_t* maskOf(const PaintList& list, const Job& job, int band,
                              Bench& bench) const;
  ScreenTriangle triangle(const PaintList& list, std::uint32_t first) const;

  int width_, height_, bands_;
  FloatLens lens_;
  Workers& workers_;
  std::vector<Job> jobs_;
  std::vector<Face> faces_;  ///< the faces of one piece
  ScreenPolygon fan_;
  BandBins<Face> face_bins_;
  BandBins<std::uint32_t> sprite_bins_;
  BandBins<ScreenPoint> point_bins_;
  std::map<float, PointBrush> brushes_;  ///< brushes by size; sizes are configured, so they are few
  std::vector<Bench> benches_;           ///< a bench for each worker
};

}  // namespace afterglow::render
